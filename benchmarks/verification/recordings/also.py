"""Quantities that a file has twice, such as quaternions and angles: whether both are the same."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import permutations
from typing import Any

import numpy as np

from conservative.attitude import Array, angle_between

from ..compare import FLOOR, UNITS_OF_DIGITS
from ..solution import States
from .attitudes import to_matrices
from .digits import TURNS, find_quantum
from .layout import ATTITUDES, Layout, Options
from .names import UNITS, parse

TRIED = 200
"""Number of rows on which readings are tried."""
SEQUENCES = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz")


@dataclass(frozen=True)
class Other:
    """A second set of columns of a quantity: their names, and their largest difference from the compared ones.

    It is an angle, rad, or relative to the largest rate. `allowed` is the difference that the rounding of both allows.
    """

    names: Sequence[str]
    difference: float
    allowed: float
    unit: str = "rad"

    @property
    def text(self) -> str:
        """Text on the difference, for a sentence."""
        if not math.isfinite(self.difference):
            return "no motion"
        return f"another motion (by {self.difference:.2g} {self.unit})"


def compare_others(
    data: States, digits: tuple[float, float, float], values: Array, layout: Layout, options: Options
) -> list[Other]:
    """Return the other sets of columns of a file, which are in `values` (n, k), next to attitudes and rates of its rows.

    If no name has the unit, order, sequence or frame, the one that fits best is used.
    """
    out, place = list[Other](), 0
    for kind, names in layout.also:
        x, place = values[:, place : place + len(names)], place + len(names)
        have: Any = np.isfinite(x).all(axis=1)
        if kind == "rates":
            out.append(_compare_rates(data, digits[2], x, have, names))
        elif data[0] is not None:
            out.append(_compare_attitudes(data[0], digits[1], x, have, kind, names, options))
    return out


def _compare_rates(data: States, digits: float, x: Array, have: Any, names: Sequence[str]) -> Other:
    """Compare rates, in body or world axes, with the compared ones."""
    R, w = data
    assert w is not None
    scale = float(np.abs(w).max()) or 1.0
    unit = parse(names[0]).unit
    sizes = (1.0, math.pi / 180) if unit is None else (UNITS.get(unit, 1.0),)
    frames = [w] if R is None else [w, (R @ w[..., None])[..., 0]]
    difference, size = min(
        (float(np.abs(x[have] * size - frame[have]).max(initial=0.0)), size) for size in sizes for frame in frames
    )
    rounding = FLOOR + UNITS_OF_DIGITS * (size * find_quantum(x[have]) + digits) / scale if have.any() else 0.0
    return Other(names, difference / scale if have.any() else math.inf, rounding, "of the largest rate")


def _compare_attitudes(
    R: Array, rounding: float, x: Array, have: Any, kind: str, names: Sequence[str], options: Options
) -> Other:
    """Compare attitudes with the compared ones."""
    some = np.flatnonzero(have)[:: max(1, int(have.sum()) // TRIED)]
    nearest = (math.inf, 1.0, x[have])
    for reading in _readings(kind, options) if len(some) else ():
        off = _largest(R[some], reading(x[some]))
        if off < nearest[0]:
            nearest = off, reading.unit, reading(x[have])
    off, unit, matrices = nearest
    digits = TURNS.get(kind, 1.0) * unit * find_quantum(x[have]) if math.isfinite(off) else 0.0
    difference = _largest(R[have], matrices) if math.isfinite(off) else off
    return Other(names, difference, FLOOR + UNITS_OF_DIGITS * (digits + rounding))


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
