"""An engine over its versions, as tables and sentences, JSON, Markdown and JUnit."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from conservative.benchmarks.measures.drift_class import DriftClass, classify
from conservative.benchmarks.tracking.observation import Observation, Spread
from conservative.benchmarks.tracking.track import History, Line, Transition
from conservative.outcome import Outcome, OutcomeKind

from .cells import DASH, Cell, Grade, Row, Table, markdown, number, outcome_cell, plain
from .changes import drift_text, order_text, sentence
from .junit import TestCase, junit_xml

NOTHING_CHANGED = "No conclusion changed."
UNFINISHED = "What did not reach its end, or shows no order"
NO_END = "no setting reaches the end of a run"
_GRADES = {DriftClass.CONSERVED: ("✓", Grade.GOOD), DriftClass.SMALL: ("≈", Grade.FAIR), DriftClass.LARGE: ("✗", Grade.BAD)}


@dataclass(frozen=True)
class Answer:
    """A history, whether a loss in the last version is a failure (`gated`), and how and where it was measured (`made`)."""

    history: History
    gated: bool = False
    made: Mapping[str, str] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether the last version lost nothing and reaches the end of a run; True if it is not gated."""
        return not list(self.failures)

    @property
    def failures(self) -> Iterator[str]:
        """Why the last version does not pass."""
        if not self.gated:
            return
        yield from (sentence(each) for each in self.history.lost_last)
        if not any(line.observations[-1].outcome.ok for line in self.history.lines):
            yield f"{self.history.plan.versions[-1]}: {NO_END}"

    @property
    def sentences(self) -> tuple[str, ...]:
        """Each change, version by version."""
        return tuple(text for each in self.history.transitions if (text := sentence(each)))

    @property
    def title(self) -> str:
        """The engine and its versions."""
        return f"{self.history.plan.engine}: {', '.join(self.history.plan.versions)}"

    @property
    def verdict(self) -> str:
        """The verdict in one line; empty if the last version is not gated."""
        if not self.gated:
            return ""
        was, now = self.history.plan.versions[-2:]
        return f"{now} against {was}: {'passed' if self.passed else 'FAILED'}"

    @property
    def tables(self) -> tuple[tuple[str, Table], ...]:
        """For each scene its caption and table: a row for each setting and version."""
        by_scene: dict[str, list[Line]] = {}
        for line in self.history.lines:
            by_scene.setdefault(line.scene, []).append(line)
        return tuple((f"{scene}, dt = {lines[0].observations[0].dt:g} s", _table(lines)) for scene, lines in by_scene.items())

    @property
    def unfinished(self) -> tuple[str, ...]:
        """Runs that did not reach their end or have no order: setting, scene, versions, and the reason in the last one."""
        return tuple(text for line in self.history.lines for text in _unfinished(line))

    @property
    def environments(self) -> Table:
        """Python and packages of each version."""
        rows = [(each.version, each.python, ", ".join(each.packages)) for each in self.history.plan.environments]
        return ("version", "Python", "packages"), rows

    def json_text(self) -> str:
        """Return all measurements and changes as JSON; null stands for a value that could not be measured."""
        plan = self.history.plan
        content = {
            "made": dict(self.made),
            "engine": plan.engine,
            "passed": self.passed,
            "failures": list(self.failures),
            "versions": [
                {"version": each.version, "python": each.python, "packages": each.packages} for each in plan.environments
            ],
            "rows": [plain(_record(line, each)) for line in self.history.lines for each in line.observations],
            "changes": [_change_record(each) for each in self.history.transitions if each.changes],
        }
        return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)

    def markdown_text(self) -> str:
        """Return tables, changes and versions as Markdown."""
        changes = "\n".join(f"- {text}" for text in self.sentences) or NOTHING_CHANGED
        failures = [f"- {text}" for text in self.failures]
        verdict = ["", f"**{self.verdict}**", *(["", *failures] if failures else [])] if self.gated else []
        tables = [part for caption, table in self.tables for part in ("", f"### {caption}", "", markdown(table))]
        made = (
            ["", "### How this was made", "", *(f"- {name}: {value}" for name, value in self.made.items())] if self.made else []
        )
        head = [f"## Versions of {self.title}", *verdict, "", "### What changed", "", changes]
        if self.unfinished:
            tables += ["", f"### {UNFINISHED}", "", *(f"- {text}" for text in self.unfinished)]
        return "\n".join([*head, *tables, "", "### Versions", "", markdown(self.environments), *made]) + "\n"

    def junit_text(self) -> str:
        """Return a case for each setting, scene and pair of consecutive versions in the format of JUnit."""
        cases = []
        for each in self.history.transitions:
            text = sentence(each)
            name = f"{each.now.setting or 'default'}: {each.was.version} to {each.now.version}"
            failed = self.gated and each in self.history.lost_last
            cases.append(TestCase(each.now.scene, name, text or NOTHING_CHANGED, text if failed else ""))
        last = self.history.plan.versions[-1]
        if not self.passed and not self.history.lost_last:
            cases.append(TestCase("all", last, failure="\n".join(self.failures)))
        return junit_xml(f"conservative track {self.history.plan.engine}", cases)


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


def _table(lines: list[Line]) -> Table:
    names = list(dict.fromkeys(name for line in lines for each in line.observations for name in each.drifts))
    header = ("setting", "version", "order", "order of rates", *(f"{name} drift" for name in names))
    times = ("attitude error, rad", "outcome", "µs a step", "time ratio")
    return (*header, *times), [_row(line, each, names) for line in lines for each in line.observations]


def _row(line: Line, seen: Observation, quantities: list[str]) -> Row:
    drifts = [_drift_cell(seen.drifts[name].value if name in seen.drifts else math.nan) for name in quantities]
    fits = (seen.attitude_order, seen.rates_order)
    orders = [DASH if math.isnan(fit.slope) else order_text(fit.slope) for fit in fits]
    ratio, step_time = _ratio(line, seen), min(line.times.get(seen.version, (math.nan,)))
    ratio_text = DASH if ratio is None else number(ratio.value)
    if ratio is not None and ratio.low != ratio.high:
        ratio_text += f" ({number(ratio.low)} to {number(ratio.high)})"
    outcome = outcome_cell(Outcome(seen.outcome.kind))  # the kind alone; the reason is below the tables
    names = (seen.setting or "default", seen.version)
    return (*names, *orders, *drifts, number(seen.error.value), outcome, number(1e6 * step_time), ratio_text)


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
