"""Changes of conclusions between two versions, not of digits.

The conclusions are: whether a run reaches its end, an order, whether a quantity is conserved, drifts little or drifts, the sign
of an energy drift, and the error and the time within a factor. A change counts only if it exceeds the spreads of both versions.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from conservative.outcome import Outcome

from ..measures.convergence_order import Order
from ..measures.errors import CONSERVED, SMALL
from .engine import TIME_FACTOR, EngineComparison, Observation, Range, StepTimes, ratio
from .times import Ratio

ORDER_STEP, ORDER_ERRORS = 0.5, 2.0
"""Orders differ if their difference exceeds the first, and this number of their uncertainties."""
FACTOR = 3.0
"""Smallest ratio of errors, or drifts, that differ."""
ROUND_OFF = 1e-9
"""Attitude errors, rad, below this do not differ: they are round-off."""


class Aspect(Enum):
    """The subject of a change."""

    OUTCOME = "outcome"
    ATTITUDE_ORDER = "order of the attitude"
    RATES_ORDER = "order of the rates"
    DRIFT = "drift"
    ERROR = "attitude error"
    TIME = "time of a step"


@dataclass(frozen=True)
class Change:
    """A conclusion that differs between two versions; for times, `now` is the ratio.

    `quantity` is the invariant of a drift. `lost` is true if the later version lost the end of a run, an order or an invariant.
    """

    aspect: Aspect
    was: Outcome | Order | Range
    now: Outcome | Order | Range | Ratio
    quantity: str = ""
    lost: bool = False


def find_changes(was: Observation, now: Observation, was_times: StepTimes, now_times: StepTimes) -> tuple[Change, ...]:
    """Return the changes from one version to another, on one scene and with one setting, most important first.

    `was_times` and `now_times` are the times of a step (n,), s; empty if not known.
    """
    if was.outcome.kind is not now.outcome.kind:
        return (Change(Aspect.OUTCOME, was.outcome, now.outcome, lost=was.outcome.ok),)
    if not was.outcome.ok:
        return ()
    changes = [*_orders(was, now), *_drifts(was, now)]
    if max(was.error.value, now.error.value) > ROUND_OFF and direction(was.error, now.error):
        changes.append(Change(Aspect.ERROR, was.error, now.error))
    if (times := ratio(was_times, now_times)).beyond(TIME_FACTOR):
        changes.append(Change(Aspect.TIME, Range.of(was_times), times))
    return tuple(changes)


def _orders(was: Observation, now: Observation) -> Iterator[Change]:
    pairs = (
        (Aspect.ATTITUDE_ORDER, was.attitude_order, now.attitude_order),
        (Aspect.RATES_ORDER, was.rates_order, now.rates_order),
    )
    grown = direction(was.error, now.error)
    for aspect, before, after in pairs:
        if math.isnan(before.slope) or math.isnan(after.slope):
            # Round-off can decide if an order can be fitted. Such a change counts only if the error changed too.
            if math.isnan(before.slope) != math.isnan(after.slope) and grown:
                yield Change(aspect, before, after, lost=math.isnan(after.slope) and grown > 0)
        elif abs(after.slope - before.slope) > max(ORDER_STEP, ORDER_ERRORS * math.hypot(before.stderr, after.stderr)):
            yield Change(aspect, before, after, lost=after.slope < before.slope)


def _drifts(was: Observation, now: Observation) -> Iterator[Change]:
    for quantity in was.drifts:
        before, after = was.drifts[quantity], now.drifts[quantity]
        if math.isnan(before.value) or math.isnan(after.value):
            continue
        limits = CONSERVED, SMALL  # up to which a quantity is conserved (grade 0) or drifts little (1)
        grade, other = (bisect_left(limits, abs(drift.value)) for drift in (before, after))
        if grade == other == len(limits):
            if before.high < 0 < after.low or after.high < 0 < before.low:
                yield Change(Aspect.DRIFT, before, after, quantity)
        elif grade != other and direction(before, after):
            yield Change(Aspect.DRIFT, before, after, quantity, lost=other > grade)


def direction(was: Range, now: Range) -> int:
    """Return 1 if all sizes grew by more than `FACTOR`, -1 if they shrank by as much, else 0."""
    before, after = was.sizes, now.sizes
    return int(after[0] > FACTOR * before[1]) - int(before[0] > FACTOR * after[1])


@dataclass(frozen=True)
class Transition:
    """The changes from one version to the next, with one setting on one scene; may be empty."""

    was: Observation
    now: Observation
    changes: tuple[Change, ...]

    @property
    def lost(self) -> tuple[Change, ...]:
        """The changes by which the later version lost something."""
        return tuple(change for change in self.changes if change.lost)


def list_transitions(comparison: EngineComparison) -> tuple[Transition, ...]:
    """Return the changes from each version to the next, version by version."""
    transitions = []
    for line, was, now in comparison.steps:
        if was and now and line.times is not None:
            times = line.times.get(was.version, ()), line.times.get(now.version, ())
            transitions.append(Transition(was, now, find_changes(was, now, *times)))
    return tuple(transitions)
