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

OUTSIDE, GAP, REPEATED = "outside of the chosen times", "without numbers", "equal to the row before, with its time"
"""Reasons to leave a row out."""
_WRAPS = tuple(
    sorted(size * unit for size, unit in product((2.0**16, 2.0**24, 2.0**31, 2.0**32), (1.0, 1e-3, 1e-6, 1e-9)))
) + tuple(size * unit for size, unit in product((86_400.0, 604_800.0), (1.0, 1e3, 1e6, 1e9)))
"""Lengths after which counters, and times of a day or a week, begin again."""
SHORT = 3.0
"""Largest time between the rows before and after a counter begins again, in typical gaps."""


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
    last: Array = field(default_factory=lambda: np.empty(0))  # the last row that is kept

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
            length = next((size for size in _WRAPS if 0 < steps[at] + size <= SHORT * self.gap), 0.0)
            moved[at:] += length
            self.wraps += length > 0
        values[:, 0] = t + moved
        if len(t):
            self.offset, self.before = float(moved[-1]), float(values[-1, 0])
        return values, numbers

    def choose(self, values: Array, numbers: Any) -> tuple[Array, Any]:
        """Return the rows that are compared, of those that `continue_times` returned, and their numbers.

        Raises `BadInput` for a row that is no gap and has no motion.
        """
        layout, width = self.layout, 1 + sum(map(len, [*self.layout.used.values()][1:]))
        t = values[:, 0] * layout.sizes[0]
        inside = np.ones(len(t), bool)
        if self.options.start_time is not None:
            inside &= t >= self.options.start_time
        if self.options.end_time is not None:
            inside &= t <= self.options.end_time
        self.left_out[OUTSIDE] += int((~inside).sum())
        values, numbers = values[inside], numbers[inside]
        gaps: Any = np.isnan(values[:, :width]).any(axis=1)
        self.left_out[GAP] += int(gaps.sum())
        if len(gaps):
            trailing = int(np.argmin(gaps[::-1])) if not gaps.all() else len(gaps)
            self.empty_at_end = trailing + (self.empty_at_end if gaps.all() else 0)
        values, numbers = values[~gaps], numbers[~gaps]
        if len(values):
            rows = np.vstack([self.last, values[:, :width]]) if self.last.size else values[:, :width]
            same = (rows[1:] == rows[:-1]).all(axis=1)
            same = same if self.last.size else np.append(False, same)
            self.left_out[REPEATED] += int(same.sum())
            values, numbers = values[~same], numbers[~same]
        self._refuse(values[:, :width], numbers)
        self.last = values[-1, :width] if len(values) else self.last
        return values, numbers

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
        """Raise `BadInput` for a row without a motion, or a time that is not later than the one before."""
        layout, allowed = self.layout, "a file in which that row is repaired or removed"
        names = np.array([", ".join(layout.used["time"]), *layout.columns[len(layout.used["time"]) :]])
        for what, rows in self.bad(values).items():
            if rows.any():
                at = int(np.argmax(rows))
                column = names[~(np.abs(values[at]) <= LARGEST)].tolist()
                where = f", column {column[0]}" if column else ""
                raise BadInput("run", f"{self.path}, row {numbers[at]}{where}: {what}", allowed)
        before = self.last[0] if self.last.size else -math.inf
        if (late := np.diff(values[:, 0], prepend=before) <= 0).any():
            got = f"{self.path}, row {numbers[int(np.argmax(late))]}: a time that is not later than the time of the row before"
            raise BadInput("run", f"{got}, in column {names[0]}", f"{allowed}, or --columns with another time")

    @property
    def notes(self) -> list[str]:
        """Sentences on rows that were left out."""
        out = [f"Left out: {count:,} row{'s' * (count > 1)} {reason}." for reason, count in self.left_out.items() if count]
        if self.wraps:
            out.append(f"The counter of the time began again {self.wraps} time{'s' * (self.wraps > 1)}; the times go on there.")
        return out
