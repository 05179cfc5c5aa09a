"""Comparison of two versions of a project: verdict, table, JSON and test cases."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from conservative.benchmarks.gate.compare import Decision
from conservative.benchmarks.gate.results import ENERGY_DRIFT
from conservative.benchmarks.measures.change import Change
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.versions.prices import Price
from conservative.benchmarks.versions.project import ProjectComparison, ProjectLine, Standing, decide, standing_of
from conservative.benchmarks.versions.sentence import sentences
from conservative.benchmarks.versions.times import CONFIDENCE, SLOWER, Ratio

from ..document.cells import DASH, number, numeric
from ..document.model import (
    Block,
    Cell,
    Check,
    Document,
    Emphasis,
    Facts,
    Grade,
    Interval,
    Items,
    Paragraph,
    Row,
    Section,
    Style,
    Table,
    filled,
)

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
    f"have {CONFIDENCE:.0%} confidence. A row fails if its whole interval is more than {SLOWER:.0%} slower, in a second "
    "measurement too, or if another value is worse than round-off explains."
)


_FACTS = {"commit": "commit of conservative-rotation"}
"""Names of facts about this process that readers would take for facts about the project."""
_GRADES = {
    **dict.fromkeys((Standing.MOTION, Standing.SLOWER, Standing.WORSE), Grade.BAD),
    **{Standing.PAID: Grade.FAIR, Standing.BETTER: Grade.GOOD, Standing.FASTER: Grade.GOOD, Standing.NOTHING: Grade.NONE},
}


def build(
    comparison: ProjectComparison, made: Mapping[str, str] | None = None, prices: Mapping[str, Price] | None = None
) -> Document:
    """Return the document of a comparison; `made` names how and where it was measured, `prices` longer times by method."""
    versions, decided, made = comparison.versions, decide(comparison, prices or {}), made or {}
    findings = [change.finding for change in decided.violations]
    timed = sum(line.times is not None for line in comparison.lines)
    rows, violations = _count(len(comparison.lines), "row"), _count(len(findings), "violation")
    verdict = f"gate: {'passed' if decided.passed else 'FAILED'}, {rows}, {timed} timed, {violations}"
    # A check for each row, and one for each violation that belongs to no row.
    failed: dict[tuple[str, str], list[str]] = {(line.scene, line.setting): [] for line in comparison.lines}
    for change in decided.violations:
        failed.setdefault((change.row.scene, change.row.method), []).append(change.finding)
    packages = [(version.title, version.environment.runtime, ", ".join(version.packages)) for version in versions]
    explained = f"{EXPLANATION} The dashed line is the limit."
    notes, said = Items.of(f"note: {note}" for note in decided.notes), sentences(comparison, decided)
    details: list[Block] = filled(
        Section("Notes", filled(notes)),
        Section("Versions", [Table(("version", "runtime", "packages"), packages, "Packages of both versions")], folded=True),
        Section("How this was made", [Facts([(_FACTS.get(name, name), fact) for name, fact in made.items()])], folded=True)
        if made
        else None,
    )
    data = {
        "made": dict(made),
        "passed": decided.passed,
        "sentences": said,
        "versions": {
            when: {"name": version.name, "commit": version.commit, "title": version.headline, "packages": version.packages}
            for when, version in zip(("was", "is"), versions, strict=True)
        },
        "violations": [change.texts for change in decided.violations],
        "notes": decided.notes,
        "rows": [_record(line) for line in comparison.lines],
    }
    return Document(
        "conservative gate",
        f"{versions[1].headline} against {versions[0].headline}",
        filled(
            *map(Paragraph, said),
            Paragraph(verdict, Emphasis.LEAD),
            Section("Violations", filled(Items.of(findings))),
            Section("Rows", [Paragraph(explained), table(comparison, decided.violations)]),
            *details,
        ),
        brief=filled(*map(Paragraph, said), Paragraph(verdict), Items.of(findings), notes),
        comment=_comment(comparison, decided, said, details),
        data=data,
        checks=[Check(*name, failure="\n".join(texts)) for name, texts in failed.items()],
        failures=findings,
    )


def _comment(comparison: ProjectComparison, decided: Decision, said: Sequence[str], details: Sequence[Block]) -> list[Block]:
    """Return the comment of a pull request: what changed, then everything else folded; one line if nothing changed."""
    base, head = (_code(version.headline) for version in comparison.versions)
    lines = comparison.lines
    standings = {(line.scene, line.setting): standing_of(line, decided.violations) for line in lines}
    news = [line for line in lines if standings[line.scene, line.setting] not in (Standing.SAME, Standing.NOTHING)]
    rest = [line for line in lines if standings[line.scene, line.setting] in (Standing.SAME, Standing.NOTHING)]
    of_no_row = [change.finding for change in decided.violations if (change.row.scene, change.row.method) not in standings]
    verdict = "passed" if decided.passed else "FAILED"
    if not news and not of_no_row:
        text = f"gate: {verdict}, nothing changed in {_count(len(lines), 'row')}: {head} against {base}"
        return [Paragraph(text, Emphasis.LEAD)]
    changes = f"{len(news)} of {_count(len(lines), 'row')} changed, {_count(len(decided.violations), 'violation')}"
    everything = filled(
        Section("Violations", filled(Items.of(change.finding for change in decided.violations))),
        Section("Unchanged rows", filled(_table(rest, decided.violations, ""))),
        Section("Meaning of the columns", [Paragraph(EXPLANATION)]),
        *details,
    )
    return filled(
        *map(Paragraph, said),
        Paragraph(f"gate: {verdict}, {changes}: {head} against {base}", Emphasis.LEAD),
        Items.of(of_no_row),
        _table(news, decided.violations, ""),
        Section("Everything else", everything, folded=True),
    )


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"


def _code(text: str) -> str:
    """Return a text as code: the subject of a commit may contain mentions and tags."""
    return f"`{text.replace('`', '')}`"


def table(comparison: ProjectComparison, violations: Sequence[Change]) -> Table:
    """Return the rows: failed ones first, then by the change of time, largest first."""
    return _table(comparison.lines, violations, "Rows")


def _table(lines: Sequence[ProjectLine], violations: Sequence[Change], caption: str) -> Table:
    standings = [(standing_of(line, violations), line) for line in lines]

    def rank(entry: tuple[Standing, ProjectLine]) -> tuple[int, float]:
        ratio = _ratio(entry[1])
        return list(Standing).index(entry[0]), -abs(math.log(ratio.value)) if ratio else 0.0

    return Table(HEADER, [_row(line, standing) for standing, line in sorted(standings, key=rank)], caption, Style.FILTERED)


def _row(line: ProjectLine, standing: Standing) -> Row:
    (was, now), time, ratio, graded = line.results, line.times, _ratio(line), _GRADES.get(standing)
    text = graded.mark(standing) if graded in (Grade.GOOD, Grade.BAD) else standing
    cells: list[str | Cell] = [line.scene, line.setting, Cell(text, graded)]
    if ratio is None:
        cells += [DASH, DASH]
    else:
        drawn = Interval(ratio.value, ratio.low, ratio.high, 1 + SLOWER)
        slower = Grade.BAD if standing is Standing.SLOWER else None
        cells.append(Cell(f"{ratio.value:.3f}", slower, value=ratio.value, interval=drawn))
        cells.append(numeric(ratio.low, f"{ratio.low:.3f} to {ratio.high:.3f}"))
    times = (math.nan, math.nan) if time is None else (1e6 * time.was, 1e6 * time.now)
    values = [[row.values.get(name, math.nan) if row else math.nan for row in (was, now)] for name in SHOWN]
    for before, after in (times, *values):
        texts = [number(value, 3) for value in (before, after)]
        cells.append(numeric(after, " → ".join(dict.fromkeys(texts))))  # equal ones once
    return cells


def _ratio(line: ProjectLine) -> Ratio | None:
    """Return the last measured ratio of the times; None if the row was not timed."""
    ratio = None if line.times is None else line.times.again or line.times.first
    return None if ratio is None or math.isnan(ratio.value) else ratio


def _record(line: ProjectLine) -> dict[str, Any]:
    record: dict[str, Any] = {"scene": line.scene, "method": line.setting, "was": None, "is": None, "time": None}
    for when, row in zip(("was", "is"), line.results, strict=True):
        if row is not None:
            values = {"values": row.values, "spreads": row.spreads}
            record[when] = {"outcome": row.outcome, "mistake": row.mistake, "cause": row.cause, **values}
    if (time := line.times) is not None:
        again = {} if time.again is None else {"again": time.again}
        ratios = {"was_s": time.was, "is_s": time.now, "first": time.first, **again}
        record["time"] = {**ratios, "reason": time.reason, "failed": time.failed}
    return record
