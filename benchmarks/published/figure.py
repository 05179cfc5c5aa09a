"""What is in `figures.toml`: sources, the motions that they print figures of, and the figures.

    [source.KEY]    citation, url, place (section, page or line), original = false where only an account of it was at hand
    [motion.KEY]    moments (3,) or inertia (3, 3), kg m^2; rates (3,), rad/s, body axes; t_end, s; start (3, 3), R_WB;
                    weight, N, and com (3,), m, of a body about a fixed point. Or: scene, a name of this package's
    [[figure]]      name, source, motion, what (in words), setting (as printed), method (what is run here, or `truth`), dt, s,
                    quantity (one of `quantities.QUANTITIES`), printed; see `Figure`

A printed number is a text, so that its last digit is known: a unit of that is the tolerance, as programs round digits or cut
them off, unless there is a `tolerance`.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from decimal import Decimal, InvalidOperation
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

from conservative import registry
from conservative.body import RigidBody
from conservative.errors import BadInput
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene

from .quantities import QUANTITIES

DATA = Path(__file__).with_name("figures.toml")
TRUTH = "truth"
"""The method of a figure that is of the motion itself, whoever integrated it."""


class Relation(StrEnum):
    """What the printed figure says of the measured one."""

    EQUALS = "equals"
    BELOW = "below"
    ABOVE = "above"


@dataclass(frozen=True)
class Source:
    """Who printed it, and where. `original` is whether the source itself was looked at when the figure was copied."""

    key: str
    citation: str
    url: str
    place: str
    original: bool = True


@dataclass(frozen=True)
class Figure:
    """A figure that somebody has printed.

    Attributes
    ----------
    name, source
        Its name here, and who printed it.
    motion
        The body, its start, field and duration; None where it `cannot` be measured.
    what, setting
        What it is, and the printed setting, in words.
    method, dt
        What is run here, by name, or `truth`, and its step, s.
    quantity
        Name of what is measured, and of the method that it is compared with, if it is: `other`.
    printed
        The numbers as they are printed.
    relation, tolerance
        What they say of the measured ones, in the printed unit; the tolerance is for `equals` alone.
    explanation
        Why the measured figure differs from the printed one, where it does.
    instead
        Why another program is run here than the one that the figure was printed of, and which.
    cannot
        Why it cannot be measured here at all.
    """

    name: str
    source: Source
    what: str
    setting: str
    printed: tuple[str, ...]
    motion: Scene | None = None
    method: str = TRUTH
    dt: float = 0.0
    quantity: str = ""
    other: str = ""
    relation: Relation = Relation.EQUALS
    tolerance: float = 0.0
    explanation: str = ""
    instead: str = ""
    cannot: str = ""

    @property
    def values(self) -> tuple[float, ...]:
        """The printed numbers."""
        return tuple(map(float, self.printed))

    @property
    def allowed(self) -> float:
        """By how much a measured number may differ from the printed one: the tolerance, or a unit of its last digit."""
        return self.tolerance or max(map(last_digit, self.printed))


def last_digit(number: str) -> float:
    """Return a unit of the last digit of a number that is printed."""
    return 10.0 ** int(Decimal(number).as_tuple().exponent)


def read(path: Path = DATA) -> tuple[Figure, ...]:
    """Return the figures of a file.

    Raises
    ------
    BadInput
        The file is no TOML, or an entry lacks a field, has one that is unknown, or one that cannot be used.
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise _unusable(f"{str(path)!r} ({error})", "a TOML file with sources, motions and figures") from None
    sources = {key: _source(key, entry) for key, entry in content.get("source", {}).items()}
    motions = {key: _motion(key, entry) for key, entry in content.get("motion", {}).items()}
    figures = tuple(_figure(entry, sources, motions) for entry in content.get("figure", ()))
    names = [f"{figure.source.key}: {figure.name}" for figure in figures]
    for name in {name for name in names if names.count(name) > 1}:
        raise _unusable(f"{name!r} twice", "a name of its own for each figure")
    return figures


def _source(key: str, entry: Mapping[str, Any]) -> Source:
    return _make(Source, key, {"key": key, **entry})


def _motion(key: str, entry: Mapping[str, Any]) -> Scene:
    given = dict(entry)
    if name := given.pop("scene", ""):
        return registry.scene(name)
    try:
        body = RigidBody(given.pop("moments", None) or given.pop("inertia"))
        start, rates, t_end = given.pop("start", np.eye(3)), given.pop("rates"), given.pop("t_end")
        potential = UniformGravity(given.pop("weight"), given.pop("com")) if "weight" in given else None
    except KeyError as missing:
        raise _unusable(f"motion {key!r} without {missing}", "a motion with moments or inertia, rates and t_end") from None
    if given:
        raise _unusable(f"motion {key!r} with {', '.join(given)}", "moments, inertia, start, rates, t_end, weight, com")
    return Scene(key, body, start, rates, t_end, potential)


def _figure(entry: Mapping[str, Any], sources: Mapping[str, Source], motions: Mapping[str, Scene]) -> Figure:
    given, name = dict(entry), str(entry.get("name", "without a name"))
    given["source"] = _known("source", name, given.get("source", ""), sources)
    if "motion" in given:
        given["motion"] = _known("motion", name, given["motion"], motions)
    given["printed"] = tuple(given["printed"]) if isinstance(given.get("printed"), list) else (given.get("printed", ""),)
    given["relation"] = _known("relation", name, given.get("relation", "equals"), {each.value: each for each in Relation})
    return check(_make(Figure, name, given))


def _known(field: str, name: str, key: str, known: Mapping[str, Any]) -> Any:
    if key not in known:
        raise _unusable(f"{name!r} with {field} {key!r}", f"one of {', '.join(known)}")
    return known[key]


def _make(kind: type[Any], name: str, given: Mapping[str, Any]) -> Any:
    known = [field.name for field in fields(kind)]
    if unknown := sorted(set(given) - set(known)):
        raise _unusable(f"{name!r} with {', '.join(unknown)}", ", ".join(known))
    try:
        return kind(**given)
    except TypeError as missing:
        raise _unusable(f"{name!r} ({missing})", "all fields that have no default") from None


def check(figure: Figure) -> Figure:
    """Return a figure that can be used.

    Raises
    ------
    BadInput
        A printed number is none, the source has no citation, address or place, or nothing says how it is measured.
    """
    name, source = repr(figure.name), figure.source
    if not (figure.printed and all(map(is_number, figure.printed))):
        raise _unusable(f"{name} with printed {figure.printed}", "numbers, as texts with the digits that are printed")
    if not all((source.citation, source.place, source.url.startswith("https://"))):
        raise _unusable(f"{name} of source {source.key!r}", "a source with a citation, an address and a place")
    if not figure.cannot and not (figure.motion and figure.quantity in QUANTITIES and figure.dt > 0):
        raise _unusable(name, "a motion, a dt and a quantity that there is, or why it cannot be measured")
    return figure


def is_number(text: object) -> bool:
    """Return whether a text is a finite number."""
    try:
        return isinstance(text, str) and math.isfinite(Decimal(text))
    except InvalidOperation:
        return False


def _unusable(got: str, allowed: str) -> BadInput:
    return BadInput("figures", got, allowed)
