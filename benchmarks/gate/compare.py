"""The gate: results against the baseline, row by row. What is missing, not a number, or cannot be compared does not pass."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from .baseline import ORDER, Allowed, Baseline, BaselineRow
from .results import ENERGY_DRIFT, RUNAWAY, TIME_RATIO, Results, Row, Status, find_runaway

Times = Literal["required", "known"]
"""required: the baseline has to know times on this machine. known: where it does not, time is not gated, and that is said."""
ANYWHERE = "on any machine: conservative gate --against REF"
ACCEPT = 'accept with: conservative gate --update "REASON"'


@dataclass(frozen=True)
class Violation:
    """What is not as it was: of which measure, scene and method, what it was, is, and might be."""

    measure: str
    scene: str
    method: str
    was: str
    now: str
    allowed: str

    @property
    def finding(self) -> str:
        """What is not as it was, without what to do about it."""
        return f"{self.measure}, {self.scene}, {self.method}: was {self.was}, is {self.now}, allowed {self.allowed}"

    def __str__(self) -> str:
        return f"{self.finding}; {ACCEPT}"


@dataclass(frozen=True)
class Verdict:
    """Violations, what a reader should know beside them, and how many rows were compared."""

    violations: tuple[Violation, ...]
    notes: tuple[str, ...]
    rows: int

    @property
    def passed(self) -> bool:
        """Whether the gate is passed."""
        return not self.violations

    def __str__(self) -> str:
        head = f"gate: {'passed' if self.passed else 'FAILED'}, {self.rows} rows, {len(self.violations)} violations"
        return "\n".join([head, *map(str, self.violations), *(f"note: {note}" for note in self.notes)])


def judge(baseline: Baseline, results: Results, times: Times = "known") -> Verdict:
    """Return the verdict on results. A baseline without rows, which would let everything pass, is a violation."""
    violations = [] if baseline.rows else [Violation("rows", "all", "all", "none", "none", "one or more")]
    notes = [
        f"unbaselined: {id}" for id, row in results.rows.items() if id not in baseline.rows and row.status is Status.PASSED
    ]
    known = {machine for row in baseline.rows.values() for machine in row.time_ratios}
    foreign = bool(known) and results.machine not in known
    if foreign and times == "required":
        violations.append(_foreign(results.machine, known))
    elif foreign:
        notes.append(f"unbaselined machine: no time is gated, as the baseline has none of {results.machine}; {ANYWHERE}")
    for id, was in baseline.rows.items():
        violations += _row_violations(id, was, results, foreign)
    violations += _runaways(baseline, results)
    notes += _improvements(baseline, results)
    return Verdict(tuple(violations), tuple(notes), len(baseline.rows))


def _foreign(machine: str, known: set[str]) -> Violation:
    allowed = "a machine with times in the baseline, or --gate-times=known"
    return Violation("foreign machine", "all", "all", " or ".join(sorted(known)), machine, allowed)


def _row_violations(id: str, was: BaselineRow, results: Results, foreign: bool) -> Iterator[Violation]:
    """Yield what is wrong with one row; measures only where they can be compared."""

    def violation(measure: str, before: object, now: object, allowed: object) -> Violation:
        return Violation(measure, was.scene or id, was.method or id, str(before), str(now), str(allowed))

    row = results.rows.get(id)
    if row is None:
        names = list(_find_renames(was, results))
        yield violation("row", Status.PASSED, f"renamed {names[0]}" if names else "missing", Status.PASSED)
    elif row.status is not Status.PASSED:
        yield violation("row", Status.PASSED, row.status, Status.PASSED)
    elif row.definition != was.definition:
        yield violation("definition", was.definition, row.definition, was.definition)
    elif row.engine != was.engine:
        yield violation("engine version", was.engine, row.engine, was.engine)
    else:
        for name, allowed in was.measures.items():
            if not passes(name, row.values.get(name, math.nan), allowed):
                yield violation(name, f"{allowed.value:.6g}", _write_value(row.values.get(name)), _bound(name, allowed))
        ratio = was.time_ratios.get(results.machine)
        now = math.nan if row.time_ratio is None else row.time_ratio
        if ratio and not foreign and not passes(TIME_RATIO, now, ratio):
            yield violation(TIME_RATIO, f"{ratio.value:.4g}", _write_value(row.time_ratio), _bound(TIME_RATIO, ratio))


def _runaways(baseline: Baseline, results: Results) -> Iterator[Violation]:
    """Yield the rows whose run ran away, though it says of itself that it has passed, and whatever the baseline has of it."""
    for id, row in results.rows.items():
        if row.status is Status.PASSED and find_runaway(row.values):
            was = baseline.rows[id].measures.get(ENERGY_DRIFT) if id in baseline.rows else None
            before, now = _write_value(was.value if was else None), _write_value(row.values.get(ENERGY_DRIFT))
            yield Violation(ENERGY_DRIFT, row.scene or id, row.method or id, before, now, f"at most {RUNAWAY:g}")


def _find_renames(was: BaselineRow, results: Results) -> Iterator[str]:
    for row in results.rows.values():
        if row.definition and (row.definition, row.scene, row.method) == (was.definition, was.scene, was.method):
            yield row.id


def passes(measure: str, value: float, allowed: Allowed) -> bool:
    """Return whether a value is on the good side of its limit; nan is on neither."""
    return value >= allowed.limit if measure == ORDER else value <= allowed.limit


def _bound(measure: str, allowed: Allowed) -> str:
    side = "at least" if measure == ORDER else "at most"
    return f"{side} {allowed.limit:.6g} (spread {allowed.spread:.2g} in {allowed.runs} runs)"


def _write_value(value: float | None) -> str:
    return "missing" if value is None else f"{value:.6g}"


def _improvements(baseline: Baseline, results: Results) -> Iterator[str]:
    """Yield values that got better by as much as would fail the other way: a reason to update, and a change to understand."""
    for id, was in baseline.rows.items():
        row: Row | None = results.rows.get(id)
        if row is None or row.definition != was.definition:
            continue
        for name, allowed in was.measures.items():
            gain = allowed.value - row.values.get(name, math.nan)
            room = allowed.limit - allowed.value
            if gain * room > room * room:
                yield f"better: {name}, {was.scene}, {was.method}: was {allowed.value:.6g}, is {row.values[name]:.6g}"
