"""Two back ends of one product: the motions of each and against each other, and the sweep of settings."""

from __future__ import annotations

from conservative.benchmarks.verification.finding import Finding, Verdict, Verification
from conservative.benchmarks.verification.sweep import Series, Sweep, sentences
from conservative.benchmarks.verification.two_back_ends import Parity

from ..document.cells import DASH, bound, numeric, size
from ..document.model import Block, Cell, Grade, Items, Paragraph, Row, Section, Table, filled

GRADES = {Verdict.RIGHT: Grade.GOOD, Verdict.WRONG: Grade.BAD, Verdict.UNDECIDED: Grade.FAIR, Verdict.NOT_TESTED: Grade.NONE}
TERMS = (
    "Errors are of attitudes, rad, or of rates, relative to the largest rate: of the two, the larger one beside its tolerance. "
    "Both back ends have the same motion if the difference is at most the sum of their tolerances."
)


def back_end_blocks(verification: Verification) -> list[Block]:
    """Return the table of motions, the sweep of settings and notes, which follow the sentence of the verdict."""
    details = verification.details
    assert isinstance(details, Parity)
    first, second = details.first.subject, details.second.subject
    ran = [row for row in details.table if any(_was_tested(finding) for finding in (row.first, row.second))]
    rows: list[Row] = [
        [
            row.motion,
            *(_cell(finding) for finding in (row.first, row.second, row.between)),
            "; ".join(_mistakes(finding) for finding in (row.first, row.second) if finding and finding.causes) or DASH,
        ]
        for row in ran
    ]
    left_out = [row.motion for row in details.table if row not in ran]
    notes = [*verification.notes, *([f"Not supported by either: {', '.join(left_out)}"] if left_out else [])]
    header = ["motion", first, second, "first against second", "mistakes"]
    return filled(
        *(_sweep_blocks(details.sweep, first, second) if details.sweep else []),
        Table(header, rows, "Motions"),
        Items.of([f"{note}." for note in notes]),
        Paragraph(TERMS),
    )


def _was_tested(finding: Finding | None) -> bool:
    return finding is not None and finding.verdict is not Verdict.NOT_TESTED


def _cell(finding: Finding | None) -> Cell:
    if finding is None or not _was_tested(finding):
        return Cell(DASH, Grade.NONE)
    grade = GRADES[finding.verdict]
    text = finding.detail if finding.error == float("inf") else f"{bound(finding.error)} {finding.unit}"
    return Cell(grade.mark(text), grade, value=finding.error)


def _mistakes(finding: Finding) -> str:
    return f"{finding.subject}: {' or '.join(cause.key for cause in finding.causes)}"


def _sweep_blocks(sweep: Sweep, first: str, second: str) -> list[Block]:
    tables = [_table(series, sweep, first, second) for series in sweep.series]
    own, rest = (texts := sentences(first, second, sweep))[:2], texts[2:]  # the first two begin with names
    said = [f"{text}." for text in (*own, *(text[:1].upper() + text[1:] for text in rest))]
    return [Section(f"Settings: {sweep.motion}", filled(Items.of(said), *tables))]


def _table(series: Series, sweep: Sweep, first: str, second: str) -> Table:
    name = "step, s" if series.setting == "step" else f"{series.setting} of {series.of}"
    rows: list[Row] = [
        [numeric(value, digits=3) if isinstance(value, float) else str(value), size(a), size(b), size(between)]
        for value, a, b, between in zip(series.values, series.first, series.second, series.between, strict=True)
    ]
    unit = sweep.unit
    return Table([name, f"error of {first}, {unit}", f"error of {second}, {unit}", f"first against second, {unit}"], rows)
