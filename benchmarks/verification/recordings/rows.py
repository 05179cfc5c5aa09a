"""Rows of a file that are compared: without gaps, repeated rows and rows outside of the window, and with times that go on."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from conservative.attitude import Array
from conservative.check import LARGEST
from conservative.errors import BadInput

from .layout import Layout, Options

OUTSIDE, GAP, REPEATED = "outside of the chosen times", "without numbers", "equal to another row, with its time"
ZERO, SENTINEL = "with a quaternion or a matrix of zeros", "with a number that stands for none, such as -9999"
LATE, CONFLICT = "earlier than a row before", "with the time of another row, and other values"
AHEAD, OTHER_CLOCK = "later than the rows after", "after or before the clock was set back"
"""Reasons to leave a row out."""
DISORDERED = LATE, CONFLICT, AHEAD
"""Reasons of rows out of order."""
_NINES = (sign * float("9" * n) for n in range(3, 8) for sign in (1, -1))
SENTINELS = (*_NINES, -(2.0**15), 2.0**15 - 1, -(2.0**31), 2.0**31 - 1)
"""Numbers that loggers write in all columns of a sensor without a value."""
FEW = 0.02
"""Largest share of rows out of order that are left out; with more of them, the file is refused. One row may always be."""
RESTARTED = 3
"""Number of rows whose times increase, from which on they are times of a clock that was set back, and not rows out of order."""
HISTORY = 50_000
"""Number of rows before, among which equal rows are searched."""
_WRAPS = tuple(
    sorted(size * unit for size, unit in product((2.0**16, 2.0**24, 2.0**31, 2.0**32), (1.0, 1e-3, 1e-6, 1e-9)))
) + tuple(size * unit for size, unit in product((86_400.0, 604_800.0), (1.0, 1e3, 1e6, 1e9)))
"""Lengths after which counters, and times of a day or a week, begin again."""
SHORT = 3.0
"""Largest time between the rows before and after a counter begins again, in typical gaps."""

LONG = 20.0
"""Smallest length of a counter, in typical gaps. Rows out of order step back by less."""


@dataclass
class Cleaner:
    """Leaves rows out, chunk by chunk, counts them, and refuses rows that cannot be used.

    `wraps` is the number of steps back of a counter, `empty_at_end` the number of rows without numbers at the end.
    """

    path: Path
    layout: Layout
    options: Options
    left_out: Counter[str] = field(default_factory=Counter)
    wraps: int = 0
    empty_at_end: int = 0
    rows: int = 0
    offset: float = 0.0
    gap: float = math.nan
    before: float = -math.inf  # the last time of the file, with its wraps
    keep: int = 0  # the number of the clock whose rows are compared
    piece: int = 0
    pieces: Counter[int] = field(default_factory=Counter)  # numbers of rows by the clock
    last: float = -math.inf  # the last time that is kept
    history: Array = field(default_factory=lambda: np.empty(0))
    disordered: str = ""  # the first row out of order

    @property
    def width(self) -> int:
        """Number of columns of the time, as one number, the rates and the attitude."""
        return 1 + sum(map(len, [*self.layout.used.values()][1:]))

    def continue_times(self, values: Array) -> tuple[Array, Any]:
        """Return rows whose times go on where a counter began again, with the time as one number, and their numbers."""
        numbers: Any = self.rows + 1 + np.arange(len(values))
        self.rows += len(values)
        values = self.layout.join_time(values)
        timed = ~np.isnan(values[:, 0])
        self.left_out[GAP] += int((~timed).sum())
        values, numbers = values[timed].copy(), numbers[timed]
        t = values[:, 0]
        steps = np.diff(t, prepend=self.before - self.offset)
        if math.isnan(self.gap) and (steps[1:] > 0).any():
            self.gap = float(np.median(steps[1:][steps[1:] > 0]))
        moved = np.full(len(t), self.offset)
        for at in np.flatnonzero(steps < 0).tolist():
            ended = t[at] - steps[at]  # the last value of the counter
            length = next(
                (size for size in _WRAPS if ended < size > LONG * self.gap and 0 < steps[at] + size <= SHORT * self.gap), 0.0
            )
            moved[at:] += length
            self.wraps += length > 0
        values[:, 0] = t + moved
        if len(t):
            self.offset, self.before = float(moved[-1]), float(values[-1, 0])
        return values, numbers

    def choose(self, values: Array, numbers: Any) -> tuple[Array, Any]:
        """Return the rows that are compared, of those that `continue_times` returned, and their numbers.

        Raises `BadInput` for a row that has numbers and no motion.
        """
        layout, width = self.layout, self.width
        t = values[:, 0] * layout.sizes[0]
        inside = np.ones(len(t), bool)
        if self.options.start_time is not None:
            inside &= t >= self.options.start_time
        if self.options.end_time is not None:
            inside &= t <= self.options.end_time
        self.left_out[OUTSIDE] += int((~inside).sum())
        values, numbers = values[inside], numbers[inside]
        empty = self._empty(values[:, :width])
        if len(empty):
            trailing = int(np.argmin(empty[::-1])) if not empty.all() else len(empty)
            self.empty_at_end = trailing + (self.empty_at_end if empty.all() else 0)
        values, numbers = values[~empty], numbers[~empty]
        pieces = np.full(len(values), self.piece)
        if len(values) and (np.diff(values[:, 0], prepend=self.last) <= 0).any():
            kept, pieces = self._order(values[:, :width], numbers)
            values, numbers, pieces = values[kept], numbers[kept], pieces[kept]
        self._refuse(values[:, :width], numbers)
        if len(values):
            self.last = float(values[-1, 0])
            self.history = np.vstack([self.history.reshape(-1, width), values[:, :width]])[-HISTORY:]
        self.pieces.update(Counter(pieces.tolist()) if pieces.any() else {0: len(values)})
        own = pieces == self.keep
        self.left_out[OTHER_CLOCK] += int((~own).sum())
        return values[own], numbers[own]

    def _empty(self, values: Array) -> Any:
        """Return which rows have no motion, and count them."""
        rates, attitudes = values[:, 1 : 1 + len(self.layout.used["rates"])], values[:, 1 + len(self.layout.used["rates"]) :]
        gaps = ~np.isfinite(values).all(axis=1)
        parts = [part for part in (rates, attitudes) if part.shape[1]]
        sentinel = np.any([np.isin(part[:, 0], SENTINELS) & (part == part[:, :1]).all(axis=1) for part in parts], axis=0)
        zero = (attitudes == 0).all(axis=1) if self.layout.attitude in ("quaternion", "matrix") else np.zeros(len(values), bool)
        for reason, rows in ((GAP, gaps), (SENTINEL, sentinel & ~gaps), (ZERO, zero & ~sentinel & ~gaps)):
            self.left_out[reason] += int(rows.sum())
        return gaps | sentinel | zero

    def _order(self, values: Array, numbers: Any) -> tuple[Any, Any]:
        """Return which rows (n,) go on in time, and the numbers of their clocks (n,). Other rows are counted."""
        known = np.vstack([self.history.reshape(-1, self.width), values])
        t, begin, kept = values[:, 0], len(known) - len(values), np.ones(len(values), bool)
        pieces, first = np.full(len(values), self.piece), dict[float, int]()
        for i, time in enumerate(known[:, 0].tolist()):
            first.setdefault(time, i)
        back = (np.flatnonzero(np.diff(t) <= 0) + 1).tolist()[::-1]  # rows before which the time steps back, last first
        before, start, k = self.last, 0, 0
        while k < len(t):
            while back and back[-1] <= k:
                back.pop()
            if t[k] > before:
                # All rows up to the one before the next step back go on.
                k, before = (back[-1] - 1, float(t[back[-1] - 2])) if back and back[-1] - 1 > k else (k, before)
                if not back:
                    break
                # A time ahead of both rows that follow is wrong, if these go on from the row before.
                ahead = k + 2 < len(t) and t[k] > t[k + 2] > t[k + 1] > before
                if ahead:
                    self._leave_out(AHEAD, kept, numbers, k)
                else:
                    before = float(t[k])
                k += 1
                continue
            i, following = first[float(t[k])], t[k : k + RESTARTED]
            if start <= i < begin + k:
                self._leave_out(REPEATED if (known[i] == values[k]).all() else CONFLICT, kept, numbers, k)
            elif len(following) == RESTARTED and (np.diff(following) > 0).all() and following[-1] < before:
                self.piece, before, start = self.piece + 1, float(t[k]), begin + k
                pieces[k:] = self.piece
            else:
                self._leave_out(LATE, kept, numbers, k)
            k += 1
        return kept, pieces

    def _leave_out(self, reason: str, kept: Any, numbers: Any, k: int) -> None:
        kept[k] = False
        self.left_out[reason] += 1
        if reason in DISORDERED and not self.disordered:
            self.disordered = f"row {numbers[k]}: a row {reason}"

    def finish(self) -> None:
        """Raise `BadInput` if more than a few rows are out of order."""
        count = sum(self.left_out[reason] for reason in DISORDERED)
        if count > max(1, FEW * self.rows):
            got = f"{self.path} with {count:,} of {self.rows:,} rows out of order, the first of them {self.disordered}"
            name = ", ".join(self.layout.used["time"])
            allowed = f"times that go on in column {name}: a file that is sorted, or --columns with another time"
            raise BadInput("run", got, allowed)

    def bad(self, values: Array) -> dict[str, Array]:
        """Return masks (n,) of the rows (n, width) without a motion, by the reason."""
        rest, kind = values[:, 1 + len(self.layout.used["rates"]) :], self.layout.attitude
        none = np.zeros(len(values), bool)
        with np.errstate(all="ignore"):
            # 1e-3: rounding does not change a norm or a determinant of 1 so much.
            bad: dict[str, Any] = {
                "a value that is not a finite number": ~np.isfinite(values).all(axis=1),
                f"a value beyond {LARGEST:g}": (np.abs(values) > LARGEST).any(axis=1),
                "a quaternion of norm 0": np.linalg.norm(rest, axis=1) < 1e-3 if kind == "quaternion" else none,
                "a matrix that is not a rotation": (np.linalg.det(rest.reshape(-1, 3, 3)) < 1e-3 if kind == "matrix" else none),
            }
        return bad

    def _refuse(self, values: Array, numbers: Any) -> None:
        """Raise `BadInput` for a row without a motion."""
        layout, allowed = self.layout, "a file in which that row is repaired or removed"
        names = np.array([", ".join(layout.used["time"]), *layout.columns[len(layout.used["time"]) :]])
        for what, rows in self.bad(values).items():
            if rows.any():
                at = int(np.argmax(rows))
                column = names[~(np.abs(values[at]) <= LARGEST)].tolist()
                where = f", column {column[0]}" if column else ""
                raise BadInput("run", f"{self.path}, row {numbers[at]}{where}: {what}", allowed)

    @property
    def notes(self) -> list[str]:
        """Sentences on times that were changed."""
        times = "once" if self.wraps == 1 else f"{self.wraps} times"
        return [f"The counter of the time began again {times}; the times go on there."] * bool(self.wraps)
