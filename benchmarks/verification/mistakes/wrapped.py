"""Mistakes of programs that save a file which they have loaded, set a mass, or scale: each changes the body of the file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array, from_quaternion, to_quaternion
from conservative.references.engines import shared
from conservative.references.model_files.pieces import Link, make_pose

from .bodies import BodyMistake, Links
from .mistake import Mistake, Number

DIGITS = range(2, 11)
"""Significant digits or decimals that are tried."""
Round = Callable[[Array], Array]


@dataclass(frozen=True)
class RoundedMistake(Mistake):
    """Numbers of a body are rounded: `round_to` returns the function that rounds to a number of digits."""

    kind: ClassVar[str] = "bodies"
    round_to: Callable[[int], Round]

    def bodies(self, links: Links) -> Iterator[tuple[int, Links]]:
        """Yield numbers of digits and the links in each of the three forms in which files have an inertia."""
        for digits in DIGITS:
            for form in (_with_quaternion, _with_angles, _with_products):
                yield digits, [form(link, self.round_to(digits)) for link in links]


def _significant(digits: int) -> Round:
    return lambda values: np.vectorize(lambda value: float(f"{value:.{digits}g}"))(np.asarray(values, float))


def _decimals(digits: int) -> Round:
    return lambda values: np.round(np.asarray(values, float), digits)


def _rounded(link: Link, rounding: Round, moments: Array, axes: Array) -> Link:
    com = rounding(link.frame[:3, 3])
    return replace(
        link, mass=float(rounding(np.array(link.mass))), frame=make_pose(com, axes), inertia=np.diag(rounding(moments))
    )


def _with_quaternion(link: Link, rounding: Round) -> Link:
    q = rounding(to_quaternion(link.frame[:3, :3]))
    return _rounded(link, rounding, np.diag(link.inertia), from_quaternion(q / np.linalg.norm(q)))


def _with_angles(link: Link, rounding: Round) -> Link:
    """Return the link with roll, pitch and yaw of its principal axes, in ascending order of moments."""
    order = np.argsort(np.diag(link.inertia))
    axes = link.frame[:3, :3][:, order]
    axes = axes * np.array([1, 1, np.linalg.det(axes)])
    angles = rounding(Rotation.from_matrix(axes).as_euler("xyz"))
    return _rounded(link, rounding, np.diag(link.inertia)[order], Rotation.from_euler("xyz", angles).as_matrix())


def _with_products(link: Link, rounding: Round) -> Link:
    R = link.frame[:3, :3]
    return replace(_rounded(link, rounding, np.zeros(3), np.eye(3)), inertia=rounding(R @ link.inertia @ R.T))


def _times(factor: float, links: Links) -> Links:
    return [replace(link, inertia=factor * link.inertia) for link in links]


def _equal(links: Links) -> Links:
    return [replace(link, inertia=np.trace(link.inertia) / 3 * np.eye(3)) for link in links]


_DIGITS = (Number("digits", 17.0),)
SAVED = (
    RoundedMistake("saved digits", "Numbers are saved with {digits:.0f} significant digits", _significant, numbers=_DIGITS),
    RoundedMistake("saved decimals", "Numbers are saved with {digits:.0f} decimals", _decimals, numbers=_DIGITS),
)
"""Mistakes of the writers of files, whose digits are fitted."""
KEPT = (
    BodyMistake(
        "inertia of the former mass",
        "The inertia is that of the former mass",
        partial(_times, shared.OTHER_MASS),
    ),
    BodyMistake("inertia scaled with the mass", "The inertia is scaled with the mass", partial(_times, 1 / shared.OTHER_MASS)),
    BodyMistake(
        "inertia of the former size", "The inertia is not scaled with the size", partial(_times, shared.OTHER_SIZE**-2)
    ),
    BodyMistake("equal moments for any axis", "The three moments are equal", _equal),
)
"""Mistakes of setters, of scaling, and of bodies without a shape."""
