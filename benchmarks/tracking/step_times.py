"""What a step takes in each version, in rounds that go through all of them: one version computes at a time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise

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

TIME_FACTOR = 1.25
"""Times differ from this factor on."""
StepTimes = tuple[float, ...]
"""Shortest time of a step, s, in each repeat."""


def time_versions(study: Study, scene: Scene, methods: Mapping[str, Method]) -> dict[str, StepTimes]:
    """Return what a step takes by version; versions whose run does not reach its end are left out.

    Where a time seems to differ from that of the version before, all are measured again: a real difference shows again.
    """
    grid = keep_end(grid_for(scene, scene.dt))
    cases = {version: shorten(study, Case(study.name, scene, method, grid)) for version, method in methods.items()}
    tried = {version: attempt_here(study.hang_limit, case, study.skip_missing) for version, case in cases.items()}
    ready = {
        version: TimedRun(*lengthen(cases[version], done, study.hang_limit), done)
        for version, done in tried.items()
        if isinstance(done, Success)
    }
    times = _repeats(study, ready, range(REPEATS))
    if any(differ(was, now) for was, now in pairwise(times.values())):
        again = _repeats(study, ready, range(REPEATS, 2 * REPEATS))
        return {version: times[version] + again[version] for version in ready}
    return times


def _repeats(study: Study, ready: Mapping[str, TimedRun], seeds: range) -> dict[str, StepTimes]:
    repeats = [_repeat(study, ready, seed) for seed in seeds]
    return {version: tuple(repeat[version] for repeat in repeats) for version in ready}


def _repeat(study: Study, ready: Mapping[str, TimedRun], seed: int) -> dict[str, float]:
    runs = {version: timed.done.run for version, timed in ready.items()}
    timings = time_interleaved(runs, ROUNDS, budget=study.timing_budget, seed=seed)
    steps = {version: timed.done.trajectory.counters.steps or math.nan for version, timed in ready.items()}
    return {version: timings[version].minimum / steps[version] for version in ready}


def differ(was: StepTimes, now: StepTimes) -> bool:
    """Return whether every time (n,), s, of one version is longer than every time of the other by `TIME_FACTOR`."""
    if not was or not now:
        return False
    return min(now) > TIME_FACTOR * max(was) or min(was) > TIME_FACTOR * max(now)


def ratio(was: StepTimes, now: StepTimes) -> Spread:
    """Return how many times as long a step takes, of the shortest times, and of the repeats one by one: no unit."""
    return Spread.of([min(now) / min(was), *(b / a for a, b in zip(was, now, strict=True))])
