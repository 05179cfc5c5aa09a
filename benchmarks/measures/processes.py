"""Times from several processes that take turns.

The place of code and data in memory makes a loop several percent slower or faster for the life of a process: two identical
programs of heyoka differed by 3.5 % in the median case, and by 52 % in one, within a process. More rounds do not help. The runs
of a scene are therefore timed in several processes, each with all runs in interleaved rounds, so that a ratio has one value per
process, and `speed_ratio` an interval for it. Only one process works at a time. Each lives over all scenes of a study, so that
imports and compilation are paid once per process.

with Processes(study.processes) as processes:
    timings = processes.time(runs, prepares, limit, rounds=15, min_time=1e-4, budget=0.15)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, closing
from functools import partial
from typing import Any

from conservative.errors import IntegrationFailed
from conservative.pickling import NotTransferable
from conservative.references.worker.calls import python_worker, run_within

from .timing import Key, Timing, time_interleaved

PROCESSES, QUICK_PROCESSES = 5, 3
"""Processes of a study of times, and of a quick one. A default report has one."""


class Processes(ExitStack):
    """A number of processes: this one, and others that start with the first timing and end with the block."""

    def __init__(self, number: int = 1) -> None:
        super().__init__()
        self._others = [self.enter_context(closing(python_worker(show_output=True))) for _ in range(number - 1)]

    def time(
        self,
        runs: Mapping[Key, Callable[[], Any]],
        prepares: Mapping[Key, Callable[[], Callable[[], Any]]],
        limit: float,
        rounds: int,
        min_time: float,
        budget: float,
        shared: Sequence[object] = (),
    ) -> dict[Key, list[Timing]]:
        """Return the timing of each run in each process; several processes have half of the rounds and of the budget each.

        `runs` are prepared here. `prepares` prepare them elsewhere, such as `partial(method.prepare, scene, grid)`; functions
        that cannot be transferred are timed in this process only. Another process has `limit`, s, for all runs. For `shared`
        see `run_within`, for the others `time_interleaved`.
        """
        parts = 2 if self._others else 1
        how: dict[str, Any] = {"rounds": math.ceil(rounds / parts), "min_time": min_time, "budget": budget / parts}
        timings = {key: [timing] for key, timing in time_interleaved(runs, **how).items()}
        for number, other in enumerate(self._others if runs else (), start=1):
            work = partial(_time_there, [prepares[key] for key in runs], {**how, "seed": number})
            try:
                measured = run_within(limit, work, shared, other)
            except NotTransferable:
                break
            except IntegrationFailed as failure:  # the process crashed or took too long
                measured = [Timing(math.nan, math.nan, 0, 0, failure.outcome)] * len(runs)
            for key, timing in zip(runs, measured, strict=True):
                timings[key].append(timing)
        return timings


def _time_there(prepares: Sequence[Callable[[], Callable[[], Any]]], how: dict[str, Any]) -> list[Timing]:
    """Return the timing of each run, prepared here. All succeeded in another process: this process fails if one fails."""
    timings = time_interleaved({i: prepare() for i, prepare in enumerate(prepares)}, **how)
    return list(timings.values())
