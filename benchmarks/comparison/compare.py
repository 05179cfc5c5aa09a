"""Compare two versions of a project: accuracy, drifts, orders and counts as the gate compares a baseline, and times in turn.

Errors of both versions are against one reference solution, that of this process, and drifts are computed here. Nothing that a
version reports about itself counts, except how a run ended.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from conservative import registry
from conservative.errors import BadInput, IntegrationFailed
from conservative.scene import Scene

from ..gate import compare as gate
from ..gate.baseline import update_baseline
from ..gate.compare import Violation
from ..gate.results import Results, Row, Status, find_runaway
from ..studies.study import Truths
from ..suite import points
from . import inside
from .side import Remote, Setting, Side
from .times import PROCESSES, SLOWER, Timed, TimeRow, compare_times
from .version import Version

TIME = "time of a step"
Tell = Callable[[float, str], None]
"""Called with the share of the work that is done, and the name of the next step."""


@dataclass(frozen=True)
class Place:
    """A scene of a comparison: its registered name, the scene in this process, and the hash of its definition here."""

    name: str
    scene: Scene
    definition: str
    truths: Truths = field(repr=False, compare=False)

    @classmethod
    def of(cls, name: str) -> Place:
        """Return the place of a name. Raises `BadInput` if this process has no such scene."""
        here = inside.describe_scene(**_question(name))
        return cls(name, registry.scene(name), _define(name, here), Truths())


def _question(name: str) -> dict[str, Any]:
    return {"scene": name, "probes": np.array(points.PROBES)}


def _define(name: str, found: Mapping[str, Any]) -> str:
    numbers = [found[each] for each in ("inertia", "R_WB0", "w_WB_B0", "ends", "energies")]
    return points.define([name, *found["invariants"]], numbers)


@dataclass(frozen=True)
class Found:
    """A row of one version, and why it has no values; empty if it has."""

    row: Row
    reason: str = ""


@dataclass(frozen=True)
class ComparedRow:
    """A method on a scene in both versions; None if a version does not have it, or if it is not timed."""

    scene: str
    method: str
    was: Found | None
    now: Found | None
    time: TimeRow | None = None


@dataclass(frozen=True)
class Comparison:
    """Two versions, their rows, violations, and notes."""

    base: Version
    head: Version
    rows: tuple[ComparedRow, ...]
    violations: tuple[Violation, ...]
    notes: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether nothing is worse in the later version."""
        return not self.violations


def compare_versions(
    base: Version,
    head: Version,
    scenes: Sequence[str] = points.SCENES,
    methods: Sequence[str] = (),
    processes: int = PROCESSES,
    tell: Tell = lambda share, what: None,
) -> Comparison:
    """Return the differences of two versions.

    Parameters
    ----------
    base, head
        The earlier and the later version.
    scenes, methods
        Registered names; by default the scenes of the suite, and all methods with the role `Role.OURS`.
    processes
        Number of processes of each version in a measurement of times.
    tell
        Progress.

    Raises
    ------
    BadInput
        This process does not have a scene, or neither version has a method.
    """
    places = {name: Place.of(name) for name in scenes}
    with ExitStack() as stack:
        sides = Side(base), Side(head)
        found: list[dict[str, Found]] = []
        for number, side in enumerate(sides):
            stack.callback(side.close)
            settings = side.settings(methods)
            found.append({})
            for done, place in enumerate(places.values()):
                tell((number + done / len(places)) / 4, f"{side.version.name}: {place.name}")
                found[-1].update((each.row.id, each) for each in measure_rows(side, place, settings))
        was, now = found
        if not was.keys() | now.keys():
            raise BadInput("methods", ", ".join(methods) or "none", "methods that a version has")
        good = [each.row for id, each in was.items() if _has_values(each) and id in now and _has_values(now[id])]
        timed = [Timed(row.id, row.scene, row.method, places[row.scene].scene.dt) for row in good]
        tell(0.5, f"timing {len(timed)} rows")
        times = compare_times(sides[0], sides[1], timed, processes)
    return judge(base, head, was, now, times)


def _has_values(found: Found) -> bool:
    return found.row.status is Status.PASSED and not found.reason


def measure_rows(side: Side, place: Place, settings: Sequence[Setting]) -> Iterator[Found]:
    """Yield a row for each setting on one scene; a failure is in its row."""
    rows = [
        Row(f"{place.name} / {each.name}", place.name, each.name, Status.PASSED, each.engine, place.definition)
        for each in settings
    ]
    try:
        definition = _define(place.name, side.ask("describe_scene", **_question(place.name)))
    except IntegrationFailed as failure:
        yield from (Found(replace(row, status=Status.ERROR), str(failure.outcome)) for row in rows)
        return
    for row, setting in zip(rows, settings, strict=True):
        if definition == place.definition:
            yield _measure(side, place, setting, row)
        else:  # there is no reference solution for its motion; the gate reports that the definitions differ
            yield Found(replace(row, definition=definition), "another motion")


def _measure(side: Side, place: Place, setting: Setting, row: Row) -> Found:
    try:
        pair = side.ask("describe_pair", scene=place.name, method=setting.name)
        if pair["unsupported"]:
            return Found(replace(row, status=Status.SKIPPED), pair["unsupported"])
        point = points.Point(place.scene, Remote(side, setting, place.name, pair["longest_step"]), place.truths)
        first = point.method.solve(place.scene, point.grid)
        if not first.ok:
            return Found(replace(row, status=Status.FAILED), str(first.outcome))
        return judge_values(row, points.measure(point))
    except IntegrationFailed as failure:
        return Found(replace(row, status=Status.FAILED), str(failure.outcome))


def judge_values(row: Row, values: Mapping[str, points.GatedValue]) -> Found:
    """Return a row with its values. It failed if one of them is not finite, or if its energy ran away."""
    plain = {name: each.value for name, each in values.items()}
    nonsense = [f"{name} is {value}" for name, value in plain.items() if not math.isfinite(value)]
    if reason := "; ".join(filter(None, [find_runaway(plain), *nonsense])):
        return Found(replace(row, status=Status.FAILED), reason)
    return Found(replace(row, values=plain, spreads={name: each.spread for name, each in values.items()}))


def judge(
    base: Version, head: Version, was: Mapping[str, Found], now: Mapping[str, Found], times: Mapping[str, TimeRow]
) -> Comparison:
    """Return the comparison of the rows of two versions, and of their times, all by the id of a row."""
    before = {id: found.row for id, found in was.items() if found.row.status is Status.PASSED}
    baseline = update_baseline(None, [Results("", before)], f"measured beside {head.name}")
    verdict = gate.judge(baseline, Results("", {id: found.row for id, found in now.items()}))
    rows = []
    for id in dict.fromkeys([*was, *now]):
        row = (was.get(id) or now[id]).row
        rows.append(ComparedRow(row.scene, row.method, was.get(id), now.get(id), times.get(id)))
    slower = [each for row in rows for each in _time_violations(row)]
    return Comparison(base, head, tuple(rows), (*verdict.violations, *slower), (*_notes(rows), *_packages(base, head)))


def _time_violations(row: ComparedRow) -> Iterator[Violation]:
    time = row.time
    if time is None or not time.failed:
        return
    last = time.again or time.first
    now = time.reason or f"{last.value:.3f} times as long ({last.low:.3f} to {last.high:.3f})"
    yield Violation(TIME, row.scene, row.method, f"{time.was:.3g} s", now, f"at most {1 + SLOWER:g} times as long")


def _notes(rows: Sequence[ComparedRow]) -> Iterator[str]:
    """Yield findings that are not violations, and the reasons of rows without values."""
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
    """Yield the differences of both environments besides the project itself, which can explain a ratio of times."""
    found = []
    for version in (base, head):
        environment = version.environment
        by_name = {re.split("[ =@]", text)[0]: text for text in environment.packages}
        by_name.pop(environment.engine, None)  # the project itself
        found.append(by_name | {"Python": environment.python})
    was, now = found
    for name in sorted(was.keys() | now.keys()):
        if was.get(name) != now.get(name):
            yield f"another {name}: was {was.get(name, 'not there')}, is {now.get(name, 'not there')}"
