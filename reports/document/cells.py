"""Numbers, outcomes and grades as text and as cells of tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

from conservative.benchmarks.measures.errors import CONSERVED, SMALL
from conservative.outcome import Outcome, OutcomeKind

from ..numbers import DASH as DASH
from ..numbers import angle as angle
from ..numbers import bound as bound
from ..numbers import number as number
from ..numbers import short_power
from .model import Cell, Grade

SPREAD = 0.05
"""Relative uncertainty of a ratio of times from one process."""
_ABSENT = (OutcomeKind.UNSUPPORTED, OutcomeKind.MISSING, OutcomeKind.SKIPPED)
_DURING_A_RUN = (OutcomeKind.NOT_CONVERGED, OutcomeKind.WRONG_BRANCH, OutcomeKind.DIVERGED, OutcomeKind.NOT_CONSERVED)


def listed(names: Sequence[str]) -> str:
    """Return names, at least one, as words: `a, b and c`."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def tolerance(value: float) -> str:
    """Return a power of ten, such as `1e-3`."""
    return short_power(f"{value:.0e}")


def factor(ratio: float, digits: int = 2) -> str:
    """Return a ratio with all its digits, such as `2.0`, `220` and `1,200`; a dash for NaN."""
    if math.isnan(ratio):
        return DASH
    rounded = float(f"{ratio:.{digits}g}")
    decimals = digits - 1 - math.floor(math.log10(rounded)) if rounded > 0 else 0
    return f"{rounded:,.{max(decimals, 0)}f}"


def numeric(value: float, text: str = "", digits: int = 2) -> Cell:
    """Return a number as a cell that the page sorts by its value; `number` makes the default text."""
    return Cell(text or number(value, digits), value=value)


def size(value: float) -> Cell:
    """Return an error or a drift, rounded up, as a cell that the page sorts by its value."""
    return numeric(value, bound(value))


def grade(value: float, text: str = "", limits: tuple[float, float] = (CONSERVED, SMALL)) -> Cell:
    """Return a size with the symbol of its grade, a dash for NaN; the default text is the size, rounded up (see `bound`).

    `limits` are the largest sizes that are good, and fair. By default they are the limits of drifts.
    """
    if math.isnan(value):
        return Cell(DASH, Grade.NONE, value=value)
    graded = Grade.GOOD if value <= limits[0] else Grade.FAIR if value <= limits[1] else Grade.BAD
    return Cell(graded.mark(text or bound(value)), graded, value=value)


def grade_ratio(ratio: float, note: str = "", digits: int = 3, interval: tuple[float, float] = (math.nan, math.nan)) -> Cell:
    """Return an engine's time divided by ours with its interval: good from 1 on, fair if 1 is within the interval.

    A ratio of times from one process has no interval; `SPREAD` takes its place.
    """
    if math.isnan(ratio):
        return Cell(DASH, Grade.NONE, note, value=ratio)
    low, high = ((1 - SPREAD) * ratio, (1 + SPREAD) * ratio) if math.isnan(interval[0]) else interval
    graded = Grade.GOOD if low >= 1 else Grade.BAD if high < 1 else Grade.FAIR
    return Cell(graded.mark(ratio_text(ratio, interval, digits)), graded, note, value=ratio)


def ratio_text(ratio: float, interval: tuple[float, float], digits: int = 3) -> str:
    """Return a ratio with its interval if it has one, such as `2.92 (2.84 to 3.01)`."""
    ends = "" if math.isnan(interval[0]) else f" ({factor(interval[0], digits)} to {factor(interval[1], digits)})"
    return factor(ratio, digits) + ends


def outcome_text(outcome: Outcome) -> str:
    """Return an outcome as a table shows it: with time and reason if it happened during a run, otherwise the kind alone."""
    return str(outcome) if outcome.kind in _DURING_A_RUN else outcome.kind.value


def outcome_cell(outcome: Outcome, reason: bool = False) -> Cell:
    """Return an outcome with a symbol, and with its reason if `reason`."""
    if outcome.ok:
        return Cell(Grade.GOOD.mark("done"), Grade.GOOD)
    graded, text = Grade.NONE if outcome.kind in _ABSENT else Grade.BAD, outcome_text(outcome)
    if reason and outcome.reason not in text:
        text += f": {outcome.reason}"
    return Cell(graded.mark(text), graded)
