"""The changes between two versions of an engine, in one sentence with both versions and numbers."""

from __future__ import annotations

import math

from conservative.benchmarks.measures.drift_class import SMALL
from conservative.benchmarks.versions.changes import Aspect, Change, Transition
from conservative.benchmarks.versions.engine import Fit, Spread
from conservative.outcome import Outcome, OutcomeKind

from .cells import number, outcome_text

PERCENT = 0.01
"""Smallest relative drift that is written in percent."""
WHOLE = 0.25
"""An order within this distance of a whole number is written as that number."""


def sentence(transition: Transition) -> str:
    """Return the changes of a transition in one sentence; empty if there are none."""
    if not transition.changes:
        return ""
    now = transition.now
    texts = [_phrase(change, f"at dt = {now.dt:g} s") for change in transition.changes]
    attitude, rates = Aspect.ATTITUDE_ORDER.value, Aspect.RATES_ORDER.value
    if attitude in texts[0] and [texts[0].replace(attitude, rates)] == texts[1:2]:  # both orders changed in the same way
        texts[:2] = [texts[0].replace(f"the {attitude}", "the orders of attitude and rates")]
    head = f"{now.setting or 'default'} on {now.scene}: from {transition.was.version} to {now.version} "
    return head + ", ".join(texts)


def order_text(order: float) -> str:
    """Return an order as text: 2 for 1.98, 2.3 for 2.31."""
    whole = round(order)
    return str(whole) if abs(order - whole) < WHOLE else f"{order:.1f}"


def drift_text(drift: float) -> str:
    """Return a relative drift as text, in percent from `PERCENT` on."""
    return f"{100 * drift:.2g} %" if PERCENT <= abs(drift) < math.inf else number(drift, 1)


def _phrase(change: Change, at: str) -> str:
    match change.was, change.now:
        case Outcome() as was, Outcome() as now:
            return _outcome(was, now, at)
        case Fit() as was, Fit() as now:
            return _order(was, now, change.aspect.value)
        case Spread(), Spread(value, low, high) if change.aspect is Aspect.TIME:
            return f"a step takes {number(value)} times as long ({number(low)} to {number(high)})"
        case Spread(before), Spread(after) if change.aspect is Aspect.ERROR:
            verb = "rose" if after > before else "fell"
            return f"the attitude error {at} {verb} from {number(before)} to {number(after)} rad"
        case Spread(before), Spread(after):
            turned = before * after < 0 and min(abs(before), abs(after)) > SMALL
            verb = "turned" if turned else "rose" if abs(after) > abs(before) else "fell"
            texts = [("+" if turned and value > 0 else "") + drift_text(value) for value in (before, after)]
            return f"the {change.quantity} drift {at} {verb} from {texts[0]} to {texts[1]}"
    raise AssertionError(change)


def _outcome(was: Outcome, now: Outcome, at: str) -> str:
    text = str(now) if now.kind is OutcomeKind.CRASHED else outcome_text(now)
    if was.kind is OutcomeKind.UNSUPPORTED:
        return "it appeared" + ("" if now.ok else f", {text} {at}")
    if now.kind is OutcomeKind.UNSUPPORTED:
        return "it disappeared"
    return f"the outcome {at} went from {outcome_text(was)} to {text}"


def _order(was: Fit, now: Fit, name: str) -> str:
    if math.isnan(now.slope):
        return f"no {name} can be fitted any more, which was {order_text(was.slope)} ({now.reason})"
    if math.isnan(was.slope):
        return f"an {name} can be fitted, {order_text(now.slope)}, which was not so before ({was.reason})"
    verb = "rose" if now.slope > was.slope else "fell"
    return f"the {name} {verb} from {order_text(was.slope)} to {order_text(now.slope)}"
