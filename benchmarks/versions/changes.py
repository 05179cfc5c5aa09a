"""Changes of conclusions between two versions, not of digits.

The conclusions are: whether a run reaches its end, an order, whether a quantity is conserved, drifts little or drifts, the sign
of an energy drift, and the error and the time within a factor. A change counts only if it exceeds the spreads of both versions.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from functools import partial

from ..measures.change import Change, Range, RowName, direction, exact
from ..measures.errors import CONSERVED, LOST, SMALL
from .engine import TIME_FACTOR, EngineComparison, Observation, StepTimes, ratio

ORDER_STEP, ORDER_ERRORS = 0.5, 2.0
"""Orders differ if their difference exceeds the first, and this number of their uncertainties."""
FACTOR = 3.0
"""Smallest ratio of errors, or drifts, that differ."""
ROUND_OFF = 1e-9
"""Attitude errors, rad, below this do not differ: they are round-off."""


class Aspect(StrEnum):
    """The measure of a change."""

    OUTCOME = "outcome"
    ATTITUDE_ORDER = "order of the attitude"
    RATES_ORDER = "order of the rates"
    DRIFT = "drift"
    ERROR = "attitude error"
    TIME = "time of a step"


def find_changes(was: Observation, now: Observation, was_times: StepTimes, now_times: StepTimes) -> tuple[Change, ...]:
    """Return the changes from one version to another, on one scene and with one setting, most important first.

    `was_times` and `now_times` are the times of a step (n,), s; empty if not known.
    """
    row = partial(RowName, now.scene, now.setting)
    if was.outcome.kind is not now.outcome.kind:
        return (Change(row(Aspect.OUTCOME), was.outcome, now.outcome, lost=was.outcome.ok),)
    if not was.outcome.ok:
        return ()
    changes, factor = [*_orders(was, now), *_drifts(was, now)], f"within a factor of {FACTOR:g}"
    # An error of 0.46 rad cannot grow much more than fivefold, because angles end at pi: what counts is that 1.26 rad is lost.
    crossed = int(was.error.high <= LOST < now.error.low) - int(now.error.high <= LOST < was.error.low)
    if crossed or (max(was.error.value, now.error.value) > ROUND_OFF and resized(was.error, now.error)):
        changes.append(Change(row(Aspect.ERROR), was.error, now.error, factor, lost=crossed > 0))
    if (times := ratio(was_times, now_times)).direction(TIME_FACTOR):
        limit = f"within a factor of {TIME_FACTOR:g}"
        changes.append(Change(row(Aspect.TIME), Range.of(was_times), times, limit, lost=False))
    return tuple(changes)


def _orders(was: Observation, now: Observation) -> Iterator[Change]:
    pairs = (
        (Aspect.ATTITUDE_ORDER, was.attitude_order, now.attitude_order),
        (Aspect.RATES_ORDER, was.rates_order, now.rates_order),
    )
    grown = resized(was.error, now.error)
    for aspect, before, after in pairs:
        row, margin = RowName(now.scene, now.setting, aspect), ORDER_ERRORS * math.hypot(before.stderr, after.stderr)
        if math.isnan(before.slope) or math.isnan(after.slope):
            # Round-off can decide if an order can be fitted. Such a change counts only if the error changed too.
            if math.isnan(before.slope) != math.isnan(after.slope) and grown:
                yield Change(row, before, after, lost=math.isnan(after.slope) and grown > 0)
        elif side := direction(exact(before.slope), exact(after.slope), margin=max(ORDER_STEP, margin)):
            yield Change(row, before, after, f"within {max(ORDER_STEP, margin):.2g}", lost=side < 0)


def _drifts(was: Observation, now: Observation) -> Iterator[Change]:
    for quantity in was.drifts:
        before, after = was.drifts[quantity], now.drifts[quantity]
        row = RowName(now.scene, now.setting, Aspect.DRIFT, quantity)
        if math.isnan(before.value) or math.isnan(after.value):
            continue
        limits = CONSERVED, SMALL  # up to which a quantity is conserved (class 0) or drifts little (1)
        old, new = (bisect_left(limits, abs(drift.value)) for drift in (before, after))
        if old == new == len(limits):
            if {direction(exact(0.0), drift) for drift in (before, after)} == {1, -1}:
                yield Change(row, before, after, "the same sign", lost=False)
        elif old != new and resized(before, after):
            yield Change(row, before, after, f"within a factor of {FACTOR:g}", lost=new > old)


def resized(was: Range, now: Range) -> int:
    """Return 1 if all sizes grew by more than `FACTOR`, -1 if they shrank by as much, else 0."""
    return direction(was.size, now.size, FACTOR)


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
