"""From two versions to what changed between them: changes of conclusions, not of digits.

A conclusion is that a run reaches its end, an order, that something is conserved, drifts little or drifts, that energy is
gained or lost, and how large the error and the time are within a factor. Two versions differ in one only where all that was
measured beside them, which should not matter, differs alike. Source: our own.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from conservative.outcome import Outcome

from ..measures.drift_class import DriftClass, classify
from .observation import Fit, Observation, Spread
from .step_times import StepTimes, differ, ratio

ORDER_STEP, ORDER_ERRORS = 0.5, 3.0
"""Two orders differ from this difference on, if that is also so many of their standard errors."""
FACTOR = 3.0
"""Errors and drifts differ from this factor on."""
ROUND_OFF = 1e-9
"""Attitude error, rad, below which no two differ: there an error is round-off."""


class Aspect(Enum):
    """What a change is of."""

    OUTCOME = "outcome"
    ATTITUDE_ORDER = "order of the attitude"
    RATES_ORDER = "order of the rates"
    DRIFT = "drift"
    ERROR = "attitude error"
    TIME = "time of a step"


@dataclass(frozen=True)
class Change:
    """A conclusion that is another one in the later of two versions.

    Attributes
    ----------
    aspect
        What it is about.
    was, now
        What was measured; of a time, `now` is how many times as long it is.
    quantity
        Name of the invariant that a drift is of; else empty.
    lost
        Whether something is gone that was there: a run that reached its end, an order, an invariant.
    """

    aspect: Aspect
    was: Outcome | Fit | Spread
    now: Outcome | Fit | Spread
    quantity: str = ""
    lost: bool = False


def find_changes(was: Observation, now: Observation, was_times: StepTimes, now_times: StepTimes) -> tuple[Change, ...]:
    """Return what changed from one version to another, on one scene and with one setting, most important first.

    Parameters
    ----------
    was, now
        What was seen of both.
    was_times, now_times
        What a step takes in both (n,), s; empty where that is not known.
    """
    if was.outcome.kind is not now.outcome.kind:
        return (Change(Aspect.OUTCOME, was.outcome, now.outcome, lost=was.outcome.ok),)
    if not was.outcome.ok:
        return ()
    return (*_orders(was, now), *_drifts(was, now), *_error(was, now), *_time(was_times, now_times))


def _orders(was: Observation, now: Observation) -> Iterator[Change]:
    pairs = (
        (Aspect.ATTITUDE_ORDER, was.attitude_order, now.attitude_order),
        (Aspect.RATES_ORDER, was.rates_order, now.rates_order),
    )
    grown = direction(was.error, now.error)
    for aspect, before, after in pairs:
        if math.isnan(before.slope) or math.isnan(after.slope):
            # Whether an order can be fitted may hang on round-off; where the error changed with it, it does not.
            if math.isnan(before.slope) != math.isnan(after.slope) and grown:
                yield Change(aspect, before, after, lost=math.isnan(after.slope) and grown > 0)
        elif abs(after.slope - before.slope) > max(ORDER_STEP, ORDER_ERRORS * math.hypot(before.stderr, after.stderr)):
            yield Change(aspect, before, after, lost=after.slope < before.slope)


def _drifts(was: Observation, now: Observation) -> Iterator[Change]:
    for quantity in was.drifts:
        before, after = was.drifts[quantity], now.drifts[quantity]
        grade, other = classify(before.value), classify(after.value)
        if grade is None or other is None:
            continue
        if grade is other is DriftClass.LARGE:
            if before.high < 0 < after.low or after.high < 0 < before.low:
                yield Change(Aspect.DRIFT, before, after, quantity)
        elif grade is not other and direction(before, after):
            yield Change(Aspect.DRIFT, before, after, quantity, lost=other > grade)


def _error(was: Observation, now: Observation) -> Iterator[Change]:
    if max(was.error.value, now.error.value) > ROUND_OFF and direction(was.error, now.error):
        yield Change(Aspect.ERROR, was.error, now.error)


def _time(was: StepTimes, now: StepTimes) -> Iterator[Change]:
    if differ(was, now):
        yield Change(Aspect.TIME, Spread.of(was), ratio(was, now))


def direction(was: Spread, now: Spread) -> int:
    """Return 1 where all sizes grew by more than `FACTOR`, -1 where they shrank by as much, else 0."""
    before, after = was.sizes, now.sizes
    return int(after[0] > FACTOR * before[1]) - int(before[0] > FACTOR * after[1])
