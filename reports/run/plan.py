"""What a report is made of: scenes, methods, studies, and how long each takes against the others."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise
from typing import TypedDict, Unpack

from conservative.benchmarks.studies import engine_selection, many_runs, random, selection, studies
from conservative.benchmarks.studies.study import Study
from conservative.check import positive_number
from conservative.method import Method
from conservative.scene import Scene

from .locks import Lock, locks_of

SECONDS = {
    "paper": 1.4,
    "convergence": 1.0,
    "speed": 1.0,
    "work_precision": 2.5,
    "each_step": 0.3,
    "stability": 1.0,
    "hard_cases": 2.0,
    "engines_at_one_step": 0.7,
    "engines_over_steps": 1.5,
    "long_runs": 0.7,
    "sphere_curves": 0.3,
    "paper_figures": 0.1,
    "import_time": 0.1,
    "random": 0.15,
    "throughput": 6.0,
}
"""How long each study takes for one scene and one method, roughly: for the time left."""
RENDERING = {"pictures": 6.0, "page": 3.0}
"""How long, s, what comes after the measurements takes, roughly."""
QUICK = 0.3
"""How much of that a quick report takes."""
BODIES, QUICK_BODIES = 3, 1
"""Random bodies in each field of a report, and of a quick one, unless it is told otherwise."""


@dataclass(frozen=True)
class Plan:
    """What a report is made of.

    Raises
    ------
    BadInput
        A name or a setting is unknown, or the limit is not a finite duration above 0.
    MissingEngine
        An engine is not installed, and `skip_missing` is False.
    """

    scenes: tuple[Scene, ...]
    methods: tuple[Method, ...]
    quick: bool = False
    skip_missing: bool = False
    png: bool = False
    hard: bool = False
    time_limit: float | None = None
    engines: tuple[Method, ...] = ()
    bodies: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        if self.time_limit is not None:
            positive_number("time_limit", self.time_limit, "a finite duration above 0, s")
        if not self.skip_missing:
            for method in (*self.methods, *self.engines):
                _ = method.label  # has the engine's version, so it raises `MissingEngine` before any work

    @cached_property
    def locks(self) -> tuple[Lock, ...]:
        """The locks of the environments that engines run in."""
        return locks_of((*self.methods, *self.engines))

    @cached_property
    def studies(self) -> tuple[Study, ...]:
        """What is measured, in this order: engines only where some are named, hard cases only where nobody asked for less.

        Random bodies come first, as the report shows them first.

        Studies of the same scenes and methods share their truths.
        """
        crossed = studies.cross_studies(self.scenes, self.methods, self.quick, self.skip_missing, self.time_limit)
        hard = studies.list_hard_studies(self.methods, self.skip_missing, self.time_limit) if self.hard else ()
        limits = (self.quick, self.skip_missing, self.time_limit)
        engines = studies.list_engine_studies(self.scenes, self.engines, *limits) if self.engines else ()
        return (*self._random, *crossed, *engines, *hard, *self._throughput)

    @cached_property
    def _random(self) -> tuple[Study, ...]:
        """The study of random bodies, where the report has some and a method for them."""
        methods = random.select(self.methods)
        if not (self.bodies and methods):
            return ()
        return (studies.random_study(methods, self.bodies, self.seed, self.quick, self.skip_missing),)

    @cached_property
    def _throughput(self) -> tuple[Study, ...]:
        """The study of many bodies, where the report has random ones and a method that runs many at once.

        It is the coarse one, of one setting of each family, and a quick report has none: preparing engines takes minutes.
        """
        methods = tuple(many_runs.families((*self.methods, *self.engines), quick=True))
        if self.quick or not (self.bodies and methods):
            return ()
        limits = {"skip_missing": self.skip_missing, "time_limit": self.time_limit}
        return (studies.throughput_study(methods, quick=True, seed=self.seed, **limits),)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the studies. Each is measured in one process, so that its times can be compared."""
        return tuple(study.name for study in self.studies)

    def spans(self, names: Iterable[str]) -> dict[str, tuple[float, float]]:
        """Return when each of the studies named begins and ends, and each part of rendering, as shares of all the time."""
        factor = QUICK if self.quick else 1.0
        costs = {name: factor * self._pairs(name) * SECONDS[name] for name in names}
        costs |= {name: factor * seconds for name, seconds in RENDERING.items()}
        ends = [end / sum(costs.values()) for end in accumulate(costs.values())]
        return dict(zip(costs, pairwise([0.0, *ends]), strict=True))

    def _pairs(self, name: str) -> int:
        """Return how many pairs of a scene and a method a study is about as long as."""
        if name in (studies.RANDOM, studies.THROUGHPUT):
            return sum(len(study.scenes) * len(study.methods) for study in self.studies if study.name == name)
        return len(self.scenes) * len(self.engines if name in studies.ENGINES else self.methods)


class Extent(TypedDict, total=False):
    """How much a report measures, by keyword: fields of `Plan`, with engines by name and the number of bodies left open."""

    quick: bool
    skip_missing: bool
    png: bool
    time_limit: float | None
    engines: Iterable[str]
    bodies: int | None
    seed: int


def plan_report(scenes: list[str], methods: list[str], **extent: Unpack[Extent]) -> Plan:
    """Return the plan for scenes, methods and engines by name.

    No scene stands for the default ones, no method for every registered one, and no engine for none. The number of random
    bodies is by default `BODIES` or `QUICK_BODIES`, and 0 where scenes are named.
    """
    quick, skip_missing = extent.get("quick", False), extent.get("skip_missing", False)
    engines, bodies = extent.get("engines", ()), extent.get("bodies")
    usual = 0 if scenes else QUICK_BODIES if quick else BODIES
    return Plan(
        scenes=selection.scenes(scenes) if scenes else selection.scenes(),
        methods=selection.methods(methods or None, skip_missing),
        quick=quick,
        skip_missing=skip_missing,
        png=extent.get("png", False),
        hard=not (scenes or quick),
        time_limit=extent.get("time_limit"),
        engines=engine_selection.select_engines(engines, skip_missing) if engines else (),
        bodies=usual if bodies is None else bodies,
        seed=extent.get("seed", 0),
    )
