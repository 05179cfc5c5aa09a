"""Mass, centre of mass and inertia of parts, links and shapes, and the result of reading a file that has them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array

ONE = "one free rigid body, whose parts are on fixed joints"
DENSITY = 1000.0
"""Density of geometry that has none in a file, kg/m^3."""
SHAPES = ("box", "sphere", "ellipsoid", "cylinder", "capsule", "cone", "mesh", "plane")
"""Shapes of `weigh`; a plane has no mass."""


QUANTITIES = ("mass", "centre of mass", "inertia")


@dataclass(frozen=True, eq=False)
class Piece:
    """Mass, kg, centre of mass (3,), m, and inertia about it (3, 3), kg m^2, with the rounding error of its moments."""

    mass: float
    com: Array
    inertia: Array
    rounding: float = 0.0

    def place(self, pose: Array) -> Piece:
        """Return the part in other axes; `pose` (4, 4) is the pose of its present axes in them."""
        R = pose[:3, :3]
        return Piece(self.mass, R @ self.com + pose[:3, 3], R @ self.inertia @ R.T, self.rounding)

    def scale(self, factor: float) -> Piece:
        """Return the part with another density."""
        return Piece(factor * self.mass, self.com, factor * self.inertia, abs(factor) * self.rounding)

    @property
    def excess(self) -> float:
        """Largest moment minus the sum of the others, kg m^2; 0 for a body that can exist, and for round-off."""
        moments = np.linalg.eigvalsh(self.inertia)
        excess = float(moments[2] - moments[0] - moments[1])
        return excess if excess > 1e-9 * moments[2] else 0.0

    @property
    def flaw(self) -> str:
        """Reason that no body can have this mass and inertia; empty if a body can, within the digits of its moments."""
        moments = np.linalg.eigvalsh(self.inertia)
        if not self.mass > 0:
            return "the mass is not positive"
        if not self.inertia.any():
            return "there is a mass without inertia"
        if not moments[0] > 0:
            return "a principal moment is not positive"
        # The largest moment of a planar body is the sum of the others, and rounded digits can be above it. At most a tenth is
        # excused: 0.01, 0.02, 0.04 is a mistake, although moments with a single digit may be off by more.
        slack = max(1e-6 * moments[2], min(self.rounding, 0.1 * moments[2]))
        return "a moment exceeds the sum of the others" if self.excess > slack else ""


def rounding_of(moments: Iterable[Any]) -> float:
    """Return the largest rounding error of a sum of three moments, kg m^2, from the digits that they are written with."""
    exponents = [Decimal(str(moment)).normalize().as_tuple().exponent for moment in moments if moment and np.isfinite(moment)]
    return 1.5 * 10.0 ** min(map(int, exponents), default=-300)  # three times half a unit of the last digit


@dataclass(frozen=True, eq=False)
class Link:
    """A link, fixed to the root link.

    `pose` (4, 4) is the pose of the link in the root link, and `frame` (4, 4) the pose of the inertial frame in the link, m.
    `inertia` (3, 3) is in the inertial frame, kg m^2, with a `rounding` as in `Piece`. `geometry` has the density `DENSITY`.
    `without` has the part in the axes of the link by the options of the file that a loader may ignore.
    """

    pose: Array
    mass: float = 0.0
    frame: Array = field(default_factory=lambda: np.eye(4))
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))
    geometry: Piece = Piece(0.0, np.zeros(3), np.zeros((3, 3)))
    name: str = ""
    rounding: float = 0.0
    without: Mapping[str, Piece] = field(default_factory=dict)

    @property
    def part(self) -> Piece:
        """Mass and inertia in the axes of the root link."""
        return Piece(self.mass, np.zeros(3), self.inertia, self.rounding).place(self.pose @ self.frame)

    @property
    def flaw(self) -> str:
        """The reason of `Piece.flaw`; empty for a link without mass and inertia, which is a frame."""
        return self.part.flaw if self.mass or self.inertia.any() else ""

    def filled(self, part: Piece) -> Link:
        """Return the link with mass and inertia of a part in its axes."""
        return replace(self, mass=part.mass, frame=make_pose(part.com), inertia=part.inertia, rounding=part.rounding)


def join_links(links: Iterable[Link]) -> Piece:
    """Return mass, centre of mass and inertia of links, in the axes of the root link."""
    return join(link.part for link in links)


def join(parts: Iterable[Piece]) -> Piece:
    """Return the whole: m = sum m_i, m c = sum m_i c_i, J = sum J_i + m_i (d_i.d_i 1 - d_i d_i'), d_i = c_i - c (Steiner)."""
    parts = list(parts)
    mass = sum(part.mass for part in parts)
    com = sum((part.mass * part.com for part in parts), np.zeros(3)) / (mass or 1.0)
    inertia = sum((part.inertia + steiner(part.mass, part.com - com) for part in parts), np.zeros((3, 3)))
    return Piece(mass, com, inertia, sum(part.rounding for part in parts))


def steiner(mass: float, d: Array) -> Array:
    """Return the inertia (3, 3) of a point mass at d (3,) about the origin."""
    return mass * (d @ d * np.eye(3) - np.outer(d, d))


def make_pose(place: Any = (0, 0, 0), R: Array | Rotation | None = None) -> Array:
    """Return the pose (4, 4) of a place (3,) and a rotation."""
    T = np.eye(4)
    T[:3, 3] = place
    T[:3, :3] = np.eye(3) if R is None else R.as_matrix() if isinstance(R, Rotation) else R
    return T


def errors(part: Piece, other: Piece, scale: Piece | None = None) -> dict[str, float]:
    """Return the differences of the `QUANTITIES`, relative to the values of `scale`, by default of `part`."""
    unit = scale or part
    # A centre of mass can be at 0, so its error is relative to the size of the body, which the inertia shows. A body that is
    # much smaller than its distance is a point: its centre has an error of rounding at that distance.
    size = np.sqrt(abs(np.trace(unit.inertia) / unit.mass)) if unit.mass else 0.0
    size = max(size, 1e-9 * np.linalg.norm(unit.com)) or 1.0
    pairs = (other.mass - part.mass, unit.mass), (other.com - part.com, size), (other.inertia - part.inertia, unit.inertia)
    norms = [(np.linalg.norm(difference), np.linalg.norm(whole)) for difference, whole in pairs]
    relative = [error and error / (whole or 1e-300) for error, whole in norms]  # no error of a value of 0 is 0, not nan
    return dict(zip(QUANTITIES, map(float, np.nan_to_num(relative, nan=np.inf)), strict=True))


def distance(part: Piece, other: Piece, scale: Piece | None = None) -> float:
    """Return the largest of `errors`."""
    return max(errors(part, other, scale).values())


def differing(part: Piece, other: Piece, tolerance: float) -> list[str]:
    """Return the quantities that differ, each with both values: "mass 2 and 3 kg"."""
    far = [name for name, error in errors(part, other).items() if not error < tolerance]
    texts = {
        "mass": ([part.mass], [other.mass], "kg"),
        "centre of mass": (part.com, other.com, "m"),
        "inertia": (*(piece.inertia[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)] for piece in (part, other)), "kg m^2"),  # xx ... yz
    }
    return [f"{name} {list_numbers(texts[name][0])} and {list_numbers(texts[name][1])} {texts[name][2]}" for name in far]


ROUND_OFF = 1e-7
"""Numbers below this share of the largest one beside them are shown as 0."""


def list_numbers(values: Any, unit: float = 0.0) -> str:
    """Return numbers as text, with 0 for numbers that are round-off beside the largest one, or beside `unit`."""
    values = np.ravel(values)
    least = ROUND_OFF * max(unit, np.abs(values).max())
    return " ".join(f"{value:.4g}" if abs(value) > least else "0" for value in values)


@dataclass
class Reading:
    """The result of reading a file: its links, the root first, and remarks.

    `notes` name parts of the file that are not read because they do not matter. `doubts` are reasons that another body may be
    right, too: no engine is called wrong against them. `invalid` names rules of the format that the file breaks, so that an
    engine may refuse it. `asks[engine][option]` is the text of an option that is for one engine and may change the body.
    """

    links: list[Link] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)
    invalid: list[str] = field(default_factory=list)
    asks: dict[str, dict[str, str]] = field(default_factory=dict)

    def ask(self, engine: str, option: str, value: str, text: str) -> None:
        """Add an option for an engine, or a note if it cannot change the body."""
        if touched(option) and value not in _OFF:
            self.asks.setdefault(engine, {})[option] = text
        else:
            self.notes.append(f"{text} is for {engine}, and does not change a mass or an inertia")


_TOUCHED = {
    "balanceinertia": ("inertia",),
    "boundinertia": ("inertia",),
    "boundmass": ("mass",),
    "settotalmass": ("mass", "inertia"),
}
_OFF = ("false", "0", "auto", "-1", "0 5")
"""Values with which such an option has no effect; "0 5" is the default of MuJoCo's `inertiagrouprange`."""


def touched(option: str) -> Sequence[str]:
    """Return the `QUANTITIES` that an option of an engine may change."""
    # The inertia of a rotor belongs to a joint.
    changes_mass = re.search("mass|inertia|density", option.lower()) and "rotor" not in option.lower()
    return _TOUCHED.get(option.lower(), QUANTITIES if changes_mass else ())


def weigh(kind: str, sizes: Any, pose: Array, density: float) -> list[Piece]:
    """Return a list with the part of a shape after an affine map `pose` (4, 4), which may scale it; empty for other kinds.

    Shapes are centred and about the third axis: "box" (edges), "sphere" (radius), "ellipsoid" (semi-axes), "cylinder" and
    "capsule" (radius, length of the cylinder), "cone" (radius, height, centred at half of it, the tip up), "mesh" (vertices and
    triangles), m. The density is valid after the map, kg/m^3.
    """
    # `second` is the integral of x x' about the centroid; an affine map A takes it to A second A'. J = tr(second) 1 - second.
    centroid = np.zeros(3)
    if kind == "mesh":  # tetrahedra from the origin
        corners = np.asarray(sizes[0], float)[np.asarray(sizes[1])]
        total, weight = corners.sum(axis=1), np.linalg.det(corners)
        volume = weight.sum() / 6
        centroid = weight @ total / 24 / volume
        second = (total.T * weight) @ total + np.einsum("n,nki,nkj->ij", weight, corners, corners)
        second = second / 120 - volume * np.outer(centroid, centroid)
    elif kind in ("box", "ellipsoid", "sphere"):
        sides = np.broadcast_to(sizes, 3)
        volume = np.prod(sides) * (1 if kind == "box" else 4 / 3 * math.pi)
        second = volume * np.diag(sides**2) / (12 if kind == "box" else 5)
    elif kind in ("cylinder", "capsule"):
        r, length = sizes
        rod, ball = math.pi * r * r * length, 4 / 3 * math.pi * r**3 * (kind == "capsule")
        # The halves of a ball are moved to the ends, which adds this along the axis: the centroid of a half is at 3 r / 8.
        ends = ball * (length**2 / 4 + 3 * length * r / 8)
        volume = rod + ball
        second = np.diag([rod * r * r / 4] * 2 + [rod * length**2 / 12 + ends]) + ball * r * r / 5 * np.eye(3)
    elif kind == "cone":
        r, length = sizes
        volume, centroid = math.pi * r * r * length / 3, np.array([0, 0, -length / 4])
        second = volume * np.diag([r * r * 3 / 20] * 2 + [length**2 * 3 / 80])
    else:
        return []
    A, factor = pose[:3, :3], density * abs(np.linalg.det(pose[:3, :3])) * math.copysign(1, volume)  # a mesh may be inside out
    second = factor * A @ second @ A.T
    return [Piece(factor * volume, A @ centroid + pose[:3, 3], np.trace(second) * np.eye(3) - second)]
