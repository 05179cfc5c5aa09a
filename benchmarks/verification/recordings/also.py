"""Attitudes that a file has twice, such as quaternions and angles: whether both are the same."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np

from conservative.attitude import Array, angle_between

from ..compare import FLOOR, UNITS_OF_DIGITS
from .attitudes import to_matrices
from .digits import TURNS, find_quantum
from .layout import ATTITUDES, Layout, Options

TRIED = 200
"""Number of rows on which readings are tried."""
SEQUENCES = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz")


@dataclass(frozen=True)
class Other:
    """Attitudes in other columns: their names, the largest angle to the compared ones, rad, and their rounding, rad."""

    names: Sequence[str]
    difference: float
    digits: float

    def allowed(self, digits: float) -> float:
        """Return the angle, rad, that the rounding of both allows; `digits` is the rounding of attitudes that are compared."""
        return FLOOR + UNITS_OF_DIGITS * (self.digits + digits)

    @property
    def text(self) -> str:
        """Text on the difference, for a sentence."""
        return f"another attitude (by {self.difference:.2g} rad)" if math.isfinite(self.difference) else "no attitudes"


def compare_others(R: Array | None, values: Array, layout: Layout, options: Options) -> list[Other]:
    """Return the other attitudes of a file, which are in `values` (n, k), next to attitudes R (n, 3, 3).

    If no name has the unit, order or sequence, the one that fits best is used.
    """
    out, place = list[Other](), 0
    for kind, names in layout.also.items():
        x, place = values[:, place : place + len(names)], place + len(names)
        if R is None:
            continue
        have = np.isfinite(x).all(axis=1)
        some = np.flatnonzero(have)[:: max(1, int(have.sum()) // TRIED)]
        nearest = (math.inf, 1.0, x[have])
        for reading in _readings(kind, options) if len(some) else ():
            off = _largest(R[some], reading(x[some]))
            if off < nearest[0]:
                nearest = off, reading.unit, reading(x[have])
        off, unit, matrices = nearest
        digits = TURNS.get(kind, 1.0) * unit * find_quantum(x[have]) if math.isfinite(off) else 0.0
        out.append(Other(names, _largest(R[have], matrices) if math.isfinite(off) else off, digits))
    return out


@dataclass(frozen=True)
class _Reading:
    """A reading of columns as attitudes of a kind: their order and unit, and for angles their sequence."""

    kind: str
    options: Options
    order: Sequence[int]
    unit: float = 1.0

    def __call__(self, x: Array) -> Array:
        """Return matrices (n, 3, 3)."""
        turned = x[:, self.order] * self.unit
        if self.kind == "axis and angle":
            turned = np.column_stack([x[:, :3], turned[:, 3]])
        return to_matrices(turned, self.kind, self.options)[0]  # type: ignore[return-value]


def _readings(kind: str, options: Options) -> Iterator[_Reading]:
    """Yield the readings of attitudes of a kind."""
    usual = range(ATTITUDES[kind])
    units = (1.0, math.pi / 180) if kind in ("angles", "aircraft angles", "rotation vector", "axis and angle") else (1.0,)
    for unit in units:
        if kind == "quaternion":
            yield from (_Reading(kind, replace(options, quaternion=order), usual) for order in ("wxyz", "xyzw"))
        elif "angles" in kind:
            for sequence in SEQUENCES:
                for order in permutations(usual):
                    yield _Reading("angles", replace(options, euler=sequence), order, unit)
        else:
            yield _Reading(kind, options, usual, unit)


def _largest(R: Array, other: Array) -> float:
    return float(np.max(angle_between(R, other)))
