"""What a step takes in each version, in rounds that go through all of them: one version computes at a time."""

from __future__ import annotations

import math
from collections.abc import Mapping

from conservative.method import Method, grid_for
from conservative.scene import Scene

from ..measures.timing import time_interleaved
from ..studies.case import Case, Success
from ..studies.speed import TimedRun, keep_end, lengthen, shorten
from ..studies.study import Study
from ..studies.time_limit import attempt_here
from .observation import Spread

REPEATS = 3
"""How often all rounds are measured: what differs between repeats is noise."""
ROUNDS = 3
"""Rounds of a repeat; the fastest call of them counts."""

StepTimes = tuple[float, ...]
"""Shortest time of a step, s, in each repeat."""


def time_versions(study: Study, scene: Scene, methods: Mapping[str, Method]) -> dict[str, StepTimes]:
    """Return what a step takes by version; versions whose run does not reach its end are left out."""
    grid = keep_end(grid_for(scene, scene.dt))
    cases = {version: shorten(study, Case(study.name, scene, method, grid)) for version, method in methods.items()}
    tried = {version: attempt_here(study.hang_limit, case, study.skip_missing) for version, case in cases.items()}
    ready = {
        version: TimedRun(*lengthen(cases[version], done, study.hang_limit), done)
        for version, done in tried.items()
        if isinstance(done, Success)
    }
    repeats = [_repeat(study, ready, seed) for seed in range(REPEATS)]
    return {version: tuple(repeat[version] for repeat in repeats) for version in ready}


def _repeat(study: Study, ready: Mapping[str, TimedRun], seed: int) -> dict[str, float]:
    runs = {version: timed.done.run for version, timed in ready.items()}
    timings = time_interleaved(runs, ROUNDS, budget=study.timing_budget, seed=seed)
    steps = {version: timed.done.trajectory.counters.steps or math.nan for version, timed in ready.items()}
    return {version: timings[version].minimum / steps[version] for version in ready}


def ratio(before: StepTimes, after: StepTimes) -> Spread:
    """Return how many times as long a step takes after, from the repeats one by one: no unit."""
    ratios = sorted(b / a for a, b in zip(before, after, strict=True))
    return Spread.of([ratios[len(ratios) // 2], *ratios])
