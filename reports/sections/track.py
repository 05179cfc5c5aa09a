"""Versions of an engine, and what changed from one to the next."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from conservative.benchmarks.measures.convergence_order import Order
from conservative.benchmarks.measures.errors import SMALL, DriftClass, classify
from conservative.benchmarks.versions.changes import Aspect, Change, Transition, list_transitions
from conservative.benchmarks.versions.engine import EngineComparison, EngineLine, Observation, Spread, ratio
from conservative.outcome import Outcome, OutcomeKind

from ..document.cells import DASH, number, outcome_cell, outcome_text
from ..document.model import Cell, Check, Document, Emphasis, Facts, Grade, Items, Paragraph, Row, Section, Style, Table, filled

NOTHING_CHANGED = "No conclusion changed."
NO_END = "no setting reaches the end of a run"
PERCENT = 0.01
"""Smallest relative drift that is written in percent."""
WHOLE = 0.25
"""An order within this distance of a whole number is written as that number."""
_GRADES = {DriftClass.CONSERVED: ("✓", Grade.GOOD), DriftClass.SMALL: ("≈", Grade.FAIR), DriftClass.LARGE: ("✗", Grade.BAD)}
_FITTED = ("slope", "stderr", "reason")
"""Fields of an order in the JSON."""
_WORDS = (
    "Orders are over shorter and shorter steps; everything else is at the step of the scene. A time ratio is relative to "
    "the first version, from rounds that interleave all versions; in parentheses, the variation between repeats."
)


def build(comparison: EngineComparison, gated: bool = False, made: Mapping[str, str] | None = None) -> Document:
    """Return the document of a comparison.

    Parameters
    ----------
    comparison
        The measurements of all versions.
    gated
        Whether a loss in the last version is a failure.
    made
        How and where it was measured.
    """
    made, transitions = made or {}, list_transitions(comparison)
    environments = [version.environment for version in comparison.versions]
    engine, names = environments[0].engine, [version.name for version in comparison.versions]
    lost_last = [each for each in transitions if each.lost and each.now.version == names[-1]]
    failures = []
    if gated:
        failures = [sentence(each) for each in lost_last]
        if not any(line.results[-1] and line.results[-1].outcome.ok for line in comparison.lines):
            failures.append(f"{names[-1]}: {NO_END}")
    sentences = [text for each in transitions if (text := sentence(each))]
    by_scene: dict[str, list[EngineLine]] = {}
    for line in comparison.lines:
        by_scene.setdefault(line.scene, []).append(line)
    tables = [_table(scene, lines) for scene, lines in by_scene.items()]
    changed = Section("What changed", [Items.of(sentences) if sentences else Paragraph(NOTHING_CHANGED)])
    failed = [text for line in comparison.lines for text in _unfinished(line)]
    unfinished = Section("Runs that failed or show no order", filled(Items.of(failed)))
    verdict = []
    if gated:
        was, now = names[-2:]
        verdict = filled(
            Paragraph(f"{now} against {was}: {'FAILED' if failures else 'passed'}", Emphasis.LEAD), Items.of(failures)
        )
    versions = [(each.version, each.python, ", ".join(each.packages)) for each in environments]
    data = {
        "made": dict(made),
        "engine": engine,
        "passed": not failures,
        "failures": failures,
        "versions": [{name: getattr(each, name) for name in ("version", "python", "packages")} for each in environments],
        "rows": [_record(line, each) for line in comparison.lines for each in _seen(line)],
        "changes": [_change_record(each) for each in transitions if each.changes],
    }
    return Document(
        f"conservative track {engine}",
        f"Versions of {engine}: {', '.join(names)}",
        filled(
            *verdict,
            changed,
            Section("What was measured", [Paragraph(_WORDS), *tables]),
            unfinished,
            Section("Versions", [Table(("version", "Python", "packages"), versions, "Packages of each version")]),
            Section("How this was made", [Facts(list(made.items()))]) if made else None,
        ),
        brief=filled(*tables, changed, unfinished, *verdict),
        data=data,
        checks=_checks(transitions, lost_last if gated else [], failures, names[-1]),
        failures=failures,
    )


def _checks(transitions: Sequence[Transition], failed: Sequence[Transition], failures: list[str], last: str) -> list[Check]:
    """Return a check for each setting, scene and pair of consecutive versions."""
    checks = []
    for each in transitions:
        text = sentence(each)
        name = f"{each.now.setting or 'default'}: {each.was.version} to {each.now.version}"
        checks.append(Check(each.now.scene, name, text or NOTHING_CHANGED, text if each in failed else ""))
    if failures and not failed:
        checks.append(Check("all", last, failure="\n".join(failures)))
    return checks


def _seen(line: EngineLine) -> list[Observation]:
    return [each for each in line.results if each is not None]


def _unfinished(line: EngineLine) -> Iterator[str]:
    reasons = [(each.version, *_reason(each)) for each in _seen(line)]
    for kind in dict.fromkeys(kind for _, kind, _ in reasons if kind):
        found = [(version, reason) for version, this, reason in reasons if this == kind]
        versions = ", ".join(version for version, _ in found)
        yield f"{line.setting or 'default'} on {line.scene} in {versions}: {found[-1][1]}"


def _reason(seen: Observation) -> tuple[str, str]:
    """Return the kind of a failure, which versions can have in common, and its full text; both empty if there is none."""
    if not seen.outcome.ok:
        return seen.outcome.kind.value, str(seen.outcome)
    reason = seen.attitude_order.reason
    return reason and OutcomeKind.NO_ORDER.value, reason and f"{OutcomeKind.NO_ORDER.value} ({reason})"


def _table(scene: str, lines: list[EngineLine]) -> Table:
    names = list(dict.fromkeys(name for line in lines for each in _seen(line) for name in each.drifts))
    header = ("setting", "version", "order", "order of rates", *(f"{name} drift" for name in names))
    times = ("attitude error, rad", "outcome", "time ratio", "µs a step")
    rows = [_row(line, each, names) for line in lines for each in _seen(line)]
    return Table((*header, *times), rows, f"{scene}, dt = {_seen(lines[0])[0].dt:g} s", Style.FILTERED)


def _row(line: EngineLine, seen: Observation, quantities: list[str]) -> Row:
    drifts = [_drift_cell(seen.drifts[name].value if name in seen.drifts else math.nan) for name in quantities]
    fits = (seen.attitude_order, seen.rates_order)
    orders = [DASH if math.isnan(fit.slope) else order_text(fit.slope) for fit in fits]
    shown, step_time = _ratio(line, seen), min((line.times or {}).get(seen.version, (math.nan,)))
    ratio_text = DASH if shown is None else number(shown.value)
    if shown is not None and shown.low != shown.high:
        ratio_text += f" ({number(shown.low)} to {number(shown.high)})"
    outcome = outcome_cell(Outcome(seen.outcome.kind))  # the reason is below the tables
    names = (seen.setting or "default", seen.version)
    return (*names, *orders, *drifts, number(seen.error.value), outcome, ratio_text, number(1e6 * step_time))


def _drift_cell(drift: float) -> Cell:
    grade = classify(drift)
    if grade is None:
        return Cell(DASH, Grade.NONE)
    symbol, colour = _GRADES[grade]
    return Cell(f"{symbol} {drift_text(drift)}", colour)


def _ratio(line: EngineLine, seen: Observation) -> Spread | None:
    """Return the time of a step divided by that in the first version that has one."""
    times = line.times or {}
    first = next((times[each.version] for each in _seen(line) if each.version in times), None)
    return ratio(first, times[seen.version]) if first and seen.version in times else None


def _record(line: EngineLine, seen: Observation) -> dict[str, Any]:
    return {
        **{name: getattr(seen, name) for name in ("scene", "setting", "version", "label", "dt", "outcome")},
        **{name: {key: vars(getattr(seen, name))[key] for key in _FITTED} for name in ("attitude_order", "rates_order")},
        "attitude_error_rad": seen.error,
        "drifts": seen.drifts,
        "step_times_s": (line.times or {}).get(seen.version, ()),
        "time_ratio": _ratio(line, seen),
    }


def _change_record(transition: Transition) -> dict[str, Any]:
    was, now = transition.was, transition.now
    names = {"scene": now.scene, "setting": now.setting, "from": was.version, "to": now.version}
    aspects = [{"aspect": each.aspect.value, "quantity": each.quantity, "lost": each.lost} for each in transition.changes]
    return {**names, "sentence": sentence(transition), "lost": bool(transition.lost), "changes": aspects}


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
            return _outcome_change(was, now, at)
        case Order() as was, Order() as now:
            return _order_change(was, now, change.aspect.value)
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


def _outcome_change(was: Outcome, now: Outcome, at: str) -> str:
    text = str(now) if now.kind is OutcomeKind.CRASHED else outcome_text(now)
    if was.kind is OutcomeKind.UNSUPPORTED:
        return "it appeared" + ("" if now.ok else f", {text} {at}")
    if now.kind is OutcomeKind.UNSUPPORTED:
        return "it disappeared"
    return f"the outcome {at} went from {outcome_text(was)} to {text}"


def _order_change(was: Order, now: Order, name: str) -> str:
    if math.isnan(now.slope):
        return f"no {name} can be fitted any more, which was {order_text(was.slope)} ({now.reason})"
    if math.isnan(was.slope):
        return f"an {name} can be fitted, {order_text(now.slope)}, which was not so before ({was.reason})"
    verb = "rose" if now.slope > was.slope else "fell"
    return f"the {name} {verb} from {order_text(was.slope)} to {order_text(now.slope)}"
