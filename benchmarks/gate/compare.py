"""The gate: results against the baseline, row by row. Missing rows, NaN and rows of another definition do not pass."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from conservative.outcome import OK

from ..measures.change import Change, RowName, direction, exact
from .baseline import ORDER, Allowed, Baseline, BaselineRow, NothingToCompare
from .results import ENERGY_DRIFT, RUNAWAY, Results, Row, find_runaway

ACCEPT = 'accept with: conservative gate --update "REASON"'
MISSING = "missing"


@dataclass(frozen=True)
class Decision:
    """The decision of the gate: violations (changes that are not allowed), notes, and the number of compared rows."""

    violations: tuple[Change, ...]
    notes: tuple[str, ...]
    rows: int

    @property
    def passed(self) -> bool:
        """True if there is no violation."""
        return not self.violations

    @property
    def record(self) -> dict[str, Any]:
        """The verdict for JSON."""
        violations = [change.texts for change in self.violations]
        return {"passed": self.passed, "violations": violations, "notes": self.notes, "rows": self.rows}

    def __str__(self) -> str:
        head = f"gate: {'passed' if self.passed else 'FAILED'}, {self.rows} rows, {len(self.violations)} violations"
        violations = (f"{change.finding}; {ACCEPT}" for change in self.violations)
        return "\n".join([head, *violations, *(f"note: {note}" for note in self.notes)])

    def markdown_text(self) -> str:
        """Return the violations as a table and the notes as a list, for the summary of a workflow."""
        lines = [f"## Gate: {'passed' if self.passed else 'FAILED'}", ""]
        lines += [f"{self.rows} rows, {len(self.violations)} violations.", ""]
        if self.violations:
            lines += ["| measure | scene | method | was | is | allowed |", "| --- | --- | --- | --- | --- | --- |"]
            lines += [f"| {' | '.join(change.texts.values())} |" for change in self.violations]
        notes = [f"- {note}" for note in self.notes]
        return "\n".join([*lines, "", *notes]) + "\n"


def decide(baseline: Baseline, results: Results) -> Decision:
    """Return the decision on results. An empty baseline is a violation, because everything would pass.

    Rows that the run left out are not compared. Raise `NothingToCompare` if these are all.
    """
    left_out = baseline.rows.keys() & {*results.left_out} - results.rows.keys()
    if left_out and len(left_out) == len(baseline.rows):
        got = f"none of the {len(left_out)} rows of the baseline, which were not selected"
        raise NothingToCompare("results", got, "a selection with one of them")
    baseline = replace(baseline, rows={id: row for id, row in baseline.rows.items() if id not in left_out})
    violations = [] if baseline.rows else [Change(RowName("all", "all", "rows"), "none", "none", "one or more")]
    notes = [f"unbaselined: {id}" for id, row in results.rows.items() if id not in baseline.rows and row.outcome.ok]
    for id, was in baseline.rows.items():
        violations += _row_violations(id, was, results)
    for id, row in results.rows.items():  # energy that ran away in a run without an error is a violation with any baseline
        if row.outcome.ok and find_runaway(row.values):
            before = baseline.rows[id].measures.get(ENERGY_DRIFT) if id in baseline.rows else None
            name = RowName(row.scene or id, row.method or id, ENERGY_DRIFT)
            value = before.value if before else MISSING
            violations.append(Change(name, value, row.values.get(ENERGY_DRIFT, MISSING), f"at most {RUNAWAY:g}"))
    notes += _improvements(baseline, results)
    notes += [f"not compared: {len(left_out)} rows of the baseline, which were not selected"] * bool(left_out)
    return Decision(tuple(violations), tuple(notes), len(baseline.rows))


def _row_violations(id: str, was: BaselineRow, results: Results) -> Iterator[Change]:
    """Yield the violations of one row; measures only if both definitions are the same."""

    def violation(measure: str, before: object, now: object, allowed: str) -> Change:
        return Change(RowName(was.scene or id, was.method or id, measure), before, now, allowed)

    row = results.rows.get(id)
    if row is None:
        renamed = (
            f"renamed {other.id}"
            for other in results.rows.values()
            if other.definition and (other.definition, other.scene, other.method) == (was.definition, was.scene, was.method)
        )
        yield violation("row", OK, next(renamed, MISSING), str(OK))
    elif not row.outcome.ok:
        yield violation("row", OK, row.outcome, str(OK))
    elif row.definition != was.definition:
        yield violation("definition", was.definition, row.definition, was.definition)
    elif row.engine != was.engine:
        yield violation("engine version", was.engine, row.engine, was.engine)
    else:
        for name, allowed in was.measures.items():
            value = row.values.get(name, math.nan)
            if not (math.isfinite(value) and math.isfinite(allowed.limit)) or worsening(name, allowed, value) > 0:
                side = "at least" if name == ORDER else "at most"
                limit = (
                    f"{side} {allowed.limit:.6g} (spread {allowed.spread:.2g} in {allowed.runs} run{'s' * (allowed.runs != 1)})"
                )
                yield violation(name, allowed.value, row.values.get(name, MISSING), limit)


def worsening(measure: str, allowed: Allowed, value: float) -> int:
    """Return 1 if a value is worse than allowed, -1 if it improved by as much, otherwise 0."""
    grown = direction(allowed.range, exact(value))
    return -grown if measure == ORDER else grown


def _improvements(baseline: Baseline, results: Results) -> Iterator[str]:
    """Yield values that improved by more than they may get worse. Such a change should be understood and accepted."""
    for id, was in baseline.rows.items():
        row: Row | None = results.rows.get(id)
        if row is None or row.definition != was.definition:
            continue
        for name, allowed in was.measures.items():
            if worsening(name, allowed, row.values.get(name, math.nan)) < 0:
                yield f"better: {name}, {was.scene}, {was.method}: was {allowed.value:.6g}, is {row.values[name]:.6g}"
