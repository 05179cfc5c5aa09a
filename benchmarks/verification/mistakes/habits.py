"""Habits: engines change the state after each step (damping, limits, sleep), and recorders change rows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from conservative.attitude import Array, from_quaternion, to_quaternion

from ..solution import States
from .mistake import Mistake, Number


@dataclass(frozen=True)
class Habit(Mistake):
    """A change of the state after each step.

    Attributes
    ----------
    after
        From rates (..., 3) after a step, rad/s, body axes, and numbers to the rates that are kept.
    guess
        From rates (n, 3) of a recording and rates before the change to the numbers, () if no row shows it. The rates before
        come from exact motions that start in the row before, or from the whole exact motion.
    """

    kind: ClassVar[str] = "habits"
    after: Callable[..., Array]
    guess: Callable[[Array, Array], tuple[float, ...]]


@dataclass(frozen=True)
class Standstill(Mistake):
    """The body stands still from a time on, which is found in each recording.

    `rest` is the factor of the rates from then on. `from_start` is True if the body never moves. `of` says which rows stand
    still: all, or only attitudes (0) or rates (1), while the others go on.
    """

    kind: ClassVar[str] = "habits"
    rest: float
    from_start: bool = False
    of: int | None = None


@dataclass(frozen=True)
class RowHabit(Mistake):
    """A change of some rows by a recorder.

    Attributes
    ----------
    change
        From right samples, the data, the rows that are off, and numbers to the rows that are written.
    periodic
        True if every n-th row is off; False if the rows are off in which the quaternion, with a scalar that is not negative,
        changes its sign.
    any
        True if the rows that are off may have any values.
    """

    kind: ClassVar[str] = "rows"
    change: Callable[[States, States, Array], States]
    periodic: bool = True
    any: bool = False


@dataclass(frozen=True)
class OtherRows(Mistake):
    """Rows that do not fit the others. They have no effect on another recording."""

    kind: ClassVar[str] = "rows"


LARGER = 1.01
"""Factor by which a limit that one row shows cuts the rates: by more than the error of a step."""


def limit(w: Array, most: float) -> Array:
    """Return rates whose norm is limited."""
    speed = np.linalg.norm(w, axis=-1, keepdims=True)
    return w * np.minimum(1.0, most / np.maximum(speed, 1e-300))


def _guess_limit(sizes: Array, before: Array) -> tuple[float, ...]:
    """Return the largest size, if larger ones were cut to it in two or more rows, or much larger ones in the first row.

    Few digits in a file do not hide the limit: sizes that equal the largest to a part in 1,000 at most count. After a start
    above the limit, the sizes of a free body can fall, so that no other row shows it.
    """
    larger = before > sizes * (1 + 1e-9)  # by more than round-off
    for share in (1e-7, 1e-6, 1e-5, 1e-4, 1e-3):
        cut = larger & (np.abs(sizes - sizes.max()) <= share * sizes.max())
        if cut.sum() >= 2 or (cut[0] and before[0] > LARGER * sizes[0]):
            return (float(np.median(sizes[cut])),)
    return ()


def _guess_band(w: Array, before: Array) -> tuple[float, ...]:
    """Return the roundest number between the largest component that was set to 0 and the smallest that was kept."""
    gone = (w == 0) & (before != 0)
    if not gone.any():
        return ()
    low = float(np.abs(before[gone]).max())
    kept = np.abs(w[w != 0])
    high = float(kept[kept > low].min()) if (kept > low).any() else 2 * low
    return (roundest(low, high),)


def roundest(low: float, high: float) -> float:
    """Return the smallest number above `low` and up to `high` with the fewest digits."""
    for digits in range(16):
        size = 10.0 ** (np.floor(np.log10(low)) - digits)
        number = float((np.floor(low / size * (1 + 1e-12)) + 1) * size)
        if number <= high * (1 + 1e-12):
            return float(f"{number:.15g}")
    return high


def _held(right: States, data: States, off: Array) -> States:
    return _change_off_rows(right, off, lambda x: x[np.maximum.accumulate(np.where(off, 0, np.arange(len(off))))])


def _change_off_rows(right: States, off: Array, change: Callable[[Array], Array]) -> States:
    """Return right samples, with the rows that are off changed."""
    R, w = (None if x is None else np.where(off.reshape(-1, *(1,) * (x.ndim - 1)), change(x), x) for x in right)
    return R, w


def _rolled(by: int) -> Callable[[States, States, Array], States]:
    def change(right: States, data: States, off: Array) -> States:
        R, w = right
        return (None if R is None else _change_off_rows((R, None), off, _roll)[0]), w

    def _roll(R: Array) -> Array:
        return from_quaternion(np.roll(to_quaternion(R), by, axis=-1))

    return change


def _conjugated(right: States, data: States, off: Array) -> States:
    R, w = right
    return _change_off_rows((R, None), off, lambda x: np.swapaxes(x, -1, -2))[0], w


def _one_component(right: States, data: States, off: Array) -> States:
    """Return right samples, with the file's first component in all three components of the rates that are off."""
    R, w = right[0], data[1]
    return R, None if w is None else _change_off_rows((None, right[1]), off, lambda _: np.repeat(w[:, :1], 3, axis=1))[1]


def _unknown(right: States, data: States, off: Array) -> States:
    """Return the data in rows that are off."""
    R, w = (
        None if x is None or y is None else np.where(off.reshape(-1, *(1,) * (x.ndim - 1)), y, x)
        for x, y in zip(right, data, strict=True)
    )
    return R, w


HABITS = (
    Habit(
        "rate limit",
        "The rate is limited to {limit:.4g} rad/s",
        limit,
        lambda w, before: _guess_limit(np.linalg.norm(w, axis=-1), np.linalg.norm(before, axis=-1)),
        numbers=(Number("limit", unit="rad/s"),),
        remedy="raise the largest rate of the engine",
    ),
    Habit(
        "rate limit per component",
        "Each component of the rates is limited to {limit:.4g} rad/s",
        lambda w, most: np.clip(w, -most, most),
        lambda w, before: _guess_limit(np.abs(w).max(axis=-1), np.abs(before).max(axis=-1)),
        numbers=(Number("limit", unit="rad/s"),),
        remedy="raise the largest rate of the engine",
    ),
    Habit(
        "dead band",
        "Components of the rates below {band:.4g} rad/s are set to 0",
        lambda w, band: np.where(np.abs(w) < band, 0.0, w),
        _guess_band,
        numbers=(Number("band", unit="rad/s"),),
    ),
)
STANDSTILLS = (
    Standstill(
        "sleep",
        "The body is put to sleep: it stands still from {time:.6g} s on",
        0.0,
        numbers=(Number("time", unit="s"),),
        remedy="turn off sleeping",
    ),
    Standstill(
        "halt",
        "The motion halts: attitude and rates are constant from {time:.6g} s on",
        1.0,
        numbers=(Number("time", unit="s"),),
    ),
    Standstill("frozen motion", "The motion is frozen: attitude and rates stay as at the start", 1.0, True),
)
PART_STANDSTILLS = tuple(
    Standstill(
        key, f"{what} from {{time:.6g}} s on, while the {others} go on", rest, of=of, numbers=(Number("time", unit="s"),)
    )
    for key, what, others, rest, of in (
        ("frozen attitudes", "The attitudes stand still", "rates", 1.0, 0),
        ("frozen rates", "The rates stay the same", "attitudes", 1.0, 1),
        ("rates of 0", "The rates are 0", "attitudes", 0.0, 1),
    )
)
HELD = RowHabit("held rows", "One in {period:.0f} rows repeats the one before, from row {first:.0f} on", _held)
ROWS = (
    HELD,
    RowHabit(
        "order xyzw in some rows",
        "One in {period:.0f} rows has the quaternion in the order xyzw, from row {first:.0f} on, the others wxyz",
        _rolled(-1),
    ),
    RowHabit(
        "order wxyz in some rows",
        "One in {period:.0f} rows has the quaternion in the order wxyz, from row {first:.0f} on, the others xyzw",
        _rolled(1),
    ),
    RowHabit(
        "transposed in some rows",
        "One in {period:.0f} rows has a transposed attitude, from row {first:.0f} on",
        _conjugated,
    ),
    RowHabit(
        "one component in some rows",
        "One in {period:.0f} rows has one number in all components of the rates, from row {first:.0f} on",
        _one_component,
    ),
    RowHabit("some rows", "One in {period:.0f} rows is off, from row {first:.0f} on; the others agree", _unknown, any=True),
    RowHabit(
        "rates at sign changes",
        "The rates are spoiled in {rows:.0f} rows in which the quaternion changes its sign, the first of them row {first:.0f}",
        _unknown,
        periodic=False,
        remedy="choose the sign of the quaternion before its difference is taken",
    ),
)  # fmt: skip
OTHER_ROWS = (
    OtherRows("single rows", "Single rows are off, the first of them row {row:,.0f} at {time:g} s; the others agree"),
    OtherRows(
        "first row", "The first row does not fit the others: the motion starts at another attitude or other rates"
    ),
)  # fmt: skip
