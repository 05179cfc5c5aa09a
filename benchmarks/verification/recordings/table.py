"""Recorded motions in files of simulators, loggers and telephones: the rows that are kept, and all rows in chunks."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from conservative.attitude import Array
from conservative.check import SMALLEST
from conservative.errors import BadInput

from ..solution import States
from .also import Other, compare_others
from .attitudes import convert, find_flips
from .columns import choose
from .describe import Description, Survey
from .digits import find_digits
from .formats import open_table
from .formats.table import Table
from .layout import Layout, Options
from .rows import FEW, OTHER_CLOCK, Cleaner
from .units import find_units, guess_time, open_readings

SAMPLE = 400
"""Number of rows that decide between columns, where names leave a choice."""
ROWS = 2000
"""Smallest number of rows that are kept for fits, evenly chosen; up to twice as many."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A recorded motion at times t (n,), s, of the file; it has `rows` rows, of which n are kept for fits.

    `unit_errors` (n,) are measured before attitudes are repaired: norms of quaternions minus 1, or |R'R - 1| of matrices.
    `readings` are recordings of the same rows in all orders of quaternions and units, if no name has them, this one first;
    the motion of the scene decides. `digits` are the largest round-off of times, s, attitudes,
    rad, and rates, rad/s, that the digits in the file stand for. `path` is None for a motion that is not a file. `numbers` (n,)
    are rows in the file, from 1, `flipped` (n,) is True in rows in which the quaternion changes its sign, `left_out` has the
    numbers of rows that were left out by reason, and `empty_at_end` is the number of rows without numbers at the end. `clock`
    is the number of the clock, if it was set back. `others` are attitudes in other columns. `surveyed` describes the rows of a
    file.
    """

    t: Array
    data: States
    unit_errors: Array | None = None
    readings: Sequence[Recording] = ()
    degrees: bool = False
    rows: int = 0
    digits: tuple[float, float, float] = (0.0, 0.0, 0.0)
    layout: Layout = field(default_factory=lambda: Layout([]))
    options: Options = field(default_factory=Options)
    path: Path | None = None
    numbers: Any = None
    flipped: Any = None
    left_out: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    empty_at_end: int = 0
    clock: int = 0
    others: Sequence[Other] = ()
    surveyed: Description | None = None

    def label(self, text: str) -> str:
        """Return a description of rows after the name of the file."""
        return text if self.path is None else f"{self.path}: {text}"

    def number(self, row: Any) -> int:
        """Return the number in the file, from 1, of a row that is kept."""
        return int(row) + 1 if self.numbers is None else int(self.numbers[row])

    def describe(self, noise: tuple[float, float]) -> Description:
        """Return the description of the recording; `noise` is the deviation of one axis of attitudes, rad, and rates, rad/s."""
        surveyed = self.surveyed
        if surveyed is None:
            (survey := Survey()).add(self.t, np.empty((len(self.t), 0)))
            surveyed = survey.describe(1.0)
        return replace(surveyed, digits=self.digits, noise=noise, left_out=self.left_out)

    def doubt(self, error: float | None) -> str:
        """Return the sentence on parts of the file that were not compared, or differ from the compared ones; "" without any."""
        if self.empty_at_end:
            return f"The last {self.empty_at_end} rows have no numbers, so the file does not show the end of its motion"
        if (others := self.left_out.get(OTHER_CLOCK, 0)) > FEW * (self.rows + others):
            return f"The clock was set back, and {others:,} rows are not compared. A file for each clock decides"
        for other in self.others:
            if not other.difference <= (other.allowed if error is None else error):
                return f"{', '.join(other.names)} are {other.text}, and not the one that is compared. --columns decides"
        return self.layout.doubt

    def between(self, first: int, last: int) -> Recording | None:
        """Return the rows from one that is kept to another; None for a motion that is not in a file, or has chosen times."""
        if self.path is None or self.options.start_time is not None or self.options.end_time is not None:
            return None
        digits = 1 - math.floor(math.log10(float(np.median(np.diff(self.t)))))  # a tenth of the time between two rows
        start, end = (round(float(self.t[k]), digits) for k in (first, last))
        return read(self.path, replace(self.options, start_time=start, end_time=end))

    def stream(self) -> Iterator[tuple[Array, States, Array | None, Any]]:
        """Yield times, motion, `unit_errors` and numbers of all rows, in chunks."""
        if self.path is None or self.rows == len(self.t):
            numbers = 1 + np.arange(len(self.t)) if self.numbers is None else self.numbers
            yield self.t, self.data, self.unit_errors, numbers
            return
        cleaner = Cleaner(self.path, self.layout, self.options, keep=self.clock)
        for values in open_table(self.path).rows(self.layout.columns):
            chosen, numbers = cleaner.choose(*cleaner.continue_times(values))
            if len(chosen):
                yield *convert(chosen * self.layout.sizes, self.layout, self.options), numbers


def read(path: Path, options: Options) -> Recording:
    """Return the motion in a file: CSV or JSON lines. Every row is checked, in chunks.

    Raises `BadInput` for files, columns, options and rows that cannot be used.
    """
    return read_all([path], options)[0]


def read_all(paths: Sequence[Path], options: Options) -> list[Recording]:
    """Return the motions in files. Raises errors of `read`, and `BadInput` for an option that none of the files uses."""
    made = [_read(path, options) for path in paths]
    for argument, error in made[0][1].items() if made else ():
        if all(argument in unused for _, unused in made):
            raise error
    return [recording for recording, _ in made]


def _read(path: Path, options: Options, clock: int = 0) -> tuple[Recording, dict[str, BadInput]]:
    """Return the motion in a file, and the errors of options that it does not use.

    If the clock was set back, rows of one `clock` are compared: those of the clock with the most rows.
    """
    if options.euler is not None and not re.fullmatch("(?!.*(.)\\1)[xyz]{3}", options.euler):
        raise BadInput("euler", repr(options.euler), "three of the letters x, y, z without equal neighbours, such as zyx")
    start, end = options.start_time, options.end_time
    if start is not None and end is not None and not start < end:
        raise BadInput("until", f"{end:g}, not after {start:g} s", "a time after the first one, s")
    table = open_table(path)
    layout = choose(path, Layout(table.names), options, partial(_sample, table))
    if options.world and layout.used["rates"] and layout.attitude is None:
        raise BadInput(
            "rates", f"'world', for {path.name} without attitudes", "body, or a file with attitudes to convert the rates"
        )
    original, unused = options, _unused(layout, options)
    if "quaternion" in unused:  # named columns have their order
        options = replace(options, quaternion=None)
    cleaner, survey, kept, numbers = Cleaner(path, layout, options, keep=clock), Survey(), list[Array](), list[Array]()
    every, rows, first, last = 1, 0, True, math.nan
    extra = [name for _, part in layout.also for name in part]
    width = cleaner.width  # `extra` follows
    for chunk in table.rows([*layout.columns, *extra]):
        if first and len(chunk):
            guess_time(chunk, layout)
        values, at = cleaner.continue_times(chunk)
        if first and len(values):
            usable = ~np.any([*cleaner.bad(values[:, :width]).values()], axis=0)
            find_units(values[usable, :width], layout, options)
            first = False
        values, at = cleaner.choose(values, at)
        survey.add(values[:, 0], values[:, width - 4 : width] if layout.attitude == "quaternion" else values[:, :0])
        # Every `every`-th row of the file, counted over all chunks.
        kept.append(values[-rows % every :: every])
        numbers.append(at[-rows % every :: every])
        rows += len(values)
        while sum(map(len, kept)) > 2 * ROWS:
            kept, numbers, every = [np.concatenate(kept)[::2]], [np.concatenate(numbers)[::2]], 2 * every
        last = values[-1, 0] if len(values) else last
    cleaner.finish()
    if cleaner.pieces and (longest := max(cleaner.pieces, key=lambda piece: (cleaner.pieces[piece], -piece))) != clock:
        return _read(path, original, longest)
    if rows < 2:
        left = "".join(f", and {count} {reason}" for reason, count in cleaner.left_out.items() if count)
        raise BadInput("run", f"{path} with {rows} rows{left}", "a header and two rows or more")
    raw = np.concatenate(kept)
    if (duration := float(last - raw[0, 0]) * float(layout.sizes[0])) < SMALLEST:
        raise BadInput("run", f"{path} with rows within {duration:g} s", f"times that differ by {SMALLEST:g} s or more")
    layout.notes += cleaner.notes

    def make(layout: Layout, options: Options) -> Recording:
        t, data, unit_errors = convert(raw[:, :width] * layout.sizes, layout, options)
        digits = find_digits(raw[:, :width], layout)
        return Recording(
            t,
            data,
            unit_errors,
            degrees=any(abs(size - math.pi / 180) < 1e-6 for size in layout.used["rates"].values()),
            rows=rows,
            digits=digits,
            layout=layout,
            options=options,
            path=path,
            numbers=np.concatenate(numbers),
            flipped=find_flips(raw[:, :width], layout),
            left_out={reason: count for reason, count in cleaner.left_out.items() if count},
            empty_at_end=cleaner.empty_at_end,
            clock=clock,
            others=compare_others(data, digits, raw[:, width:], layout, options),
            surveyed=survey.describe(float(layout.sizes[0])),
        )

    recordings = [make(*reading) for reading in open_readings(layout, options)]
    recording = recordings[0] if len(recordings) < 2 else replace(recordings[0], readings=recordings)
    return recording, unused


def _sample(table: Table, names: Sequence[str]) -> Array:
    """Return the first rows of columns."""
    return next(table.rows(names), np.empty((0, len(names))))[:SAMPLE]


def _unused(layout: Layout, options: Options) -> dict[str, BadInput]:
    """Return the errors of options that apply to none of the columns, by their arguments."""
    out = dict[str, tuple[str, str]]()
    if options.euler is not None and layout.attitude != "angles":
        out["euler"] = f"{options.euler!r}, for a file without columns of angles that it applies to", "no --euler"
    if options.quaternion is not None and not layout.numbered:
        out["quaternion"] = f"{options.quaternion!r}, for a file without numbered quaternions", "no --quaternion"
    if options.world and not layout.used["rates"]:
        out["rates"] = "'world', for a file without rates", "body, or a file with attitudes and rates"
    # `columns.choose` adds the note "unit" if --units applies to a column.
    if options.units is not None and "unit" not in layout.notes:
        out["units"] = f"{options.units!r}, for a file whose columns name their units", "no --units"
    return {argument: BadInput(argument, got, allowed) for argument, (got, allowed) in out.items()}
