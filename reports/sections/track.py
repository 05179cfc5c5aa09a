"""Versions of an engine, and the changes from one to the next."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from conservative.benchmarks.measures.change import Change, Range
from conservative.benchmarks.measures.convergence_order import Order
from conservative.benchmarks.versions.changes import Aspect, Transition, list_transitions
from conservative.benchmarks.versions.engine import EngineComparison, EngineLine, Observation, ratio
from conservative.benchmarks.versions.times import Ratio
from conservative.outcome import Outcome, OutcomeKind

from ..document.cells import DASH, angle, bound, grade, number, numeric, outcome_cell, outcome_text
from ..document.model import Check, Document, Emphasis, Facts, Items, Paragraph, Row, Section, Style, Table, filled

NOTHING_CHANGED = "No change."
NO_END = "no run reaches its end"
PERCENT = 0.01
"""Smallest relative drift that is written in percent."""
WHOLE = 0.25
"""An order within this distance of a whole number is written as that number."""
_FITTED = ("slope", "stderr", "reason")
"""Fields of an order in the JSON."""
_WORDS = (
    "Orders are fitted over a range of steps; everything else is at the step of the scene. A time ratio is relative to the "
    "first version, from rounds that interleave all versions; in parentheses, its interval (as in `gate --against`)."
)


def build(
    comparison: EngineComparison,
    gated: bool = False,
    made: Mapping[str, str] | None = None,
    verified: Sequence[str] | None = None,
) -> Document:
    """Return the document of a comparison, measured as `made` says; if `gated`, a loss in the last version is a failure.

    `verified` are sentences about cases that became right or wrong; None if the versions were not verified.
    """
    made, transitions = made or {}, list_transitions(comparison)
    environments = [version.environment for version in comparison.versions]
    engine, names = environments[0].engine, [version.name for version in comparison.versions]
    lost_last = [transition for transition in transitions if transition.lost and transition.now.version == names[-1]]
    failures = []
    if gated:
        failures = [changes_text(transition) for transition in lost_last]
        if not any(line.results[-1] and line.results[-1].outcome.ok for line in comparison.lines):
            failures.append(f"{names[-1]}: {NO_END}")
    sentences = [text for transition in transitions if (text := changes_text(transition))]
    by_scene: dict[str, list[EngineLine]] = {}
    for line in comparison.lines:
        by_scene.setdefault(line.scene, []).append(line)
    tables = [_table(scene, lines) for scene, lines in by_scene.items()]
    changed = Section("Changes", [Items.of(sentences) if sentences else Paragraph(NOTHING_CHANGED)])
    verdicts = (
        [] if verified is None else [Section("Verification", [Items.of(verified) if verified else Paragraph(NOTHING_CHANGED)])]
    )
    failed = [text for line in comparison.lines for text in _unfinished(line)]
    unfinished = Section("Runs that failed or show no order", filled(Items.of(failed)))
    verdict = []
    if gated:
        was, now = names[-2:]
        verdict = filled(
            Paragraph(f"{now} against {was}: {'FAILED' if failures else 'passed'}", Emphasis.LEAD), Items.of(failures)
        )
    versions = [(environment.version, environment.runtime, ", ".join(environment.packages)) for environment in environments]
    data = {
        "made": dict(made),
        "engine": engine,
        "passed": not failures,
        "failures": failures,
        **({} if verified is None else {"verified": list(verified)}),
        "versions": [
            {name: getattr(environment, name) for name in ("version", "runtime", "packages")} for environment in environments
        ],
        "rows": [_record(line, seen) for line in comparison.lines for seen in _seen(line)],
        "changes": [
            {
                **{
                    "scene": transition.now.scene,
                    "setting": transition.now.setting,
                    "from": transition.was.version,
                    "to": transition.now.version,
                },
                "sentence": changes_text(transition),
                "lost": bool(transition.lost),
                "changes": [
                    {"aspect": c.row.measure, "quantity": c.row.quantity, "allowed": c.allowed, "lost": c.lost}
                    for c in transition.changes
                ],
            }
            for transition in transitions
            if transition.changes
        ],
    }
    checks = []  # one for each setting, scene and pair of consecutive versions
    for transition in transitions:
        text, name = (
            changes_text(transition),
            f"{transition.now.setting or 'default'}: {transition.was.version} to {transition.now.version}",
        )
        checks.append(
            Check(transition.now.scene, name, text or NOTHING_CHANGED, text if gated and transition in lost_last else "")
        )
    if failures and not lost_last:
        checks.append(Check("all", names[-1], failure="\n".join(failures)))
    return Document(
        f"conservative track {engine}",
        f"Versions of {engine}: {', '.join(names)}",
        filled(
            *verdict,
            changed,
            *verdicts,
            Section("Measurements", [Paragraph(_WORDS), *tables]),
            unfinished,
            Section("Versions", [Table(("version", "runtime", "packages"), versions, "Packages of each version")]),
            Section("How this was made", [Facts(list(made.items()))]) if made else None,
        ),
        brief=filled(*tables, changed, *verdicts, unfinished, *verdict),
        data=data,
        checks=checks,
        failures=failures,
    )


def _seen(line: EngineLine) -> list[Observation]:
    return [result for result in line.results if result is not None]


def _unfinished(line: EngineLine) -> Iterator[str]:
    """Yield each kind of failure, and each missing order, with its versions and the last of their reasons."""
    kinds: dict[str, list[tuple[str, str]]] = {}
    for seen in _seen(line):
        if not seen.outcome.ok:
            kinds.setdefault(seen.outcome.kind.value, []).append((seen.version, str(seen.outcome)))
        elif reason := seen.attitude_order.reason:
            kind = OutcomeKind.NO_ORDER.value
            kinds.setdefault(kind, []).append((seen.version, f"{kind} ({reason})"))
    for failures in kinds.values():
        versions = ", ".join(version for version, _ in failures)
        yield f"{line.setting or 'default'} on {line.scene} in {versions}: {failures[-1][1]}"


def _table(scene: str, lines: list[EngineLine]) -> Table:
    names = list(dict.fromkeys(name for line in lines for seen in _seen(line) for name in seen.drifts))
    header = ("setting", "version", "order", "order of rates", *(f"{name} drift" for name in names))
    times = ("attitude error, rad", "outcome", "time ratio", "µs a step")
    rows = [_row(line, seen, names) for line in lines for seen in _seen(line)]
    return Table((*header, *times), rows, f"{scene}, dt = {_seen(lines[0])[0].dt:g} s", Style.FILTERED)


def _row(line: EngineLine, seen: Observation, quantities: list[str]) -> Row:
    drifts = [seen.drifts[name].value if name in seen.drifts else math.nan for name in quantities]
    slopes = [fit.slope for fit in (seen.attitude_order, seen.rates_order)]
    time, step_time = _ratio(line, seen), min((line.times or {}).get(seen.version, (math.nan,)))
    varies = time is not None and number(time.low) != number(time.high)
    return (
        seen.setting or "default",
        seen.version,
        *(numeric(slope, DASH if math.isnan(slope) else order_text(slope)) for slope in slopes),
        *(grade(abs(drift), drift_text(drift)) for drift in drifts),
        numeric(seen.error.value, angle(seen.error.value)),
        outcome_cell(Outcome(seen.outcome.kind)),  # its reason is in the list of unfinished runs
        DASH if time is None else numeric(time.value, _ratio_text(time) if varies else number(time.value)),
        numeric(1e6 * step_time),
    )


def _ratio(line: EngineLine, seen: Observation) -> Ratio | None:
    """Return the time of a step divided by that in the first version that has one."""
    times = line.times or {}
    first = next((times[other.version] for other in _seen(line) if other.version in times), None)
    return ratio(first, times[seen.version]) if first and seen.version in times else None


def _record(line: EngineLine, seen: Observation) -> dict[str, Any]:
    return {
        **{name: getattr(seen, name) for name in ("scene", "setting", "version", "label", "dt", "outcome")},
        **{name: {key: getattr(getattr(seen, name), key) for key in _FITTED} for name in ("attitude_order", "rates_order")},
        "attitude_error_rad": seen.error,
        "drifts": seen.drifts,
        "step_times_s": (line.times or {}).get(seen.version, ()),
        "time_ratio": _ratio(line, seen),
    }


def changes_text(transition: Transition) -> str:
    """Return the changes of a transition in one line; empty if there are none."""
    was, now = transition.was, transition.now
    changes = "; ".join(map(_change_text, transition.changes))
    return f"{now.setting or 'default'} on {now.scene}, {was.version} → {now.version}: {changes}" if changes else ""


def _change_text(change: Change) -> str:
    name = f"{change.row.quantity} {change.row.measure}".strip()
    match change.was, change.now:
        case Outcome() as was, Outcome() as now:
            return f"{name} {outcome_text(was)} → {now if now.kind is OutcomeKind.CRASHED else outcome_text(now)}"
        case Order() as was, Order() as now:
            orders = (f"none ({fit.reason})" if math.isnan(fit.slope) else order_text(fit.slope) for fit in (was, now))
            return f"{name} {' → '.join(orders)}"
        case Range(), Ratio() as now:
            return f"{name} {_ratio_text(now)} times as long"
        case Range(before), Range(after):
            drift = change.row.measure == Aspect.DRIFT
            return f"{name} {' → '.join(map(drift_text if drift else number, (before, after)))}{'' if drift else ' rad'}"
    raise AssertionError(change)


def _ratio_text(ratio: Ratio) -> str:
    return f"{number(ratio.value)} ({number(ratio.low)} to {number(ratio.high)})"


def order_text(order: float) -> str:
    """Return an order as text: 2 for 1.98, 2.3 for 2.31."""
    whole = round(order)
    return str(whole) if abs(order - whole) < WHOLE else f"{order:.1f}"


def drift_text(drift: float) -> str:
    """Return a relative drift as text, in percent from `PERCENT` on."""
    return f"{bound(100 * drift)} %" if PERCENT <= abs(drift) < math.inf else bound(drift, 1)
