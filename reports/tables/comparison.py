"""Two versions of a project against each other, as a table, JSON, Markdown and JUnit."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any

from conservative.benchmarks.comparison.compare import ComparedRow, Comparison, Found
from conservative.benchmarks.comparison.times import CONFIDENCE, SLOWER, Ratio, TimeRow
from conservative.benchmarks.gate.results import ENERGY_DRIFT
from conservative.benchmarks.measures.measure import Measure

from .cells import DASH, Cell, Grade, Row, Table, finite_or_none, markdown, number
from .junit import TestCase, junit_xml

HEADER = (
    "scene",
    "method",
    "is",
    "time",
    f"interval, {CONFIDENCE:.0%}",
    "µs a step",
    "attitude error, rad",
    "energy drift",
    "order",
)
SHOWN = (Measure.ATTITUDE_MAX.text, ENERGY_DRIFT, Measure.ORDER.text)
"""Measures that the table has a column of; all are compared, and stand in the JSON."""
EXPLANATION = (
    "Times are in times of the earlier version, each from several processes of both, which take turns; an interval holds at "
    f"each end with {CONFIDENCE:.0%} confidence. A row fails if all of it is more than {SLOWER:.0%} slower, and is so again in "
    "new processes, or if another value is worse than round-off explains."
)


class Standing(StrEnum):
    """What became of a row."""

    SLOWER = "slower"
    WORSE = "worse"
    FASTER = "faster"
    NEW = "new"
    SAME = "same"
    NOTHING = "not compared"


_GRADES = {Standing.SLOWER: Grade.BAD, Standing.WORSE: Grade.BAD, Standing.FASTER: Grade.GOOD, Standing.NOTHING: Grade.NONE}


@dataclass(frozen=True)
class Line:
    """A row as it is shown, its standing, and its ratio; None where it was not timed."""

    cells: Row
    standing: Standing
    ratio: Ratio | None


@dataclass(frozen=True)
class Answer:
    """What a comparison says; `made` says how and where it was measured."""

    comparison: Comparison
    made: Mapping[str, str] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether nothing is worse."""
        return self.comparison.passed

    @property
    def title(self) -> str:
        """What it is about."""
        return f"{self.comparison.head.title} against {self.comparison.base.title}"

    @property
    def verdict(self) -> str:
        """How it ended, in a line."""
        found = self.comparison
        timed = sum(row.time is not None for row in found.rows)
        return (
            f"gate: {'passed' if self.passed else 'FAILED'}, {_count(found.rows, 'row')}, {timed} timed, "
            f"{_count(found.violations, 'violation')}"
        )

    @property
    def findings(self) -> tuple[str, ...]:
        """Each violation, in a line."""
        return tuple(each.finding for each in self.comparison.violations)

    @property
    def lines(self) -> tuple[Line, ...]:
        """The rows: those that failed first, then those whose time changed most."""
        worse = {(each.scene, each.method) for each in self.comparison.violations}
        lines = [_line(row, (row.scene, row.method) in worse) for row in self.comparison.rows]
        return tuple(sorted(lines, key=lambda line: (list(Standing).index(line.standing), -_change(line.ratio))))

    @property
    def table(self) -> Table:
        """The rows as a table."""
        return HEADER, [line.cells for line in self.lines]

    @property
    def environments(self) -> Table:
        """What both versions ran with."""
        versions = (self.comparison.base, self.comparison.head)
        rows = [(each.title, each.environment.python, ", ".join(each.packages)) for each in versions]
        return ("version", "Python", "packages"), rows

    def __str__(self) -> str:
        notes = [f"note: {note}" for note in self.comparison.notes]
        return "\n".join([self.verdict, *self.findings, *notes])

    def json_text(self) -> str:
        """Return all that was measured as JSON; what could not be measured is null."""
        found = self.comparison
        content = {
            "made": dict(self.made),
            "passed": self.passed,
            "versions": {
                when: {"name": version.name, "commit": version.commit, "packages": version.packages}
                for when, version in (("was", found.base), ("is", found.head))
            },
            "violations": [asdict(each) for each in found.violations],
            "notes": found.notes,
            "rows": [_record(row) for row in found.rows],
        }
        return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)

    def markdown_text(self) -> str:
        """Return verdict, violations and the table as Markdown, as the summary of a workflow's run shows it."""
        violations = ["", *(f"- {text}" for text in self.findings)] if self.findings else []
        notes = ["", *(f"- {note}" for note in self.comparison.notes)] if self.comparison.notes else []
        head = [f"## {self.title}", "", f"**{self.verdict}**", *violations, "", markdown(self.table), "", EXPLANATION, *notes]
        made = ["", *(f"- {name}: {value}" for name, value in self.made.items())] if self.made else []
        return "\n".join([*head, "", "### Versions", "", markdown(self.environments), *made]) + "\n"

    def junit_text(self) -> str:
        """Return a case for each row as JUnit has them, and one for what is no row's."""
        own: dict[tuple[str, str], list[str]] = {(row.scene, row.method): [] for row in self.comparison.rows}
        for each in self.comparison.violations:
            own.setdefault((each.scene, each.method), []).append(each.finding)
        return junit_xml("conservative gate", [TestCase(*name, failure="\n".join(texts)) for name, texts in own.items()])


def _line(row: ComparedRow, failed: bool) -> Line:
    ratio = None if row.time is None else row.time.again or row.time.first
    standing = _standing(row, failed)
    mark = {Grade.BAD: "✗ ", Grade.GOOD: "✓ "}.get(_GRADES.get(standing, Grade.NONE), "")
    values = [_pair(row.was, row.now, name) for name in SHOWN]
    cells = (
        row.scene,
        row.method,
        Cell(f"{mark}{standing}", _GRADES[standing]) if standing in _GRADES else standing.value,
        *_ratio_cells(ratio),
        _step_cell(row.time),
        *values,
    )
    return Line(cells, standing, ratio)


def _standing(row: ComparedRow, failed: bool) -> Standing:
    if failed:
        return Standing.SLOWER if row.time and row.time.failed else Standing.WORSE
    if row.was is None:
        return Standing.NEW
    if row.time is None:
        return Standing.NOTHING
    return Standing.FASTER if row.time.first.high < 1 / (1 + SLOWER) else Standing.SAME


def _ratio_cells(ratio: Ratio | None) -> tuple[str, str]:
    if ratio is None or math.isnan(ratio.value):
        return DASH, DASH
    return f"{ratio.value:.3f}", f"{ratio.low:.3f} to {ratio.high:.3f}"


def _step_cell(time: TimeRow | None) -> str:
    return DASH if time is None else f"{number(1e6 * time.was, 3)} → {number(1e6 * time.now, 3)}"


def _pair(was: Found | None, now: Found | None, name: str) -> str:
    before, after = (number(found.row.values.get(name, math.nan), 3) if found else DASH for found in (was, now))
    return before if before == after else f"{before} → {after}"


def _change(ratio: Ratio | None) -> float:
    return 0.0 if ratio is None or math.isnan(ratio.value) else abs(math.log(ratio.value))


def _record(row: ComparedRow) -> dict[str, Any]:
    return {
        "scene": row.scene,
        "method": row.method,
        "was": _found(row.was),
        "is": _found(row.now),
        "time": None if row.time is None else _time(row.time),
    }


def _found(found: Found | None) -> dict[str, Any] | None:
    if found is None:
        return None
    row = found.row
    return {"status": row.status.value, "reason": found.reason, "values": dict(row.values), "spreads": dict(row.spreads)}


def _time(time: TimeRow) -> dict[str, Any]:
    ratios = {name: _plain(each) for name, each in (("first", time.first), ("again", time.again)) if each is not None}
    return {**_finite({"was_s": time.was, "is_s": time.now}), **ratios, "reason": time.reason, "failed": time.failed}


def _plain(ratio: Ratio) -> dict[str, Any]:
    return _finite(vars(ratio))


def _finite(values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: finite_or_none(value) if isinstance(value, float) else value for name, value in values.items()}


def _count(found: Sequence[object], what: str) -> str:
    return f"{len(found)} {what}" + "s" * (len(found) != 1)
