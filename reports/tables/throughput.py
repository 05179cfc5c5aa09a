"""The study of throughput as tables, words and data of a picture; see `throughput_lines`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.studies import THROUGHPUT
from conservative.benchmarks.studies.throughput import ERRORS, MEDIAN
from conservative.outcome import OutcomeKind

from .cells import DASH, Cell, Grade, Table, number, tolerance
from .classes import MethodClass
from .random_ratios import ratio_text
from .throughput_lines import Contest, Line, contests, lines

TERMS = (
    "The bodies all differ: asymmetric, in turned frames, heavy tops with no point on an axis, or free, drawn from a seed. "
    "Each runs for 12 s of its motion, of which the ends are kept; the time is that of a prepared run, preparation is apart. "
    "The error of a setting on a body is its largest attitude error at twelve instants; of the bodies whose errors are read "
    "the median counts, or the 95th percentile. Between two settings of a line the time is interpolated, and a lucky one does "
    "not count. Solutions of integrable motions are a class apart: solutions take steps of 0.1 s, and would take any. Where "
    "nothing else is said, bodies run at once on one thread; `one at a time` is a loop over them in Python."
)
"""What the tables mean."""


@dataclass(frozen=True, eq=False)
class ThroughputView:
    """What a report shows of many bodies: `points` has columns kind, error, name, family, size and time, µs."""

    statements: tuple[str, ...]
    ratios: Table
    costs: Table
    absent: Table
    points: pd.DataFrame


def view(table: pd.DataFrame) -> ThroughputView:
    """Return the view of the named rows of the study."""
    found = lines(table)
    compared = list(contests(found))
    return ThroughputView(
        tuple(statements(compared)), as_table(compared), cost_table(found), absent(table), chart_points(found)
    )


def as_table(compared: Iterable[Contest]) -> Table:
    """Return the contests, a row for each kind, engine and error."""
    header = [
        "bodies",
        "of our methods",
        "engine",
        "error, rad",
        "at",
        "number",
        "engine / ours",
        "ours, µs",
        "engine, µs",
        "ours is",
        "engine is",
    ]
    return header, [_contest_row(contest) for contest in compared]


def _contest_row(contest: Contest) -> list[str | Cell]:
    ours, theirs, ratio = contest.ours, contest.theirs, contest.ratio
    good = ratio >= 1
    graded = (
        Cell(DASH, Grade.NONE)
        if math.isnan(ratio)
        else Cell(f"{'✓' if good else '✗'} {ratio_text(ratio)}", Grade.GOOD if good else Grade.BAD)
    )
    times = [number(each.time * 1e6, 3) if each else DASH for each in (ours, theirs)]
    names = [each.label if each else "no time" for each in (ours, theirs)]
    kind, error = contest.kind.replace("_", " "), tolerance(contest.error)
    return [kind, contest.group.value, contest.engine, error, contest.which, f"{contest.size:,}", graded, *times, *names]


def cost_table(found: Iterable[Line]) -> Table:
    """Return every line: body-steps per second at best, the least preparation, and the time among most bodies at each error."""
    header = ["bodies", "method", "class", "10^6 body-steps/s, best", "preparation, µs a body, least"]
    return [*header, *(f"µs a body and second at {tolerance(error)} rad (number)" for error in ERRORS)], [
        _cost_row(line) for line in found
    ]


def _cost_row(line: Line) -> list[str]:
    rate, prepare = line.best(Measure.BODY_STEPS, max), line.best(Measure.PREPARE, min)
    costs = [_cost_text(line, error) for error in ERRORS]
    return [line.kind.replace("_", " "), line.label, line.group.value, number(rate / 1e6, 3), number(prepare * 1e6, 3), *costs]


def _cost_text(line: Line, error: float) -> str:
    """Return the time among the most bodies at which the line gets to an error, and how many those are."""
    for size in reversed(line.sizes):
        if not math.isnan(time := line.cost(error, size)):
            return f"{number(time * 1e6, 3)} ({size:,})"
    return DASH


def absent(table: pd.DataFrame) -> Table:
    """Return what of the study did not run, and why; what would have taken too long is left out where fewer bodies ran."""
    here = table["study"] == THROUGHPUT
    failed = table[
        here & ~table["outcome"].isin((OutcomeKind.OK, OutcomeKind.SKIPPED)) & (table["measure"] != Measure.BODY_STEPS.text)
    ]
    grouped = failed.groupby(["scene", "name", "outcome", "reason"], sort=False).size()
    rows = [[str(scene).replace("_", " "), str(name), f"{kind}: {reason}"] for scene, name, kind, reason in grouped.index]
    return ["bodies", "method", "why not"], rows


def statements(compared: Iterable[Contest]) -> Iterator[str]:
    """Yield what is found at the median, a sentence for each kind, engine and class of ours."""
    groups: dict[tuple[str, str, MethodClass], list[Contest]] = {}
    for contest in compared:
        if contest.which == MEDIAN:
            groups.setdefault((contest.kind, contest.engine, contest.group), []).append(contest)
    for (kind, engine, group), members in groups.items():
        yield f"{kind.replace('_', ' ')}, the cheapest of {group} against {engine}: {'; '.join(map(_words, members))}."


def _words(contest: Contest) -> str:
    at = f"at {tolerance(contest.error)} rad"
    if not contest.ours or not contest.theirs:
        missing = [name for name, side in (("ours", contest.ours), (contest.engine, contest.theirs)) if not side]
        return f"{at} there is no time of {' and '.join(missing)}"
    ratio, among = contest.ratio, f"among {contest.size:,}"
    return (
        f"{at} {contest.engine} takes {ratio_text(ratio)} times as long ({among})"
        if ratio >= 1
        else (f"{at} {contest.engine} is {ratio_text(1 / ratio)} times as fast as ours ({among})")
    )


def chart_points(found: Iterable[Line]) -> pd.DataFrame:
    """Return the time of each line at each error over the number of bodies."""
    rows = [
        (line.kind, error, line.label, line.family, size, line.cost(error, size) * 1e6)
        for line in found
        for error in ERRORS
        for size in line.sizes
        if not math.isnan(line.cost(error, size))
    ]
    return pd.DataFrame(rows, columns=["kind", "error", "name", "family", "size", "time"])
