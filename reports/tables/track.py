"""An engine over its versions, as tables and sentences, JSON, Markdown and JUnit."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from conservative.benchmarks.measures.drift_class import DriftClass, classify
from conservative.benchmarks.tracking.observation import Fit, Observation, Spread
from conservative.benchmarks.tracking.track import History, Line, Transition
from conservative.outcome import Outcome, OutcomeKind

from .cells import DASH, Cell, Grade, Row, Table, finite_or_none, markdown, number, outcome_cell, outcome_record
from .changes import drift_text, order_text, sentence
from .junit import TestCase, junit_xml

NOTHING_CHANGED = "No conclusion changed."
UNFINISHED = "What did not reach its end, or shows no order"
NO_END = "no setting reaches the end of a run"
_GRADES = {DriftClass.CONSERVED: ("✓", Grade.GOOD), DriftClass.SMALL: ("≈", Grade.FAIR), DriftClass.LARGE: ("✗", Grade.BAD)}


@dataclass(frozen=True)
class Answer:
    """What a history says.

    Attributes
    ----------
    history
        What was found.
    gated
        Whether something that the last version lost is a failure.
    made
        How and where it was measured: command, date, machine, by what they are called.
    """

    history: History
    gated: bool = False
    made: Mapping[str, str] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether the last version, where it is gated, lost nothing and reaches an end at all."""
        return not list(self.failures)

    @property
    def failures(self) -> Iterator[str]:
        """Why it is not passed; nothing where it is not gated."""
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
        """What it is about."""
        return f"{self.history.plan.engine}: {', '.join(self.history.plan.versions)}"

    @property
    def verdict(self) -> str:
        """Whether it is passed, in a line; empty where it is not gated."""
        if not self.gated:
            return ""
        was, now = self.history.plan.versions[-2:]
        return f"{now} against {was}: {'passed' if self.passed else 'FAILED'}"

    @property
    def tables(self) -> tuple[tuple[str, Table], ...]:
        """For each scene its caption and table: a row for each setting and version."""
        return tuple((_caption(scene, lines), _table(lines)) for scene, lines in _by_scene(self.history).items())

    @property
    def unfinished(self) -> tuple[str, ...]:
        """The runs that did not reach their end or show no order: setting, scene, versions, and why that of the last one."""
        return tuple(text for line in self.history.lines for text in _unfinished(line))

    @property
    def environments(self) -> Table:
        """What each version ran with."""
        rows = [(each.version, each.python, ", ".join(each.packages)) for each in self.history.plan.environments]
        return ("version", "Python", "packages"), rows

    def json_text(self) -> str:
        """Return all that was measured, and what changed, as JSON; what could not be measured is null."""
        plan = self.history.plan
        content = {
            "made": dict(self.made),
            "engine": plan.engine,
            "passed": self.passed,
            "failures": list(self.failures),
            "versions": [
                {"version": each.version, "python": each.python, "packages": each.packages} for each in plan.environments
            ],
            "rows": [_record(line, each) for line in self.history.lines for each in line.observations],
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
        """Return a case for each setting on each scene and two versions that follow each other, as JUnit has them."""
        cases = [self._case(each) for each in self.history.transitions]
        last = self.history.plan.versions[-1]
        if not self.passed and not self.history.lost_last:
            cases.append(TestCase("all", last, failure="\n".join(self.failures)))
        return junit_xml(f"conservative track {self.history.plan.engine}", cases)

    def _case(self, transition: Transition) -> TestCase:
        was, now, text = transition.was, transition.now, sentence(transition)
        failed = self.gated and transition in self.history.lost_last
        name = f"{now.setting or 'default'}: {was.version} to {now.version}"
        return TestCase(now.scene, name, text or NOTHING_CHANGED, text if failed else "")


def _by_scene(history: History) -> dict[str, list[Line]]:
    found: dict[str, list[Line]] = {}
    for line in history.lines:
        found.setdefault(line.scene, []).append(line)
    return found


def _caption(scene: str, lines: list[Line]) -> str:
    return f"{scene}, dt = {lines[0].observations[0].dt:g} s"


def _unfinished(line: Line) -> Iterator[str]:
    reasons = [(each.version, *_reason(each)) for each in line.observations]
    for kind in dict.fromkeys(kind for _, kind, _ in reasons if kind):
        found = [(version, reason) for version, this, reason in reasons if this == kind]
        versions = ", ".join(version for version, _ in found)
        yield f"{line.setting or 'default'} on {line.scene} in {versions}: {found[-1][1]}"


def _reason(seen: Observation) -> tuple[str, str]:
    """Return what is lacking, as the kind that versions have in common, and in full; both empty where nothing is."""
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
    orders = (_order_cell(seen.attitude_order), _order_cell(seen.rates_order))
    times = (number(1e6 * _step_time(line, seen)), _ratio_cell(line, seen))
    return (
        seen.setting or "default",
        seen.version,
        *orders,
        *drifts,
        number(seen.error.value),
        _outcome_cell(seen.outcome),
        *times,
    )


def _order_cell(fit: Fit) -> str:
    return DASH if math.isnan(fit.slope) else order_text(fit.slope)


def _drift_cell(drift: float) -> Cell:
    grade = classify(drift)
    if grade is None:
        return Cell(DASH, Grade.NONE)
    symbol, colour = _GRADES[grade]
    return Cell(f"{symbol} {drift_text(drift)}", colour)


def _outcome_cell(outcome: Outcome) -> Cell:
    """Return the kind alone: how and why is said below the tables."""
    return outcome_cell(Outcome(outcome.kind))


def _step_time(line: Line, seen: Observation) -> float:
    """Return the shortest time of a step, s."""
    return min(line.times.get(seen.version, (math.nan,)))


def _ratio(line: Line, seen: Observation) -> Spread | None:
    """Return the time beside that of the first version that has one, without a unit."""
    first = next((each.version for each in line.observations if each.version in line.times), "")
    return line.time_ratio(seen.version, first)


def _ratio_cell(line: Line, seen: Observation) -> str:
    ratio = _ratio(line, seen)
    if ratio is None:
        return DASH
    return (
        number(ratio.value)
        if ratio.low == ratio.high
        else f"{number(ratio.value)} ({number(ratio.low)} to {number(ratio.high)})"
    )


def _record(line: Line, seen: Observation) -> dict[str, Any]:
    ratio = _ratio(line, seen)
    return {
        **{name: getattr(seen, name) for name in ("scene", "setting", "version", "label", "dt")},
        "outcome": outcome_record(seen.outcome),
        "attitude_order": _fields(seen.attitude_order),
        "rates_order": _fields(seen.rates_order),
        "attitude_error_rad": _fields(seen.error),
        "drifts": {name: _fields(drift) for name, drift in seen.drifts.items()},
        "step_times_s": [finite_or_none(time) for time in line.times.get(seen.version, ())],
        "time_ratio": None if ratio is None else _fields(ratio),
    }


def _change_record(transition: Transition) -> dict[str, Any]:
    was, now = transition.was, transition.now
    names = {"scene": now.scene, "setting": now.setting, "from": was.version, "to": now.version}
    aspects = [{"aspect": each.aspect.value, "quantity": each.quantity, "lost": each.lost} for each in transition.changes]
    return {**names, "sentence": sentence(transition), "lost": bool(transition.lost), "changes": aspects}


def _fields(value: Fit | Spread) -> dict[str, Any]:
    return {name: finite_or_none(each) if isinstance(each, float) else each for name, each in asdict(value).items()}
