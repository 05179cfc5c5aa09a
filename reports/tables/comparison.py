"""Two versions of a project against each other, as a table, JSON, Markdown and JUnit."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any

from conservative.benchmarks.comparison.compare import ComparedRow, Comparison, Found
from conservative.benchmarks.comparison.times import CONFIDENCE, SLOWER, Ratio
from conservative.benchmarks.gate.results import ENERGY_DRIFT
from conservative.benchmarks.measures.measure import Measure

from .cells import DASH, Cell, Grade, Row, Table, markdown, number, plain
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
"""Measures with a column in the table; all are compared, and all are in the JSON."""
EXPLANATION = (
    "Times are relative to the earlier version, from several processes of both, which take turns. Both ends of an interval "
    f"have {CONFIDENCE:.0%} confidence. A row fails if its whole interval is more than {SLOWER:.0%} slower, again so in new "
    "processes, or if another value is worse than round-off explains."
)


class Standing(StrEnum):
    """The result of a row, in the order of the table."""

    SLOWER = "slower"
    WORSE = "worse"
    FASTER = "faster"
    NEW = "new"
    SAME = "same"
    NOTHING = "not compared"


_GRADES = {Standing.SLOWER: Grade.BAD, Standing.WORSE: Grade.BAD, Standing.FASTER: Grade.GOOD, Standing.NOTHING: Grade.NONE}
_MARKS = {Grade.BAD: "✗ ", Grade.GOOD: "✓ "}


@dataclass(frozen=True)
class Line:
    """The cells of a row, its standing, and its ratio; None if it was not timed."""

    cells: Row
    standing: Standing
    ratio: Ratio | None


@dataclass(frozen=True)
class Answer:
    """A comparison, and how and where it was measured."""

    comparison: Comparison
    made: Mapping[str, str] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether nothing is worse."""
        return self.comparison.passed

    @property
    def title(self) -> str:
        """Both versions."""
        return f"{self.comparison.head.title} against {self.comparison.base.title}"

    @property
    def verdict(self) -> str:
        """The verdict in one line."""
        found = self.comparison
        timed = sum(row.time is not None for row in found.rows)
        counts = f"{_count(found.rows, 'row')}, {timed} timed, {_count(found.violations, 'violation')}"
        return f"gate: {'passed' if self.passed else 'FAILED'}, {counts}"

    @property
    def findings(self) -> tuple[str, ...]:
        """Each violation in one line."""
        return tuple(each.finding for each in self.comparison.violations)

    @property
    def lines(self) -> tuple[Line, ...]:
        """The rows: failed ones first, then those with the largest change of time."""
        worse = {(each.scene, each.method) for each in self.comparison.violations}
        lines = [_line(row, (row.scene, row.method) in worse) for row in self.comparison.rows]

        def change(ratio: Ratio | None) -> float:
            return 0.0 if ratio is None or math.isnan(ratio.value) else abs(math.log(ratio.value))

        return tuple(sorted(lines, key=lambda line: (list(Standing).index(line.standing), -change(line.ratio))))

    @property
    def table(self) -> Table:
        """The rows as a table."""
        return HEADER, [line.cells for line in self.lines]

    @property
    def environments(self) -> Table:
        """Python and packages of both versions."""
        versions = (self.comparison.base, self.comparison.head)
        rows = [(each.title, each.environment.python, ", ".join(each.packages)) for each in versions]
        return ("version", "Python", "packages"), rows

    def __str__(self) -> str:
        notes = [f"note: {note}" for note in self.comparison.notes]
        return "\n".join([self.verdict, *self.findings, *notes])

    def json_text(self) -> str:
        """Return all measurements as JSON; null stands for a value that could not be measured."""
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
            "rows": [plain(_record(row)) for row in found.rows],
        }
        return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)

    def markdown_text(self) -> str:
        """Return verdict, violations and the table as Markdown, for the summary of a workflow."""
        violations = ["", *(f"- {text}" for text in self.findings)] if self.findings else []
        notes = ["", *(f"- {note}" for note in self.comparison.notes)] if self.comparison.notes else []
        head = [f"## {self.title}", "", f"**{self.verdict}**", *violations, "", markdown(self.table), "", EXPLANATION, *notes]
        made = ["", *(f"- {name}: {value}" for name, value in self.made.items())] if self.made else []
        return "\n".join([*head, "", "### Versions", "", markdown(self.environments), *made]) + "\n"

    def junit_text(self) -> str:
        """Return a case for each row in the format of JUnit, and one for each violation that belongs to no row."""
        own: dict[tuple[str, str], list[str]] = {(row.scene, row.method): [] for row in self.comparison.rows}
        for each in self.comparison.violations:
            own.setdefault((each.scene, each.method), []).append(each.finding)
        return junit_xml("conservative gate", [TestCase(*name, failure="\n".join(texts)) for name, texts in own.items()])


def _line(row: ComparedRow, failed: bool) -> Line:
    time = row.time
    ratio = None if time is None else time.again or time.first
    standing = _standing(row, failed)
    grade = _GRADES.get(standing)
    timed = ratio is not None and not math.isnan(ratio.value)
    cells = (
        row.scene,
        row.method,
        standing.value if grade is None else Cell(f"{_MARKS.get(grade, '')}{standing}", grade),
        f"{ratio.value:.3f}" if ratio and timed else DASH,
        f"{ratio.low:.3f} to {ratio.high:.3f}" if ratio and timed else DASH,
        DASH if time is None else f"{number(1e6 * time.was, 3)} → {number(1e6 * time.now, 3)}",
        *(_pair(row.was, row.now, name) for name in SHOWN),
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


def _pair(was: Found | None, now: Found | None, name: str) -> str:
    before, after = (number(found.row.values.get(name, math.nan), 3) if found else DASH for found in (was, now))
    return before if before == after else f"{before} → {after}"


def _record(row: ComparedRow) -> dict[str, Any]:
    record: dict[str, Any] = {"scene": row.scene, "method": row.method, "was": None, "is": None, "time": None}
    for when, found in (("was", row.was), ("is", row.now)):
        if found is not None:
            values = {"values": found.row.values, "spreads": found.row.spreads}
            record[when] = {"status": found.row.status, "reason": found.reason, **values}
    if (time := row.time) is not None:
        again = {} if time.again is None else {"again": time.again}
        ratios = {"was_s": time.was, "is_s": time.now, "first": time.first, **again}
        record["time"] = {**ratios, "reason": time.reason, "failed": time.failed}
    return record


def _count(found: Sequence[object], what: str) -> str:
    return f"{len(found)} {what}" + "s" * (len(found) != 1)
