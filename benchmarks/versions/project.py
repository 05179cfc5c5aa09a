"""Versions of a project: the gate compares errors, drifts, orders and counts, as with a baseline; times are in turn.

This process measures the errors of all versions against its own reference solution, and computes the drifts. A version only
integrates, and reports the outcome of its runs.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property, partial
from pathlib import Path
from time import monotonic
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple

import numpy as np

from conservative import registry
from conservative.errors import BadInput, IntegrationFailed, Unsupported
from conservative.features import Feature
from conservative.grid import Grid
from conservative.method import Role
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.references.environments.engine_method import WorkerRun
from conservative.references.environments.plain_numbers import Answer
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from ..gate import compare as gate
from ..gate.baseline import ATTITUDE, COUNTS, Allowed, limit, update_baseline
from ..gate.compare import Decision, worsening
from ..gate.results import Results, Row, find_runaway
from ..measures.change import Change, RowName
from ..measures.errors import is_lost
from ..measures.measure import Measure
from ..studies.selection import StandIn
from ..studies.study import FindTruth, Progress, remember_truths
from ..suite import description, points
from ..suite.motion import motion_of
from . import inside
from .comparison import Comparison, Line, compare
from .prices import Price
from .times import PROCESSES, SLOWER, TimeRow, compare_times
from .version import Checkout, Version

TIME, MOTION = "time of a step", "another motion"
OF_ATTITUDE = {measure.text for measure in (Measure.ATTITUDE_MAX, Measure.RATES_MAX, Measure.POSITION_MAX, Measure.ORDER)}
"""Measures that mean nothing if the attitude is lost."""
FOLLOWED, SATURATED = 0.1, 3.0
"""Attitude errors, rad: a motion with an error up to the first follows the exact one, and is another motion if it is lost in
the later version; above the second in both versions, half a turn, errors say nothing."""
ANOTHER_SCENE = Outcome(OutcomeKind.OK, "the scene is another one")
"""Outcome of a row that was not measured, because its scene has another definition than in this process."""
SLOW = 1.0
"""Duration of a run, s, above which a row is measured with fewer points."""
_ADAPTER, _DESCRIPTION = str(Path(inside.__file__).resolve()), str(Path(description.__file__).resolve())

ProjectLine = Line[Row, TimeRow]
ProjectComparison = Comparison[Row, TimeRow]


class Standing(StrEnum):
    """The standing of a row of the later version against the earlier one, the worst first."""

    MOTION = "another motion"
    SLOWER = "slower"
    WORSE = "worse"
    PAID = "slower, accepted"
    BETTER = "better"
    FASTER = "faster"
    NEW = "new"
    SAME = "same"
    NOTHING = "not compared"


class Explained(NamedTuple):
    """The mistakes that explain wrong motions, by their keys and in a sentence; both are empty for right motions."""

    key: str = ""
    sentence: str = ""


Explain = Callable[[Callable[[Scene, Grid], Trajectory], Mapping[str, Any]], tuple[Explained, Explained]]
"""From a function that integrates scenes, and a setting, to the mistakes on free and on other bodies."""


class ProjectSide:
    """A version and its process, with its own folder of compiled kernels.

    `names` are the compared methods, by default those that the project registers with the role `Role.OURS`. `few` are the rows
    that are measured with fewer points: the points of the earlier version, because values of other points cannot be compared.
    `explain` finds the mistakes of a setting; without it no row has a cause.
    """

    def __init__(
        self,
        version: Version,
        names: Sequence[str] = (),
        truths: FindTruth | None = None,
        few: set[str] | None = None,
        explain: Explain | None = None,
    ) -> None:
        self.version, self._names, self._truths = version, list(names), truths or remember_truths()
        self.few, self._decides = set[str]() if few is None else few, few is None
        self._explain, self._causes = explain, dict[str, tuple[Explained, Explained]]()
        kernels = version.environment.folder / "home" / "kernels"
        self._worker = version.environment.start_worker({"NUMBA_CACHE_DIR": str(kernels)})

    def close(self) -> None:
        """End the process; the next call starts another one."""
        self._worker.close()

    def ask(self, function: str, file: str = _ADAPTER, **values: Any) -> dict[str, Any]:
        """Return the result of a function of a file, by default `inside`. Raise `IntegrationFailed` without an answer."""
        return self._worker.ask("call", adapter=file, function=function, **values)

    @cached_property
    def settings(self) -> list[dict[str, Any]]:
        """Name, label, order, precision and engine (the label of a foreign method, else "") of each setting."""
        return list(self.ask("list_methods", names=self._names, project=self.version.environment.engine)["methods"])

    def measure(self, scene: str) -> Iterator[tuple[str, Row]]:
        """Yield a row for each setting on a scene; a failure is in its row."""
        here, rows = motion_of(scene), {}
        for setting in self.settings:
            name, definition = setting["name"], here.definition(scene, setting["name"])
            rows[name] = Row(f"{scene} / {name}", scene, name, OK, setting["engine"], definition)
        try:
            there = motion_of(scene, partial(self.ask, "describe_scene", file=_DESCRIPTION))
        except IntegrationFailed as failure:
            missing = Outcome(OutcomeKind.MISSING, str(failure.outcome))
            yield from ((name, replace(row, outcome=missing)) for name, row in rows.items())
            return
        for setting, (name, row) in zip(self.settings, rows.items(), strict=True):
            if here.key == there.key:
                row = self._measure(scene, setting, row)
                if row.outcome.kind is not OutcomeKind.UNSUPPORTED:
                    explained = self._find_causes(setting)[not registry.scene(scene).free]
                    row = replace(row, mistake=explained.key, cause=explained.sentence)
                yield name, row
            else:  # there is no reference solution for its motion; the gate reports that the definitions differ
                yield name, replace(row, definition=there.definition(scene, name), outcome=ANOTHER_SCENE)

    def _measure(self, name: str, setting: Mapping[str, Any], row: Row) -> Row:
        try:
            pair = self.ask("describe_pair", scene=name, method=setting["name"])
            if pair["unsupported"]:
                return replace(row, outcome=Outcome(OutcomeKind.UNSUPPORTED, pair["unsupported"]))
            method = self._remote(setting, name, pair["longest_step"])
            point = points.Point(registry.scene(name), method, self._truths)
            spent = monotonic()
            first = method.solve(point.scene, point.grid)
            spent = monotonic() - spent
            if not first.ok:
                return replace(row, outcome=first.outcome)
            if self._decides and spent > SLOW:  # the first run may compile
                spent = monotonic()
                method.solve(point.scene, point.grid)
                if monotonic() - spent > SLOW:
                    self.few.add(row.id)
            return decide_values(row, *points.measure(point, row.id in self.few))
        except IntegrationFailed as failure:
            return replace(row, outcome=failure.outcome)

    def _remote(self, setting: Mapping[str, Any], scene: str = "", longest: float = math.inf) -> Remote:
        names = setting["name"], setting["label"], setting["order"]
        return Remote(*names, side=self, scene_name=scene, longest=longest, precision=setting["precision"])

    def _find_causes(self, setting: Mapping[str, Any]) -> tuple[Explained, Explained]:
        """Return the mistakes of a setting on free and on other bodies; none if it does not answer."""
        name = setting["name"]
        if name not in self._causes:
            self._causes[name] = Explained(), Explained()
            with suppress(IntegrationFailed):  # a row of a scene says so
                if self._explain:
                    self._causes[name] = self._explain(self._remote(setting).probe, setting)
        return self._causes[name]

    def run(self, task: str, read: Callable[[Answer], Any], **values: Any) -> WorkerRun[Any]:
        """Return the run of a task of `inside`; `read` converts its answers."""
        return WorkerRun(self._worker, {"adapter": _ADAPTER, "settings": {"task": task}, **values}, read)

    def timed(self, scene: str, method: str, n_steps: int) -> Any:
        """Return a prepared run of n_steps steps of a scene, to be timed; its answers are not converted."""
        run = self.run("time", lambda answer: answer, scene=scene, method=method, dt=registry.scene(scene).dt, n_steps=n_steps)
        run.prepare()
        return run.own_loop


@dataclass(frozen=True, kw_only=True)
class Remote(StandIn):
    """A method of a version, on the scene with the name `scene_name`, with its longest step there, s, and its precision."""

    side: ProjectSide = field(compare=False, repr=False)
    scene_name: str
    longest: float
    precision: str = "f64"

    family: ClassVar[str] = "remote"
    role: ClassVar[Role] = Role.OURS

    def longest_step(self, scene: Scene) -> float:
        return self.longest

    def prepare(self, scene: Scene, grid: Grid) -> WorkerRun[Trajectory]:
        """Return the run. It is prepared at its first call, so that a failure to prepare is a failure of the run."""
        values = {"dt": grid.dt, "n_steps": grid.n_steps, "every": grid.every, "w_WB_B0": scene.w_WB_B0}
        return self.side.run("solve", partial(self.read, scene), scene=self.scene_name, method=self.name, **values)

    def probe(self, scene: Scene, grid: Grid) -> Trajectory:
        """Return the trajectory of a body in its principal axes, free or with a weight. It is not checked.

        Raise `Unsupported` for other scenes, which not every version has, and for those that the method does not support.
        """
        if lacking := scene.features - {Feature.GRAVITY}:
            raise Unsupported("scene", ", ".join(sorted(lacking)), "a free body, or one with a weight")
        field: Any = scene.potential
        weight, com = (0.0, np.zeros(3)) if field is None else (field.weight, field.com_B)
        body = {"moments": scene.body.moments, "R_WB0": scene.R_WB0, "w_WB_B0": scene.w_WB_B0, "weight": weight, "com": com}
        steps = {"dt": grid.dt, "n_steps": grid.n_steps, "every": grid.every}
        try:
            trajectory = self.side.run("probe", partial(self.read, scene), method=self.name, **body, **steps)()
        except NotImplementedError as error:
            raise Unsupported("scene", str(error), "a scene that the method supports") from None
        if trajectory.failure is not None:
            raise trajectory.failure
        return trajectory

    def read(self, scene: Scene, answer: Answer) -> Trajectory:
        """Return the trajectory of a scene from the states of the version."""
        if isinstance(answer, IntegrationFailed):
            return Trajectory(scene, np.empty(0), np.empty((0, 3, 3)), np.empty((0, 3)), self.label, Counters(0), answer)
        counts, failure = Counters(**{name: answer["counts"].get(name) for name in COUNTS}), None
        if answer["failure"]:
            kind, *details = answer["failure"]
            failure = IntegrationFailed("The run of this version ended")
            failure.outcome = Outcome(OutcomeKind(kind), *details)
        return Trajectory(scene, answer["t"], answer["R_WB"], answer["w_WB_B"], self.label, counts, failure)


def decide_values(row: Row, values: Mapping[str, float], spreads: Mapping[str, float]) -> Row:
    """Return a row with its values. It failed if one of them is not finite, or if its energy ran away."""
    if nonsense := [f"{name} is {value}" for name, value in values.items() if not math.isfinite(value)]:
        return replace(row, outcome=Outcome(OutcomeKind.INVALID, "; ".join(nonsense)))
    if runaway := find_runaway(values):
        return replace(row, outcome=Outcome(OutcomeKind.NOT_CONSERVED, runaway))
    return replace(row, values=values, spreads=spreads)


def compare_projects(
    base: Version,
    head: Version,
    scenes: Sequence[str] = points.SCENES,
    methods: Sequence[str] = (),
    processes: int = PROCESSES,
    tell: Progress = lambda share, what: None,
    explain: Explain | None = None,
) -> ProjectComparison:
    """Return the comparison of an earlier and a later version of a project, with a number of processes of each for times,
    or 0 for none.

    Scenes and methods are registered names; by default the scenes of the suite, and all methods with the role `Role.OURS`.
    `explain` finds the mistakes that explain wrong motions; without it violations have no causes.

    Raises
    ------
    BadInput
        This process does not have a scene, or neither version has one of the methods, or any.
    """
    for name in scenes:
        motion_of(name)  # before any work
    truths = remember_truths()
    with (
        closing(ProjectSide(base, methods, truths, explain=explain)) as was,
        closing(ProjectSide(head, methods, truths, was.few, explain)) as now,
    ):
        made: ProjectComparison = compare((was, now), scenes, tell)
        if unknown := find_unknown(methods, {line.setting for line in made.lines}):
            raise BadInput("methods", ", ".join(unknown), "methods that a version has, without engines in environments")
        if not made.lines:
            raise BadInput("methods", "none", "a project that registers methods, or names of methods")
        good = [
            (line.scene, line.setting)
            for line in made.lines
            if all(row and row.outcome == OK for row in line.results) and not _moves(*line.results)  # type: ignore[arg-type]  # neither is None
        ]
        times = compare_times(was, now, good, processes, tell) if processes else {}
        lines = (replace(line, times=times.get((line.scene, line.setting))) for line in made.lines)
        return replace(made, lines=tuple(lines))


def find_unknown(methods: Sequence[str], settings: Collection[str]) -> list[str]:
    """Return the methods of which no version has a setting."""
    families = {registry.read_name(setting).family for setting in settings}
    return [name for name in methods if registry.read_name(name, "methods").family not in families]


def decide(comparison: ProjectComparison, prices: Mapping[str, Price] = MappingProxyType({})) -> Decision:
    """Return the decision on the last step of a comparison: other motions, the gate's on values, and times without a price."""
    (base, head), steps = comparison.versions, list(comparison.steps)
    before = {was.id: was for _, was, _ in steps if was is not None and was.outcome.ok}
    saturated = {now.id for _, was, now in steps if was and now and _saturated(was, now)}
    before |= {id: replace(before[id], values=_conserved(before[id])) for id in saturated & before.keys()}
    baseline = update_baseline(None, [Results("", before)], f"measured alongside {head.name}")
    decision = gate.decide(baseline, Results("", {now.id: now for _, _, now in steps if now is not None}))
    moved = {now.id: _moved(was, now) for _, was, now in steps if was and now and _moves(was, now)}
    others = {(change.row.scene, change.row.method) for change in moved.values()}
    kept = (change for change in decision.violations if (change.row.scene, change.row.method) not in others)
    violations = [*moved.values(), *kept]
    paid, unused = list[str](), set(prices)
    for line in comparison.lines:
        if (time := line.times) and time.failed:
            last, price = time.again or time.first, prices.get(line.setting)
            if price and not time.reason and last.direction(price.factor) <= 0:
                paid.append(f"{line.scene}, {line.setting}: {last.value:.3g} times as long, {price}")
                unused.discard(line.setting)
                continue
            most = f"at most {price.factor if price else 1 + SLOWER:g} times as long"
            name = RowName(line.scene, line.setting, TIME)
            violations.append(Change(name, f"{time.was:.3g} s", time.reason or last, most))
            unused.discard(line.setting)
    paid += [f"{name}: no row needs the longer time, {prices[name]}" for name in sorted(unused)]
    notes = (
        *paid,
        *(note for step in steps for note in _notes(*step)),
        *_of_settings(steps),
        *_same_builds(base, head),
        *_packages(base, head),
    )
    return Decision((*violations,), notes, len(comparison.lines))


def error_of(row: Row) -> float:
    """Return the largest attitude error of a row, rad; 0 for a row without it."""
    return row.values.get(ATTITUDE, 0.0)


def _saturated(was: Row, now: Row) -> bool:
    """Return whether attitudes are half a turn away in both versions, so that measures of them say nothing."""
    return min(error_of(was), error_of(now)) > SATURATED


def _conserved(row: Row) -> dict[str, float]:
    """Return the values of a row that mean something although its attitude is lost."""
    return {name: value for name, value in row.values.items() if name not in OF_ATTITUDE}


def _moves(was: Row, now: Row) -> bool:
    """Return whether a row has another motion than before: by a mistake that is known, or by its attitude."""
    if OutcomeKind.UNSUPPORTED in (was.outcome.kind, now.outcome.kind) or was.outcome.kind is OutcomeKind.MISSING:
        return False
    if was.definition != now.definition:
        return False
    if now.mistake not in ("", was.mistake):  # also where the motion is lost in both
        return True
    return was.outcome.ok and error_of(was) <= FOLLOWED and is_lost(error_of(now))


def _moved(was: Row, now: Row) -> Change:
    """Return the change to another motion, with its cause."""
    before = f"{error_of(was):.3g} rad from the motion of the scene" if was.values else f"without values ({was.outcome})"
    size = f"{error_of(now):.3g} rad from it" if now.values else f"without values ({now.outcome})"
    cause = now.cause if now.mistake not in ("", was.mistake) else "No known mistake explains it"
    return Change(RowName(now.scene, now.method, MOTION), before, f"{size}. {cause}")


def _notes(line: ProjectLine, was: Row | None, now: Row | None) -> Iterator[str]:
    """Yield the notes on a row: missing rows, reasons of rows without values, and times that changed."""
    name, time = f"{line.scene}, {line.setting}", line.times
    for when, row in (("was", was), ("is", now)):
        if row is None:
            yield f"{name}: {when} not there"
        elif row.outcome == ANOTHER_SCENE:
            yield f"{name}: {when} not measured: {row.outcome.reason}"
        elif row.outcome != OK and row.outcome.kind is not OutcomeKind.UNSUPPORTED:
            yield f"{name}: {when} without values: {row.outcome}"
    if time and time.again and not time.failed:
        yield f"{name}: looked slower ({time.first.value:.3f}), and was not when measured again ({time.again.value:.3f})"
    if faster(line) and time:
        yield f"{name}: faster, {time.first.value:.3f} of the time"
    if was and now and is_lost(error_of(was)) and is_lost(error_of(now)):
        errors = f"the error was {error_of(was):.3g} rad and is {error_of(now):.3g} rad"
        yield f"{name}: the attitude is lost in both versions: {errors}"


def faster(line: ProjectLine) -> bool:
    """Return whether a row is faster than before. A motion whose attitude is lost is not."""
    now, times = line.results[-1], line.times
    return now is not None and times is not None and not is_lost(error_of(now)) and times.first.direction() < 0


def improved(line: ProjectLine) -> tuple[str, ...]:
    """Return what is better than before by as much as it may get worse: measures, the outcome ("row") or the "mistake"."""
    was, now = line.results
    if was is None or now is None or not now.outcome.ok or was.definition != now.definition:
        return ()
    if not was.outcome.ok:
        return () if was.outcome.kind is OutcomeKind.UNSUPPORTED else ("row",)
    better = [name for name in was.values if changed(was, now, name) < 0]
    return (*["mistake"] * bool(was.mistake and not now.mistake), *better)


def changed(was: Row, now: Row, measure: str) -> int:
    """Return 1 if a measure is worse by more than the gate allows, -1 if it is better by as much, otherwise 0."""
    if measure in OF_ATTITUDE and _saturated(was, now):
        return 0
    value, spread = was.values.get(measure, math.nan), was.spreads.get(measure, 0.0)
    allowed = Allowed(value, spread, 1, limit(measure, value, spread))
    return worsening(measure, allowed, now.values.get(measure, math.nan))


def standing_of(line: ProjectLine, violations: Sequence[Change]) -> Standing:
    """Return the standing of a row, of which `violations` may be some."""
    measures = [
        change.row.measure for change in violations if (change.row.scene, change.row.method) == (line.scene, line.setting)
    ]
    if measures:
        return Standing.MOTION if MOTION in measures else Standing.SLOWER if TIME in measures else Standing.WORSE
    if line.results[0] is None:
        return Standing.NEW
    if line.times and line.times.failed:
        return Standing.PAID
    if improved(line):
        return Standing.BETTER
    if line.times is None:
        return Standing.NOTHING
    return Standing.FASTER if faster(line) else Standing.SAME


def _of_settings(steps: Sequence[tuple[ProjectLine, Row | None, Row | None]]) -> Iterator[str]:
    """Yield the notes on settings: mistakes of both versions, or of the earlier one, and scenes that they do not support."""
    scenes: dict[str, list[str]] = {}
    for line, was, now in steps:
        ends = [row.outcome for row in (was, now) if row and row.outcome.kind is OutcomeKind.UNSUPPORTED]
        for text in dict.fromkeys(outcome.reason for outcome in ends):
            scenes.setdefault(f"{line.setting}: not supported ({text})", []).append(line.scene)
        if was and was.cause:
            when = "in both versions" if now and now.mistake == was.mistake else "not any more"
            scenes.setdefault(f"{line.setting}: {was.cause} ({when})", []).append(line.scene)
    for text, names in scenes.items():
        yield f"{text}: {', '.join(dict.fromkeys(names))}"


def _same_builds(base: Version, head: Version) -> Iterator[str]:
    """Yield the programs of which both versions have the same files although their commits differ: a build may be stale."""
    if not (isinstance(base.environment, Checkout) and isinstance(head.environment, Checkout)) or base.commit == head.commit:
        return
    was, now = base.environment.programs(), head.environment.programs()
    for name in sorted(was.keys() & now.keys()):
        if was[name] == now[name]:
            yield f"{name}: both versions run identical files, although their commits differ. Is the build of each up to date?"


def _packages(base: Version, head: Version) -> Iterator[str]:
    """Yield the differences of both environments besides the project itself, which can explain a ratio of times."""
    packages = []
    for version in (base, head):
        environment = version.environment
        by_name = {re.split("[ =@]", text)[0]: text for text in environment.packages}
        by_name.pop(environment.engine, None)  # the project itself
        packages.append(by_name | {"runtime": environment.runtime})
    was, now = packages
    for name in sorted(was.keys() | now.keys()):
        if was.get(name) != now.get(name):
            yield f"another {name}: was {was.get(name, 'not there')}, is {now.get(name, 'not there')}"
