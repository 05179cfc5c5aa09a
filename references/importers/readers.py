"""The readers of a model file: the reference reader of its format, and this package's. Both run in a worker with limits.

The references are urdfdom (in Pinocchio), MuJoCo, usd-core and libsdformat (in Drake, see `compare`). Where the two readers
disagree about a body, no engine can be called wrong.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import QhullError

from conservative.errors import BadInput, MissingEngine, MissingExtra

from ..engine import version
from ..worker.calls import python_worker, run_within
from ..worker.client import EngineCrashed, EngineTimeout
from .description import read_links, read_own
from .files import kind_of, reason, refuse
from .mjcf import NotRead, second_opinion
from .model_files import MEMORY, SECONDS, urdf_bodies
from .pieces import Link, Piece, distance, join, join_links
from .robots import split
from .usd import reference_usd

AGREE = 1e-4
"""Largest relative distance of two readings of one body. usd-core has single precision: measured 1.6e-7."""
FAMILY = {
    "urdf": ("pinocchio",),
    "mjcf": ("mujoco", "mujoco_js", "mjx", "mjwarp"),
    "sdf": ("drake",),
}
"""Engines that read a format with its reference reader."""
OWN = "this package"


@dataclass
class Model:
    """A body of a model file, and what its readers make of it; see `Reading` for notes, doubts, invalid and asks.

    `reference` is the body by the `reader`, which is "" if none is installed, and `own` that by this package; or None, and why.
    `units` has the body with angles in the other unit, by the mistake.
    """

    label: str
    path: Path
    kind: str
    notes: list[str]
    doubts: list[str] = field(default_factory=list)
    invalid: list[str] = field(default_factory=list)
    asks: dict[str, list[str]] = field(default_factory=dict)
    links: list[Link] = field(default_factory=list)
    own: Piece | None = None
    own_refuses: str = ""
    reader: str = ""
    reference: Piece | None = None
    reference_refuses: str = ""
    units: dict[str, Piece] = field(default_factory=dict)

    @property
    def truth(self) -> Piece:
        """The body by the reference reader if it has one; the possible one if the readers disagree."""
        parts = [part for part in (None if self._repaired else self.reference, self.own) if part]
        return next((part for part in parts if not part.flaw), parts[0])

    @property
    def _repaired(self) -> bool:
        """Whether the reference reader is an engine that has repaired an impossible inertia."""
        return bool(self.kind == "sdf" and self.own and self.own.flaw and self.reference and not self.reference.flaw)

    @property
    def disagree(self) -> str:
        """How the readers disagree; "" if they do not."""
        if self.own and self.reference and not self._repaired and distance(self.own, self.reference) > AGREE:
            return f"the readers disagree, {self.reader} and {OWN}"
        if self.own and self.reference_refuses and not self.own.flaw:
            return f"{self.reader} does not read the file ({self.reference_refuses})"
        return ""

    @property
    def flaw(self) -> str:
        """Why no body is like that of the file; "" if one is, or if the readers disagree about it."""
        return "" if self.disagree else self.truth.flaw

    @property
    def bad(self) -> list[str]:
        """Links that no body is like, although the whole body may be possible."""
        return [f"{link.name!r}, a link of the body: {link.flaw}" for link in self.links if link.flaw and len(self.links) > 1]

    @property
    def lonely(self) -> str:
        """Why there is one reader only; "" if there are two."""
        if self.own and not self.reader:
            return "no reference reader is installed"
        return "" if self.own else f"{OWN} does not read the file ({self.own_refuses})"

    def doubt(self, engine: str) -> str:
        """Return why nothing can be said against an engine; "" if it can."""
        asks = [f"the file asks for {', '.join(asks)}" for name, asks in self.asks.items() if engine in _family(name)]
        return "; ".join(filter(None, [self.disagree, *self.invalid, *self.bad, *self.doubts, *asks]))

    def alone(self, engine: str) -> bool:
        """Whether an engine would be compared with itself."""
        return self.own is None and engine in FAMILY.get(self.kind, ())

    def asked_for(self, engine: str, seen: Piece, tolerance: float) -> str:
        """Return the options of the file for an engine if they explain the body that it has."""
        asks = ", ".join(ask for name, asks in self.asks.items() if engine in _family(name) for ask in asks)
        mean = Piece(self.truth.mass, self.truth.com, np.eye(3) * np.trace(self.truth.inertia) / 3)
        options = {"inertiafromgeom": join(link.geometry.place(link.pose) for link in self.links), "balanceinertia": mean}
        return (
            asks
            if any(name in asks and distance(part, seen) < tolerance for name, part in options.items() if part.mass)
            else ""
        )

    def readings(self) -> dict[str, Any]:
        """Return the body by each reader, or why it has none."""
        parts = {self.reader: self.reference or self.reference_refuses, OWN: self.own or self.own_refuses}
        return {
            name: {key: np.asarray(value).tolist() for key, value in vars(part).items()} if isinstance(part, Piece) else part
            for name, part in parts.items()
            if name and part
        }


def _family(name: str) -> tuple[str, ...]:
    return FAMILY["mjcf"] if name == "mujoco" else (name,)


def read_files(paths: Sequence[Path], folder: Path, search: Sequence[Path] = ()) -> list[Model]:
    """Return the bodies of files. Copies for engines are written into a folder.

    Raise `BadInput` for a file that cannot be read, or not within the limits, `MissingEngine` and `MissingExtra`.
    """
    worker, models = python_worker({"OPENBLAS_NUM_THREADS": "1"}, MEMORY), list[Model]()
    unique = len({path.name for path in paths}) == len(paths)
    try:
        for path in paths:
            try:
                models += run_within(
                    SECONDS, partial(read_here, path, path.name if unique else str(path), folder, search), process=worker
                )
            except (EngineCrashed, EngineTimeout) as failure:
                allowed = f"a file that is read within {SECONDS:g} s and {MEMORY / 2**30:g} GiB"
                raise BadInput("file", f"{str(path)!r}, whose reading ended: {failure.outcome}", allowed) from None
    finally:
        worker.close()
    return models


def read_here(path: Path, label: str, folder: Path, search: Sequence[Path] = ()) -> list[Model]:
    """Return the bodies of a file as `read_files`, in this process."""
    kind = kind_of(path)
    try:
        bodies = split(path, kind, folder, search)
    except (BadInput, MissingExtra):
        raise
    except RecursionError:
        raise refuse(path, "frames that refer to each other in a circle", "frames that lead to the model") from None
    except Exception as error:  # of the libraries that read it
        what = f"what cannot be read ({type(error).__name__}: {error})"
        raise refuse(path, what, "elements and numbers of its format") from None
    models, refused = [], list[tuple[str, BadInput]]()
    for name, place, notes in bodies:
        try:
            models.append(
                _read(
                    Model(f"{label}: {name}" if name else label, place, kind, list(notes)), [place.parent, path.parent, *search]
                )
            )
        except BadInput as error:
            refused.append((name, error))
    if not models:
        raise refused[0][1]
    models[0].notes += [f"{name!r} is left out: {reason(error)}" for name, error in refused]
    return models


def _read(model: Model, search: Sequence[Path]) -> Model:
    """Return a body with what both readers say about it. Raise `BadInput` if it cannot be read."""
    path, kind, reading = model.path, model.kind, read_own(model.path, 1.0, search)
    model.links, model.own = reading.links, join_links(reading.links)
    model.notes += reading.notes
    model.doubts, model.invalid, model.asks = reading.doubts, reading.invalid, reading.asks
    if kind == "mjcf":  # MuJoCo has read it so far
        model.reader, model.reference = f"MuJoCo {version('mujoco', 'MuJoCo')}", model.own
        try:
            model.own = second_opinion(path, search)
        except (NotRead, BadInput, KeyError, ValueError, IndexError, QhullError) as error:
            model.own, model.own_refuses = None, f"there is no rule here for {error}"
    elif kind == "usd":
        model.reader = f"usd-core {version('usd-core', 'usd-core')}"
        model.reference, model.reference_refuses = _attempt(partial(reference_usd, path, search))
    elif kind == "urdf":
        try:
            model.reader = f"urdfdom in Pinocchio {version('pin', 'Pinocchio')}"
            model.reference, model.reference_refuses = _attempt(partial(_urdfdom, path))
        except MissingEngine:
            pass
    if kind != "usd" and model.own:
        for name, factor in (("degrees are read as radians", 180 / math.pi), ("radians are read as degrees", math.pi / 180)):
            model.units[name] = join_links(read_links(path, factor, search))
    if flaw := model.flaw:
        moments = ", ".join(f"{value:.3g}" for value in np.linalg.eigvalsh(model.truth.inertia))
        model.notes.append(f"no body is like this: {flaw} (mass {model.truth.mass:.4g} kg, principal moments {moments} kg m^2)")
    model.notes += [
        *model.invalid,
        *model.bad,
        *model.doubts,
        *(f"the file asks {name} for {', '.join(asks)}" for name, asks in model.asks.items()),
    ]
    model.notes = list(dict.fromkeys(model.notes))
    return model


def _attempt(read: partial[Piece]) -> tuple[Piece | None, str]:
    try:
        part = read()
    except BadInput as error:
        return None, reason(error)
    finite = np.isfinite([part.mass, *part.com, *part.inertia.ravel()]).all()
    return (part, "") if finite and part.mass else (None, f"it finds mass {part.mass:g} and no finite inertia")


def _urdfdom(path: Path) -> Piece:
    bodies = [part for part, _ in urdf_bodies(str(path)).values() if part.mass]
    if len(bodies) != 1:
        raise refuse(path, f"{len(bodies)} bodies that have a mass", "one body")
    return bodies[0]
