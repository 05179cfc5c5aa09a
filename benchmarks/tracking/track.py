"""Track an engine over versions: the same scenes, settings and steps in each, and what changed from one to the next."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

from conservative import registry
from conservative.errors import BadInput
from conservative.method import Method
from conservative.references.environments.engine_method import EngineMethod
from conservative.references.environments.environment import Environment
from conservative.scene import Scene

from ..studies import selection
from ..studies.study import Progress, Study
from .changes import Change, find_changes
from .observation import Observation, Spread
from .observe import observe
from .orders import fit_orders
from .step_times import StepTimes, ratio, time_versions


@dataclass(frozen=True)
class Plan:
    """What is tracked.

    Attributes
    ----------
    environments
        Those of the versions, in the order in which they are compared.
    scenes
        On which scenes.
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
        """The versions, in the order in which they are compared."""
        return tuple(environment.version for environment in self.environments)


@dataclass(frozen=True)
class Line:
    """One setting on one scene, over all versions: what was seen, and what a step takes in those that reach the end."""

    scene: str
    setting: str
    observations: tuple[Observation, ...]
    times: Mapping[str, StepTimes]

    def time_ratio(self, version: str, to: str) -> Spread | None:
        """Return how many times as long a step takes in a version as in another one, without a unit; None if not known."""
        known = version in self.times and to in self.times
        return ratio(self.times[to], self.times[version]) if known else None


@dataclass(frozen=True)
class Transition:
    """What changed from one version to the next, with one setting on one scene; `changes` may be empty."""

    was: Observation
    now: Observation
    changes: tuple[Change, ...]

    @property
    def lost(self) -> tuple[Change, ...]:
        """The changes by which something is gone that was there."""
        return tuple(change for change in self.changes if change.lost)


@dataclass(frozen=True)
class History:
    """What was found: the plan that it is of, and its lines."""

    plan: Plan
    lines: tuple[Line, ...]

    @property
    def transitions(self) -> tuple[Transition, ...]:
        """What changed from each version to the next, version by version."""
        steps = [list(_transitions(line)) for line in self.lines]
        return tuple(transition for step in zip(*steps, strict=True) for transition in step)

    @property
    def lost_last(self) -> tuple[Transition, ...]:
        """The transitions to the last version by which something is gone."""
        last = self.plan.versions[-1]
        return tuple(each for each in self.transitions if each.lost and each.now.version == last)


def _transitions(line: Line) -> Iterator[Transition]:
    for was, now in pairwise(line.observations):
        times = line.times.get(was.version, ()), line.times.get(now.version, ())
        yield Transition(was, now, find_changes(was, now, *times))


def make_plan(environments: Iterable[Environment], settings: Iterable[str], scene_names: Iterable[str]) -> Plan:
    """Return what is tracked of the versions of an engine.

    Parameters
    ----------
    environments
        Of one engine, two or more.
    settings
        As a method's name has them, `RK4` or `integrator=RK4`; by default those that tables show, and the engine as installed.
    scene_names
        By default those of a report, without those that no setting takes.

    Raises
    ------
    BadInput
        There are fewer than two versions, one is there twice, or a setting or a scene is unknown.
    """
    found, settings, scene_names = tuple(environments), tuple(settings), tuple(scene_names)
    require_several([environment.version for environment in found])
    methods = tuple(_methods(found, settings))
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


def _methods(environments: tuple[Environment, ...], settings: tuple[str, ...]) -> Iterator[Mapping[str, Method]]:
    for setting in settings or _default_settings(environments[-1]):
        names = {each.version: f"{each.engine}@{each.version}:{setting}" for each in environments}
        yield {version: registry.method(name) for version, name in names.items()}


def _default_settings(environment: Environment) -> list[str]:
    """Return the settings of the methods that tables show, and of the engine as installed."""
    family: type[EngineMethod] = registry.engine(environment.engine).at_version(environment.version)
    methods = (*family.variants(), *filter(None, [family.user_defaults()]))
    return list(dict.fromkeys(method.name.partition(":")[2] for method in methods))


def track(plan: Plan, progress: Progress, time_limit: float | None = None) -> History:
    """Return the history of an engine: all settings on all scenes in all versions. `progress` is told what comes next.

    Raises
    ------
    BadInput
        There is no scene that a setting takes, or the time limit of a run, s, is not a finite duration above 0.
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
