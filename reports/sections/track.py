"""Versions of an engine, and what changed from one to the next."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from conservative.benchmarks.measures.drift_class import DriftClass, classify
from conservative.benchmarks.tracking.observation import Observation, Spread
from conservative.benchmarks.tracking.track import History, Line, Transition
from conservative.outcome import Outcome, OutcomeKind

from ..document.model import Cell, Check, Document, Facts, Grade, Items, Paragraph, Role, Row, Section, Style, Table, filled
from ..tables.cells import DASH, number, outcome_cell
from ..tables.changes import drift_text, order_text, sentence

NOTHING_CHANGED = "No conclusion changed."
NO_END = "no setting reaches the end of a run"
_GRADES = {DriftClass.CONSERVED: ("✓", Grade.GOOD), DriftClass.SMALL: ("≈", Grade.FAIR), DriftClass.LARGE: ("✗", Grade.BAD)}
_WORDS = (
    "Orders are over shorter and shorter steps; everything else is at the step of the scene. A time ratio is relative to "
    "the first version, from rounds that interleave all versions; in parentheses, the variation between repeats."
)


def build(history: History, gated: bool = False, made: Mapping[str, str] | None = None) -> Document:
    """Return the document of a history.

    Parameters
    ----------
    history
        The measurements of all versions.
    gated
        Whether a loss in the last version is a failure.
    made
        How and where it was measured.
    """
    plan, made = history.plan, made or {}
    failures = list(_failures(history)) if gated else []
    sentences = [text for each in history.transitions if (text := sentence(each))]
    by_scene: dict[str, list[Line]] = {}
    for line in history.lines:
        by_scene.setdefault(line.scene, []).append(line)
    tables = [_table(scene, lines) for scene, lines in by_scene.items()]
    changed = Section("What changed", [Items.of(sentences) if sentences else Paragraph(NOTHING_CHANGED)])
    failed = [text for line in history.lines for text in _unfinished(line)]
    unfinished = Section("Runs that failed or show no order", filled(Items.of(failed)))
    verdict = []
    if gated:
        was, now = plan.versions[-2:]
        verdict = filled(Paragraph(f"{now} against {was}: {'FAILED' if failures else 'passed'}", Role.LEAD), Items.of(failures))
    versions = [(each.version, each.python, ", ".join(each.packages)) for each in plan.environments]
    data = {
        "made": dict(made),
        "engine": plan.engine,
        "passed": not failures,
        "failures": failures,
        "versions": [{name: getattr(each, name) for name in ("version", "python", "packages")} for each in plan.environments],
        "rows": [_record(line, each) for line in history.lines for each in line.observations],
        "changes": [_change_record(each) for each in history.transitions if each.changes],
    }
    return Document(
        f"conservative track {plan.engine}",
        f"Versions of {plan.engine}: {', '.join(plan.versions)}",
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
        checks=_checks(history, gated, failures),
        failures=failures,
    )


def _failures(history: History) -> Iterator[str]:
    """Yield why the last version does not pass: what it lost, or that no run reaches its end."""
    yield from (sentence(each) for each in history.lost_last)
    if not any(line.observations[-1].outcome.ok for line in history.lines):
        yield f"{history.plan.versions[-1]}: {NO_END}"


def _checks(history: History, gated: bool, failures: list[str]) -> list[Check]:
    """Return a check for each setting, scene and pair of consecutive versions."""
    checks = []
    for each in history.transitions:
        text = sentence(each)
        name = f"{each.now.setting or 'default'}: {each.was.version} to {each.now.version}"
        failed = gated and each in history.lost_last
        checks.append(Check(each.now.scene, name, text or NOTHING_CHANGED, text if failed else ""))
    if failures and not history.lost_last:
        checks.append(Check("all", history.plan.versions[-1], failure="\n".join(failures)))
    return checks


def _unfinished(line: Line) -> Iterator[str]:
    reasons = [(each.version, *_reason(each)) for each in line.observations]
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


def _table(scene: str, lines: list[Line]) -> Table:
    names = list(dict.fromkeys(name for line in lines for each in line.observations for name in each.drifts))
    header = ("setting", "version", "order", "order of rates", *(f"{name} drift" for name in names))
    times = ("attitude error, rad", "outcome", "time ratio", "µs a step")
    rows = [_row(line, each, names) for line in lines for each in line.observations]
    return Table((*header, *times), rows, f"{scene}, dt = {lines[0].observations[0].dt:g} s", Style.FILTERED)


def _row(line: Line, seen: Observation, quantities: list[str]) -> Row:
    drifts = [_drift_cell(seen.drifts[name].value if name in seen.drifts else math.nan) for name in quantities]
    fits = (seen.attitude_order, seen.rates_order)
    orders = [DASH if math.isnan(fit.slope) else order_text(fit.slope) for fit in fits]
    ratio, step_time = _ratio(line, seen), min(line.times.get(seen.version, (math.nan,)))
    ratio_text = DASH if ratio is None else number(ratio.value)
    if ratio is not None and ratio.low != ratio.high:
        ratio_text += f" ({number(ratio.low)} to {number(ratio.high)})"
    outcome = outcome_cell(Outcome(seen.outcome.kind))  # the reason is below the tables
    names = (seen.setting or "default", seen.version)
    return (*names, *orders, *drifts, number(seen.error.value), outcome, ratio_text, number(1e6 * step_time))


def _drift_cell(drift: float) -> Cell:
    grade = classify(drift)
    if grade is None:
        return Cell(DASH, Grade.NONE)
    symbol, colour = _GRADES[grade]
    return Cell(f"{symbol} {drift_text(drift)}", colour)


def _ratio(line: Line, seen: Observation) -> Spread | None:
    """Return the time of a step divided by that in the first version that has one."""
    first = next((each.version for each in line.observations if each.version in line.times), "")
    return line.time_ratio(seen.version, first)


def _record(line: Line, seen: Observation) -> dict[str, Any]:
    return {
        **{name: getattr(seen, name) for name in ("scene", "setting", "version", "label", "dt", "outcome")},
        "attitude_order": seen.attitude_order,
        "rates_order": seen.rates_order,
        "attitude_error_rad": seen.error,
        "drifts": seen.drifts,
        "step_times_s": line.times.get(seen.version, ()),
        "time_ratio": _ratio(line, seen),
    }


def _change_record(transition: Transition) -> dict[str, Any]:
    was, now = transition.was, transition.now
    names = {"scene": now.scene, "setting": now.setting, "from": was.version, "to": now.version}
    aspects = [{"aspect": each.aspect.value, "quantity": each.quantity, "lost": each.lost} for each in transition.changes]
    return {**names, "sentence": sentence(transition), "lost": bool(transition.lost), "changes": aspects}
