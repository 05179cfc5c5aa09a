"""Versions of a project: the gate judges errors, drifts, orders and counts, as against a baseline; times are measured in turn.

This process measures the errors of all versions against its own reference solution, and computes the drifts. A version only
integrates, and reports the outcome of its runs.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from conservative import registry
from conservative.errors import BadInput, IntegrationFailed
from conservative.grid import Grid
from conservative.method import Role
from conservative.outcome import Outcome, OutcomeKind
from conservative.references.environments.engine_method import WorkerRun
from conservative.references.environments.plain_numbers import Answer
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from ..gate import compare as gate
from ..gate.baseline import COUNTS, update_baseline
from ..gate.compare import Verdict, Violation
from ..gate.results import Results, Row, Status, find_runaway
from ..studies.selection import StandIn
from ..studies.study import FindTruth, Progress, remember_truths
from ..suite import points
from . import inside
from .comparison import Comparison, Line, compare
from .times import PROCESSES, SLOWER, TimeRow, compare_times
from .version import Version

TIME = "time of a step"
_ADAPTER = str(Path(inside.__file__).resolve())

ProjectLine = Line[Row, TimeRow]
ProjectComparison = Comparison[Row, TimeRow]


class ProjectSide:
    """A version and its process, with its own folder of compiled kernels.

    `names` are the compared methods, by default those that the project registers with the role `Role.OURS`.
    """

    def __init__(self, version: Version, names: Sequence[str] = (), truths: FindTruth | None = None) -> None:
        self.version, self._names, self._truths = version, list(names), truths or remember_truths()
        kernels = version.environment.folder / "home" / "kernels"
        self._worker = version.environment.start_worker({"NUMBA_CACHE_DIR": str(kernels)})

    def close(self) -> None:
        """End the process; the next call starts another one."""
        self._worker.close()

    def ask(self, function: str, **values: Any) -> dict[str, Any]:
        """Return the result of a function of `inside`. Raise `IntegrationFailed` if the version cannot answer."""
        return self._worker.ask("call", adapter=_ADAPTER, function=function, **values)

    @cached_property
    def settings(self) -> list[dict[str, Any]]:
        """Name, label, order and engine (the label of a foreign method, else "") of each setting."""
        return list(self.ask("list_methods", names=self._names, project=self.version.environment.engine)["methods"])

    def measure(self, scene: str) -> Iterator[tuple[str, Row]]:
        """Yield a row for each setting on a scene; a failure is in its row."""
        here, rows = define_scene(scene), {}
        for each in self.settings:
            row_id = f"{scene} / {each['name']}"
            rows[each["name"]] = Row(row_id, scene, each["name"], Status.PASSED, each["engine"], here)
        try:
            there = define_scene(scene, partial(self.ask, "describe_scene"))
        except IntegrationFailed as failure:
            yield from ((name, replace(row, status=Status.ERROR, reason=str(failure.outcome))) for name, row in rows.items())
            return
        for setting, (name, row) in zip(self.settings, rows.items(), strict=True):
            if here == there:
                yield name, self._measure(scene, setting, row)
            else:  # there is no reference solution for its motion; the gate reports that the definitions differ
                yield name, replace(row, definition=there, reason="another motion")

    def _measure(self, name: str, setting: Mapping[str, Any], row: Row) -> Row:
        try:
            pair = self.ask("describe_pair", scene=name, method=setting["name"])
            if pair["unsupported"]:
                return replace(row, status=Status.SKIPPED, reason=pair["unsupported"])
            names = setting["name"], setting["label"], setting["order"]
            method = Remote(*names, side=self, scene_name=name, longest=pair["longest_step"])
            point = points.Point(registry.scene(name), method, self._truths)
            first = method.solve(point.scene, point.grid)
            if not first.ok:
                return replace(row, status=Status.FAILED, reason=str(first.outcome))
            return judge_values(row, *points.measure(point))
        except IntegrationFailed as failure:
            return replace(row, status=Status.FAILED, reason=str(failure.outcome))

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
    """A method of a version, on the scene with the name `scene_name` and with its longest step there, s."""

    side: ProjectSide = field(compare=False, repr=False)
    scene_name: str
    longest: float

    family: ClassVar[str] = "remote"
    role: ClassVar[Role] = Role.OURS

    def longest_step(self, scene: Scene) -> float:
        return self.longest

    def prepare(self, scene: Scene, grid: Grid) -> WorkerRun[Trajectory]:
        """Return the run. It is prepared at its first call, so that a failure to prepare is a failure of the run."""
        values = {"dt": grid.dt, "n_steps": grid.n_steps, "every": grid.every, "w_WB_B0": scene.w_WB_B0}
        return self.side.run("solve", partial(self.read, scene), scene=self.scene_name, method=self.name, **values)

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


def define_scene(name: str, describe: Callable[..., Mapping[str, Any]] = inside.describe_scene) -> str:
    """Return the hash of a scene, by default as this process has it. Raise `BadInput` if it does not have the scene."""
    answer = describe(scene=name, probes=np.array(points.PROBES))
    numbers = [answer[each] for each in ("inertia", "R_WB0", "w_WB_B0", "ends", "energies")] + [*answer["parts"]]
    return points.define([name, *answer["invariants"]], numbers)


def judge_values(row: Row, values: Mapping[str, float], spreads: Mapping[str, float]) -> Row:
    """Return a row with its values. It failed if one of them is not finite, or if its energy ran away."""
    nonsense = [f"{name} is {value}" for name, value in values.items() if not math.isfinite(value)]
    if reason := "; ".join(filter(None, [find_runaway(values), *nonsense])):
        return replace(row, status=Status.FAILED, reason=reason)
    return replace(row, values=values, spreads=spreads)


def compare_projects(
    base: Version,
    head: Version,
    scenes: Sequence[str] = points.SCENES,
    methods: Sequence[str] = (),
    processes: int = PROCESSES,
    tell: Progress = lambda share, what: None,
) -> ProjectComparison:
    """Return the comparison of an earlier and a later version of a project, with a number of processes of each for times.

    Scenes and methods are registered names; by default the scenes of the suite, and all methods with the role `Role.OURS`.

    Raises
    ------
    BadInput
        This process does not have a scene, or neither version has one of the methods, or any.
    """
    for name in scenes:
        define_scene(name)  # before any work
    truths = remember_truths()
    with closing(ProjectSide(base, methods, truths)) as was, closing(ProjectSide(head, methods, truths)) as now:
        made: ProjectComparison = compare((was, now), scenes, tell)
        if unknown := find_unknown(methods, {line.setting for line in made.lines}):
            raise BadInput("methods", ", ".join(unknown), "methods that a version has, without engines in environments")
        if not made.lines:
            raise BadInput("methods", "none", "a project that registers methods, or names of methods")
        good = [
            (line.scene, line.setting)
            for line in made.lines
            if all(each and each.status is Status.PASSED and not each.reason for each in line.results)
        ]
        times = compare_times(was, now, good, processes, tell)
        lines = (replace(line, times=times.get((line.scene, line.setting))) for line in made.lines)
        return replace(made, lines=tuple(lines))


def find_unknown(methods: Sequence[str], settings: Collection[str]) -> list[str]:
    """Return the methods of which no version has a setting."""
    families = {setting.partition(":")[0] for setting in settings}
    return [name for name in methods if name.partition(":")[0] not in families]


def judge(comparison: ProjectComparison) -> Verdict:
    """Return the verdict on the last step of a comparison: the gate's on values, and rows that are slower."""
    (base, head), steps = comparison.versions, list(comparison.steps)
    before = {was.id: was for _, was, _ in steps if was is not None and was.status is Status.PASSED}
    baseline = update_baseline(None, [Results("", before)], f"measured alongside {head.name}")
    verdict = gate.judge(baseline, Results("", {now.id: now for _, _, now in steps if now is not None}))
    slower = []
    for line in comparison.lines:
        if (time := line.times) and time.failed:
            last = time.again or time.first
            longer = time.reason or f"{last.value:.3f} times as long ({last.low:.3f} to {last.high:.3f})"
            most = f"at most {1 + SLOWER:g} times as long"
            slower.append(Violation(TIME, line.scene, line.setting, f"{time.was:.3g} s", longer, most))
    notes = (*(note for step in steps for note in _notes(*step)), *_packages(base, head))
    return Verdict((*verdict.violations, *slower), notes, len(comparison.lines))


def _notes(line: ProjectLine, was: Row | None, now: Row | None) -> Iterator[str]:
    """Yield the notes on a row: missing rows, reasons of rows without values, and times that changed."""
    name, time = f"{line.scene}, {line.setting}", line.times
    for when, row in (("was", was), ("is", now)):
        if row is None:
            yield f"{name}: {when} not there"
        elif row.status is not Status.SKIPPED and row.reason:
            yield f"{name}: {when} without values: {row.reason}"
    if time and time.again and not time.failed:
        yield f"{name}: looked slower ({time.first.value:.3f}), and was not when measured again ({time.again.value:.3f})"
    if time and not math.isnan(time.first.high) and time.first.high < 1 / (1 + SLOWER):
        yield f"{name}: faster, {time.first.value:.3f} of the time"


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
