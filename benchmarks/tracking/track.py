"""Compare versions of an engine: the same scenes, settings and steps in each, and the changes from one to the next."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise

from conservative import registry
from conservative.errors import BadInput
from conservative.grid import grid_for
from conservative.method import Method
from conservative.references.environments.engine_method import EngineMethod
from conservative.references.environments.environment import Environment
from conservative.scene import Scene

from ..measures.timing import time_interleaved
from ..studies import selection
from ..studies.case import Case, Success
from ..studies.speed import TimedRun, keep_end, lengthen, shorten
from ..studies.study import Progress, Study
from ..studies.time_limit import attempt_here
from .changes import Change, StepTimes, differ, find_changes, ratio
from .observation import Observation, Spread, fit_orders, observe

REPEATS = 3
"""Repeats of all rounds: a difference between repeats is noise."""
ROUNDS = 3
"""Rounds of a repeat; the fastest call counts."""


@dataclass(frozen=True)
class Plan:
    """The versions, scenes and settings to compare.

    Attributes
    ----------
    environments
        Environments of the versions, in the order of comparison.
    scenes
        Scenes.
    methods
        For each setting its method in each version, by version.
    """

    environments: tuple[Environment, ...]
    scenes: tuple[Scene, ...]
    methods: tuple[Mapping[str, Method], ...]

    @property
    def engine(self) -> str:
        """Name of the engine."""
        return self.environments[0].engine

    @property
    def versions(self) -> tuple[str, ...]:
        """The versions, in the order of comparison."""
        return tuple(environment.version for environment in self.environments)


@dataclass(frozen=True)
class Line:
    """One setting on one scene, over all versions: observations, and times of a step in versions that reach the end."""

    scene: str
    setting: str
    observations: tuple[Observation, ...]
    times: Mapping[str, StepTimes]

    def time_ratio(self, version: str, to: str) -> Spread | None:
        """Return the time of a step in a version divided by that in another one; None if not known."""
        known = version in self.times and to in self.times
        return ratio(self.times[to], self.times[version]) if known else None


@dataclass(frozen=True)
class Transition:
    """The changes from one version to the next, with one setting on one scene; may be none."""

    was: Observation
    now: Observation
    changes: tuple[Change, ...]

    @property
    def lost(self) -> tuple[Change, ...]:
        """The changes by which the later version lost something."""
        return tuple(change for change in self.changes if change.lost)


@dataclass(frozen=True)
class History:
    """A plan and its results."""

    plan: Plan
    lines: tuple[Line, ...]

    @property
    def transitions(self) -> tuple[Transition, ...]:
        """The changes from each version to the next, version by version."""
        found = []
        for number in range(1, len(self.plan.versions)):
            for line in self.lines:
                was, now = line.observations[number - 1 : number + 1]
                times = line.times.get(was.version, ()), line.times.get(now.version, ())
                found.append(Transition(was, now, find_changes(was, now, *times)))
        return tuple(found)

    @property
    def lost_last(self) -> tuple[Transition, ...]:
        """The transitions to the last version by which it lost something."""
        last = self.plan.versions[-1]
        return tuple(each for each in self.transitions if each.lost and each.now.version == last)


def make_plan(environments: Iterable[Environment], settings: Iterable[str], scene_names: Iterable[str]) -> Plan:
    """Return the plan for the versions of an engine.

    Parameters
    ----------
    environments
        Two or more environments of one engine.
    settings
        As in the name of a method, `RK4` or `integrator=RK4`; by default those that tables show, and the engine as installed.
    scene_names
        By default those of a report that a setting supports.

    Raises
    ------
    BadInput
        There are fewer than two versions, one is there twice, or a setting or a scene is unknown.
    """
    found, settings, scene_names = tuple(environments), tuple(settings), tuple(scene_names)
    require_several([environment.version for environment in found])
    if not settings:  # those of the methods that tables show, and of the engine as installed
        family: type[EngineMethod] = registry.engine(found[-1].engine).at_version(found[-1].version)
        shown = (*family.settings_for("variants"), *family.settings_for("as_installed"))
        settings = tuple(dict.fromkeys(method.name.partition(":")[2] for method in shown))
    methods = tuple(
        {each.version: registry.method(f"{each.engine}@{each.version}:{setting}") for each in found} for setting in settings
    )
    scenes = selection.scenes(scene_names or selection.DEFAULT_SCENES)
    taken = tuple(scene for scene in scenes if any(each.unsupported(scene) is None for row in methods for each in row.values()))
    return Plan(found, scenes if scene_names else taken, methods)


def require_several(versions: list[str]) -> None:
    """Raise `BadInput` unless there are two versions or more, all different."""
    if len(set(versions)) < len(versions):
        twice = next(version for version in versions if versions.count(version) > 1)
        raise BadInput("versions", f"{twice!r} twice", "different versions")
    if len(versions) < 2:
        raise BadInput(
            "versions", f"{', '.join(versions) or 'none'}, nothing to compare", "two or more, --last N, or --against"
        )


def track(plan: Plan, progress: Progress, time_limit: float | None = None) -> History:
    """Return the history of an engine: all settings on all scenes in all versions.

    Raises
    ------
    BadInput
        No setting supports a scene, or the time limit of a run, s, is not a finite duration above 0.
    """
    methods = tuple(method for row in plan.methods for method in row.values())
    study = Study("track", plan.scenes, methods, quick=True, time_limit=time_limit)
    crossed = [(scene, row) for scene in plan.scenes for row in plan.methods]
    total = len(crossed) * (len(plan.versions) + 1)
    lines = []
    for place, (scene, row) in enumerate(crossed):
        seen = []
        for number, (version, method) in enumerate(row.items()):
            progress(place * (len(row) + 1) + number, total, f"{scene.name}: {method.label}")
            seen.append(observe(study, scene, method, version))
        progress((place + 1) * (len(row) + 1) - 1, total, f"{scene.name}: timing {seen[-1].setting}")
        good = {each.version: row[each.version] for each in seen if each.outcome.ok}
        lines.append(Line(scene.name, seen[-1].setting, fit_orders(seen), time_versions(study, scene, good)))
    return History(plan, tuple(lines))


def time_versions(study: Study, scene: Scene, methods: Mapping[str, Method]) -> dict[str, StepTimes]:
    """Return the times of a step by version, from rounds that go through all versions: one version computes at a time.

    Versions whose run does not reach its end are left out. If a time differs from that of the version before, all are measured
    again: a real difference appears again.
    """
    grid = keep_end(grid_for(scene, scene.dt))
    ready = {}
    for version, method in methods.items():
        case = shorten(study, Case(study.name, scene, method, grid))
        done = attempt_here(study.hang_limit, case, study.skip_missing)
        if isinstance(done, Success):
            ready[version] = TimedRun(*lengthen(case, done, study.hang_limit), done)
    times = _repeat(study, ready, range(REPEATS))
    if any(differ(was, now) for was, now in pairwise(times.values())):
        again = _repeat(study, ready, range(REPEATS, 2 * REPEATS))
        return {version: times[version] + again[version] for version in ready}
    return times


def _repeat(study: Study, ready: Mapping[str, TimedRun], seeds: range) -> dict[str, StepTimes]:
    runs = {version: timed.done.run for version, timed in ready.items()}
    repeats = [time_interleaved(runs, ROUNDS, budget=study.timing_budget, seed=seed) for seed in seeds]
    steps = {version: timed.done.trajectory.counters.steps or math.nan for version, timed in ready.items()}
    return {version: tuple(each[version].minimum / steps[version] for each in repeats) for version in ready}
