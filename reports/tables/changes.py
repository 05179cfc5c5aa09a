"""What changed between two versions of an engine, in one sentence with both versions and figures."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from conservative.benchmarks.measures.drift_class import SMALL
from conservative.benchmarks.tracking.changes import Aspect, Change
from conservative.benchmarks.tracking.observation import Fit, Spread
from conservative.benchmarks.tracking.track import Transition
from conservative.outcome import Outcome, OutcomeKind

from .cells import number, outcome_text

PER_CENT = 0.01
"""Relative drift from which on it is written in per cent."""
WHOLE = 0.25
"""An order that is nearer than this to a whole number is called that number."""


def sentence(transition: Transition) -> str:
    """Return what changed; empty where nothing did."""
    if not transition.changes:
        return ""
    now = transition.now
    head = f"{now.setting or 'default'} on {now.scene}: from {transition.was.version} to {now.version} "
    return head + ", ".join(_phrases(transition.changes, now.dt))


def order_text(order: float) -> str:
    """Return an order as people say it: 2 for what is next to 2, else with one decimal."""
    whole = round(order)
    return str(whole) if abs(order - whole) < WHOLE else f"{order:.1f}"


def drift_text(drift: float) -> str:
    """Return a relative drift: in per cent where it is at least one."""
    return f"{100 * drift:.2g} %" if PER_CENT <= abs(drift) < math.inf else number(drift, 1)


def _phrases(changes: Sequence[Change], dt: float) -> list[str]:
    """Return a phrase for each change, and one for both orders where they say the same."""
    texts = [_phrase(change, dt) for change in changes]
    attitude, rates = Aspect.ATTITUDE_ORDER.value, Aspect.RATES_ORDER.value
    both = [text.replace(attitude, rates) for text in texts[:1] if attitude in text]
    if both == texts[1:2]:
        return [texts[0].replace(f"the {attitude}", "the orders of attitude and rates"), *texts[2:]]
    return texts


def _phrase(change: Change, dt: float) -> str:
    phrases: Mapping[Aspect, Callable[[Change, float], str]] = {
        Aspect.OUTCOME: _outcome,
        Aspect.DRIFT: _drift,
        Aspect.ERROR: _error,
        Aspect.TIME: _time,
    }
    return phrases.get(change.aspect, _order)(change, dt)


def _outcome(change: Change, dt: float) -> str:
    was, now = change.was, change.now
    assert isinstance(was, Outcome)
    assert isinstance(now, Outcome)
    if was.kind is OutcomeKind.UNSUPPORTED:
        return "it appeared" + ("" if now.ok else f", {_with_reason(now)} at dt = {dt:g} s")
    if now.kind is OutcomeKind.UNSUPPORTED:
        return "it disappeared"
    return f"the outcome at dt = {dt:g} s went from {outcome_text(was)} to {_with_reason(now)}"


def _with_reason(outcome: Outcome) -> str:
    return str(outcome) if outcome.kind is OutcomeKind.CRASHED else outcome_text(outcome)


def _order(change: Change, dt: float) -> str:
    was, now, name = change.was, change.now, change.aspect.value
    assert isinstance(was, Fit)
    assert isinstance(now, Fit)
    if math.isnan(now.slope):
        return f"no {name} can be fitted any more, which was {order_text(was.slope)} ({now.reason})"
    if math.isnan(was.slope):
        return f"an {name} can be fitted, {order_text(now.slope)}, which was not so before ({was.reason})"
    verb = "rose" if now.slope > was.slope else "fell"
    return f"the {name} {verb} from {order_text(was.slope)} to {order_text(now.slope)}"


def _drift(change: Change, dt: float) -> str:
    was, now = _values(change)
    turned = was * now < 0 and min(abs(was), abs(now)) > SMALL
    verb = "turned" if turned else "rose" if abs(now) > abs(was) else "fell"
    signed = "+" if turned else ""
    texts = [(signed if value > 0 else "") + drift_text(value) for value in (was, now)]
    return f"the {change.quantity} drift at dt = {dt:g} s {verb} from {texts[0]} to {texts[1]}"


def _error(change: Change, dt: float) -> str:
    was, now = _values(change)
    verb = "rose" if now > was else "fell"
    return f"the attitude error at dt = {dt:g} s {verb} from {number(was)} to {number(now)} rad"


def _time(change: Change, dt: float) -> str:
    now = change.now
    assert isinstance(now, Spread)
    return f"a step takes {number(now.value)} times as long ({number(now.low)} to {number(now.high)})"


def _values(change: Change) -> tuple[float, float]:
    was, now = change.was, change.now
    assert isinstance(was, Spread)
    assert isinstance(now, Spread)
    return was.value, now.value
