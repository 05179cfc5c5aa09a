"""Two versions of a project compared: verdict, table, JSON and test cases."""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import StrEnum
from typing import Any

from conservative.benchmarks.comparison.compare import ComparedRow, Comparison, Found
from conservative.benchmarks.comparison.times import CONFIDENCE, SLOWER, Ratio
from conservative.benchmarks.gate.results import ENERGY_DRIFT
from conservative.benchmarks.measures.measure import Measure

from ..document.model import (
    Cell,
    Check,
    Document,
    Facts,
    Grade,
    Interval,
    Items,
    Paragraph,
    Role,
    Row,
    Section,
    Style,
    Table,
    filled,
)
from ..tables.cells import DASH, number

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
"""Measures with a column in the table; all are compared and are in the JSON."""
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


def build(comparison: Comparison, made: Mapping[str, str] | None = None) -> Document:
    """Return the document of a comparison; `made` names how and where it was measured."""
    versions, made = (comparison.base, comparison.head), made or {}
    findings = [each.finding for each in comparison.violations]
    timed = sum(row.time is not None for row in comparison.rows)
    rows, violations = len(comparison.rows), len(findings)
    verdict = (
        f"gate: {'passed' if comparison.passed else 'FAILED'}, {rows} row{'s' * (rows != 1)}, {timed} timed, "
        f"{violations} violation{'s' * (violations != 1)}"
    )
    packages = [(each.title, each.environment.python, ", ".join(each.packages)) for each in versions]
    explained = f"{EXPLANATION} The dashed line is the limit."
    notes = Items.of(f"note: {note}" for note in comparison.notes)
    data = {
        "made": dict(made),
        "passed": comparison.passed,
        "versions": {
            when: {"name": version.name, "commit": version.commit, "packages": version.packages}
            for when, version in zip(("was", "is"), versions, strict=True)
        },
        "violations": comparison.violations,
        "notes": comparison.notes,
        "rows": [_record(row) for row in comparison.rows],
    }
    return Document(
        "conservative gate",
        f"{comparison.head.title} against {comparison.base.title}",
        filled(
            Paragraph(verdict, Role.LEAD),
            Section("What is worse", filled(Items.of(findings))),
            Section("Rows", [Paragraph(explained), table(comparison)]),
            Section("Notes", filled(notes)),
            Section("Versions", [Table(("version", "Python", "packages"), packages, "Packages of both versions")]),
            Section("How this was made", [Facts(list(made.items()))]) if made else None,
        ),
        brief=filled(Paragraph(verdict), Items.of(findings), notes),
        data=data,
        checks=_checks(comparison),
        failures=findings,
    )


def table(comparison: Comparison) -> Table:
    """Return the rows: failed ones first, then those with the largest change of time."""
    worse = {(each.scene, each.method) for each in comparison.violations}
    standings = [(_standing(row, (row.scene, row.method) in worse), row) for row in comparison.rows]

    def rank(entry: tuple[Standing, ComparedRow]) -> tuple[int, float]:
        ratio = _ratio(entry[1])
        return list(Standing).index(entry[0]), -abs(math.log(ratio.value)) if ratio else 0.0

    return Table(HEADER, [_cells(row, standing) for standing, row in sorted(standings, key=rank)], "Rows", Style.FILTERED)


def _checks(comparison: Comparison) -> list[Check]:
    """Return a check for each row, and one for each violation that belongs to no row."""
    found: dict[tuple[str, str], list[str]] = {(row.scene, row.method): [] for row in comparison.rows}
    for each in comparison.violations:
        found.setdefault((each.scene, each.method), []).append(each.finding)
    return [Check(*name, failure="\n".join(texts)) for name, texts in found.items()]


def _cells(row: ComparedRow, standing: Standing) -> Row:
    time, ratio, grade = row.time, _ratio(row), _GRADES.get(standing)
    drawn = None if ratio is None else Interval(ratio.value, ratio.low, ratio.high, 1 + SLOWER)
    slower = Grade.BAD if standing is Standing.SLOWER else None
    return (
        row.scene,
        row.method,
        standing.value if grade is None else Cell(f"{_MARKS.get(grade, '')}{standing}", grade),
        Cell(f"{ratio.value:.3f}", slower, interval=drawn) if ratio else DASH,
        f"{ratio.low:.3f} to {ratio.high:.3f}" if ratio else DASH,
        DASH if time is None else f"{number(1e6 * time.was, 3)} → {number(1e6 * time.now, 3)}",
        *(_pair(row.was, row.now, name) for name in SHOWN),
    )


def _ratio(row: ComparedRow) -> Ratio | None:
    """Return the last measured ratio of the times; None if the row was not timed."""
    ratio = None if row.time is None else row.time.again or row.time.first
    return None if ratio is None or math.isnan(ratio.value) else ratio


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
