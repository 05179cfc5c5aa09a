"""The readers of a model file: the reference reader of its format, and this package's. Both run in a worker with limits.

The first reading is by urdfdom (in Pinocchio), MuJoCo, usd-core (`reference`) or libsdformat (in Drake, see `verify_files`).
The second one is by this package (`description`, `mjcf`, `usd`). They share no function. Where they disagree about a body, no
engine can be called wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from conservative.errors import BadInput, MissingEngine, MissingExtra

from ..engine import version
from ..worker.calls import python_worker, run_within
from ..worker.client import EngineCrashed, EngineTimeout
from .description import read_xml
from .files import Unread, kind_of, reason, refuse
from .loaders import family
from .mjcf import NotRead, read_mjcf
from .pieces import QUANTITIES, Link, Piece, Reading, differing, distance, join, join_links, list_numbers, touched
from .reference import Refused, by_mujoco, by_urdfdom, by_usd_core
from .robots import Body, split
from .usd import read_usd

SECONDS = 60.0
"""Time in seconds that reading a file may take."""
MEMORY = 2 * 2**30
"""Memory in bytes that reading a file may take, including the engine, where the system supports a limit."""
AGREE = 1e-4
"""Largest relative distance of two readings of one body. usd-core has single precision: measured 1.6e-7."""
REFERENCE = {"urdf": "urdfdom", "mjcf": "MuJoCo", "sdf": "libsdformat", "usd": "usd-core"}
"""Parsers of the reference readers, as in `loaders.FAMILIES`."""
FIRST: dict[str, tuple[str, str, str, Callable[[Path], tuple[Piece, list[str]]]]] = {
    "urdf": ("urdfdom in Pinocchio", "pin", "Pinocchio", by_urdfdom),
    "mjcf": ("MuJoCo", "mujoco", "MuJoCo", by_mujoco),
    "usd": ("usd-core", "usd-core", "usd-core", by_usd_core),
}
"""The reference reading of a format: its name, the package and the usual name of the implementation, and the function."""
SECOND: dict[str, Callable[[Path, Sequence[Path], Reading], list[Link]]] = {
    "urdf": read_xml,
    "sdf": read_xml,
    "mjcf": read_mjcf,
    "usd": read_usd,
}
"""The reading of a format by this package. It shares no function of this package with the first one."""
OWN = "this package"
DIGITS = "the digits of the file leave open if a body is like this"


@dataclass
class Model(Reading):
    """A body of a model file, and what its readers make of it.

    `file` is the name of the file, and `label` has the name of the body as well if the file has several.
    `reference` is the body by the `reader`, which is "" if none is installed, and `own` that by this package; or None, and why.
    """

    file: str = ""
    label: str = ""
    body: Body = field(default_factory=Body)
    kind: str = ""
    own: Piece | None = None
    own_refuses: str = ""
    reader: str = ""
    reference: Piece | None = None
    reference_refuses: str = ""

    @property
    def path(self) -> Path:
        """The file that engines load."""
        return self.body.path

    @property
    def truth(self) -> Piece:
        """The body by the reference reader if it has one; the possible one if there is one; else that by this package."""
        parts = [part for part in (None if self._repaired else self.reference, self.own) if part]
        return next((part for part in parts if not part.flaw), parts[-1])

    @property
    def _repaired(self) -> bool:
        """True if the reference reader is an engine that has repaired an impossible inertia."""
        bad = self.kind == "sdf" and self.own and (self.own.flaw or self.own.excess)
        return bool(bad and self.reference and not (self.reference.flaw or self.reference.excess))

    @property
    def disagree(self) -> str:
        """Disagreement of the readers; "" if they agree, or if no body is like any reading."""
        if not self.own or self._repaired or all(part.flaw for part in (self.own, self.reference) if part):
            return ""
        if self.reference and (far := differing(self.reference, self.own, AGREE)):
            return f"the readers disagree, {self.reader} and {OWN}: {', '.join(far)}"
        return f"{self.reader} does not read the file ({self.reference_refuses})" if self.reference_refuses else ""

    @property
    def flaw(self) -> str:
        """Reason that no body is like the file's; "" if a body can be, or if the readers disagree about it."""
        return "" if self.disagree else self.truth.flaw

    @property
    def bad(self) -> list[str]:
        """Links that no body is like, although the whole body may be possible."""
        return [f"{link.name!r}, a link of the body: {link.flaw}" for link in self.links if link.flaw and len(self.links) > 1]

    @property
    def lonely(self) -> str:
        """Reason that there is one reader only; "" if there are two."""
        if self.own and not self.reader:
            package = FIRST[self.kind][1] if self.kind in FIRST else ""
            how = f"pip install {package}" if package else "conservative engines install drake"
            return f"no reference reader is installed ({how})"
        return "" if self.own else f"{OWN} does not read the file ({self.own_refuses})"

    def _asks(self, engine: str) -> dict[str, str]:
        """Return the options of the file for an engine that change this body."""
        same = family(engine, self.kind)  # `mujoco` stands for all engines that read with MuJoCo
        asked = {key: text for name, asks in self.asks.items() if same == family(name, self.kind) for key, text in asks.items()}
        possible = not self.truth.flaw and not self.bad
        return {key: text for key, text in asked.items() if not (possible and key == "balanceinertia")}

    def doubt(self, engine: str, differs: Sequence[str] = QUANTITIES) -> str:
        """Return why nothing can be said against an engine whose body `differs` in these quantities; "" if it can."""
        asks = self._asks(engine)
        excused = asks and set(differs) <= {name for option in asks for name in touched(option)}
        excuse = [f"the file asks for {', '.join(asks.values())}"] if excused else []
        return "; ".join(filter(None, [self.disagree, *self.invalid, *self.bad, *self.doubts, *excuse]))

    def alone(self, engine: str) -> bool:
        """Return True if an engine would be compared with itself."""
        return self.own is None and family(engine, self.kind) == REFERENCE[self.kind]

    def asked_for(self, engine: str, seen: Piece, tolerance: float) -> str:
        """Return the options of the file for an engine if they explain the body that it has."""
        asks, part = self._asks(engine), self.truth
        if "inertiafromgeom" in asks:
            part = join(link.geometry.place(link.pose) for link in self.links)
        if "balanceinertia" in asks and (part.flaw or self.bad):
            part = replace(part, inertia=np.eye(3) * np.trace(part.inertia) / 3)
        return ", ".join(asks.values()) if asks and part.mass and distance(part, seen) < tolerance else ""

    def readings(self) -> dict[str, Any]:
        """Return the body by each reader, or why it has none."""
        parts = {self.reader: self.reference or self.reference_refuses, OWN: self.own or self.own_refuses}
        return {
            name: {key: np.asarray(value).tolist() for key, value in vars(part).items()} if isinstance(part, Piece) else part
            for name, part in parts.items()
            if name and part
        }


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
    with _sentences(path):
        bodies = split(path, kind, folder, search)
    models, refused = [], list[tuple[str, BadInput]]()
    for body in bodies:
        name = f"{label}: {body.name}" if len(bodies) > 1 else label
        model = Model(file=label, label=name, body=body, kind=kind, notes=[*body.notes])
        try:
            with _sentences(path):
                _read(model, [body.path.parent, path.parent, *search])
            models.append(model)
        except BadInput as error:
            refused.append((body.name, error))
    if not models:
        raise refused[0][1]
    models[0].notes += [f"{name!r} is left out: {reason(error)}" for name, error in refused]
    return models


@contextmanager
def _sentences(path: Path) -> Iterator[None]:
    """Turn errors about a file into `BadInput`, without the messages of libraries that read its numbers."""
    try:
        yield
    except (BadInput, MissingEngine, MissingExtra):
        raise
    except RecursionError:
        raise refuse(path, "frames that refer to each other in a circle", "frames that lead to the model") from None
    except Exception as error:
        what = f"{error}" if isinstance(error, Unread) else f"something that cannot be read ({type(error).__name__})"
        what = f"a reference to {error}, which is not there" if isinstance(error, KeyError) else what
        raise refuse(path, what, "elements and numbers of its format") from None


def _read(model: Model, search: Sequence[Path]) -> None:
    """Fill a model with the results of both readers for its body. Raise `BadInput` if it cannot be read."""
    path, kind = model.path, model.kind
    try:
        model.links = SECOND[kind](path, search, model)
    except NotRead as error:
        model.own_refuses = f"there is no rule here for {error}"
    except Exception as error:
        if kind != "mjcf":  # only MuJoCo defines MJCF
            raise
        model.own_refuses = reason(error) if isinstance(error, BadInput) else f"{type(error).__name__}"
    finite = [number for link in model.links for number in (link.mass, *link.inertia.flat, *link.frame.flat, *link.pose.flat)]
    if not np.isfinite(finite).all():
        raise refuse(path, "numbers that are not finite", "finite numbers in m, kg and kg m^2")
    if kind != "mjcf" and not any(link.mass for link in model.links):
        raise refuse(path, "no mass in any link", "mass and inertia of a link")
    if model.links:
        base = np.linalg.inv(model.links[0].pose)
        model.links = [replace(link, pose=base @ link.pose) for link in model.links]
        model.own = join_links(model.links)
    if kind in FIRST:
        _read_reference(model)
    truth = model.truth
    model.links = model.links or [Link(np.eye(4)).filled(truth)]
    if model.flaw or truth.excess:
        text = (
            f"no body is like this: {model.flaw}" if model.flaw else "the digits of the file leave open if a body is like this"
        )
        moments = list_numbers(np.linalg.eigvalsh(truth.inertia))
        model.notes.append(f"{text} (mass {truth.mass:.4g} kg, principal moments {moments} kg m^2)")
    asks = [f"the file asks {name} for {', '.join(options.values())}" for name, options in model.asks.items()]
    model.notes = list(dict.fromkeys([*model.notes, *model.invalid, *model.bad, *model.doubts, *asks]))


def _read_reference(model: Model) -> None:
    """Add the body by the reference reader of the format. Raise `BadInput` if neither reader has one, and for MJCF."""
    name, package, engine, read = FIRST[model.kind]
    try:
        model.reader = f"{name} {version(package, engine)}"
        model.reference, warned = read(model.path)
        model.notes += warned
        if not np.isfinite([model.reference.mass, *model.reference.inertia.flat]).all() or not model.reference.mass:
            model.reference, model.reference_refuses = None, "it finds no mass, or an inertia that is not finite"
    except MissingEngine:
        if model.own is None:
            raise
        model.reader = ""
    except Refused as error:
        if model.own is None or model.kind == "mjcf":
            raise refuse(model.path, str(error), f"a file that {engine} reads") from None
        model.reference_refuses = str(error)
