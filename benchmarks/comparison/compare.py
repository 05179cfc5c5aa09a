"""Compare two versions of a project: accuracy, drifts, orders and counts as the gate compares a baseline, and times in turn."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass

from conservative.errors import BadInput

from ..gate import compare as gate
from ..gate.baseline import update_baseline
from ..gate.compare import Violation
from ..gate.results import Results, Row, Status
from ..suite import points
from .rows import Found, Place, measure_rows
from .side import Side
from .times import PROCESSES, SLOWER, Timed, TimeRow, compare_times
from .version import Version

TIME = "time of a step"
Tell = Callable[[float, str], None]
"""Called with the share of the work that is done, and what comes next."""


@dataclass(frozen=True)
class ComparedRow:
    """A method on a scene in both versions; None where a version does not have it, or where it is not timed."""

    scene: str
    method: str
    was: Found | None
    now: Found | None
    time: TimeRow | None = None


@dataclass(frozen=True)
class Comparison:
    """What was found of two versions: rows, violations, and what a reader should know beside them."""

    base: Version
    head: Version
    rows: tuple[ComparedRow, ...]
    violations: tuple[Violation, ...]
    notes: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether nothing is worse in the later version."""
        return not self.violations


@dataclass(frozen=True)
class Question:
    """What is compared: scenes and methods, by default those of the suite, and from how many processes times come."""

    scenes: Sequence[str] = points.SCENES
    methods: Sequence[str] = ()
    processes: int = PROCESSES


def compare_versions(base: Version, head: Version, question: Question, tell: Tell = lambda share, what: None) -> Comparison:
    """Return what two versions differ in.

    Raises
    ------
    BadInput
        This process does not know a scene, or neither version has a method.
    """
    places = [Place.of(name) for name in question.scenes]
    with ExitStack() as stack:
        sides = Side(base), Side(head)
        for side in sides:
            stack.callback(side.close)
        was, now = (dict(_measure(side, places, question.methods, number, tell)) for number, side in enumerate(sides))
        if not was.keys() | now.keys():
            raise BadInput("methods", ", ".join(question.methods) or "none", "methods that a version has")
        timed = _timed(places, was, now)
        tell(0.5, f"timing {len(timed)} rows")
        times = compare_times(sides[0], sides[1], timed, question.processes)
    return judge(base, head, was, now, times)


def _measure(side: Side, places: Sequence[Place], names: Sequence[str], number: int, tell: Tell) -> Iterator[tuple[str, Found]]:
    """Yield the rows of a version, by id."""
    settings = side.settings(names)
    for done, place in enumerate(places):
        tell((number + done / len(places)) / 4, f"{side.version.name}: {place.name}")
        for found in measure_rows(side, place, settings):
            yield found.row.id, found


def _timed(places: Sequence[Place], was: Mapping[str, Found], now: Mapping[str, Found]) -> list[Timed]:
    """Return what can be timed: rows that both versions have, and that pass in both."""
    good = [id for id in was if id in now and _comparable(was[id]) and _comparable(now[id])]
    by_name = {place.name: place for place in places}
    return [Timed(by_name[was[id].row.scene], was[id].row.method) for id in good]


def _comparable(found: Found) -> bool:
    return found.row.status is Status.PASSED and not found.reason


def judge(
    base: Version, head: Version, was: Mapping[str, Found], now: Mapping[str, Found], times: Mapping[str, TimeRow]
) -> Comparison:
    """Return the comparison that rows of two versions, and times of both, make."""
    before = {id: found.row for id, found in was.items() if found.row.status is Status.PASSED}
    baseline = update_baseline(None, [_results(before)], f"measured beside {head.name}")
    verdict = gate.judge(baseline, _results({id: found.row for id, found in now.items()}), "known")
    rows = tuple(_row(id, was.get(id), now.get(id), times.get(id)) for id in dict.fromkeys([*was, *now]))
    violations = (*verdict.violations, *(each for row in rows for each in _time_violations(row)))
    return Comparison(base, head, rows, violations, (*_notes(rows), *_packages(base, head)))


def _results(rows: Mapping[str, Row]) -> Results:
    return Results("this one", rows)


def _row(id: str, was: Found | None, now: Found | None, time: TimeRow | None) -> ComparedRow:
    some = was or now
    assert some is not None, id
    return ComparedRow(some.row.scene, some.row.method, was, now, time)


def _time_violations(row: ComparedRow) -> Iterator[Violation]:
    time = row.time
    if time is None or not time.failed:
        return
    last = time.again or time.first
    now = time.reason or f"{last.value:.3f} times as long ({last.low:.3f} to {last.high:.3f})"
    yield Violation(TIME, row.scene, row.method, f"{time.was:.3g} s", now, f"at most {1 + SLOWER:g} times as long")


def _notes(rows: Sequence[ComparedRow]) -> Iterator[str]:
    """Yield what is no violation, and why rows that have none of their values do not."""
    for row in rows:
        name = f"{row.scene}, {row.method}"
        for when, found in (("was", row.was), ("is", row.now)):
            if found is None:
                yield f"{name}: {when} not there"
            elif found.row.status is not Status.SKIPPED and found.reason:
                yield f"{name}: {when} without values: {found.reason}"
        time = row.time
        if time and time.again and not time.failed:
            yield f"{name}: looked slower ({time.first.value:.3f}), and was not when measured again ({time.again.value:.3f})"
        if time and not math.isnan(time.first.high) and time.first.high < 1 / (1 + SLOWER):
            yield f"{name}: faster, {time.first.value:.3f} of the time"


def _packages(base: Version, head: Version) -> Iterator[str]:
    """Yield what differs between the environments, beside the project itself: a ratio of times may be due to that."""
    was, now = _by_name(base), _by_name(head)
    for name in sorted(was.keys() | now.keys()):
        if was.get(name) != now.get(name):
            yield f"another {name}: was {was.get(name, 'not there')}, is {now.get(name, 'not there')}"


def _by_name(version: Version) -> dict[str, str]:
    environment = version.environment
    found = {re.split("[ =@]", text)[0]: text for text in environment.packages}
    return {name: text for name, text in found.items() if name != environment.engine} | {"Python": environment.python}
