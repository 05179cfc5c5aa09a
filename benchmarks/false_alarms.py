"""How often the time gate is wrong, measured: `python -m benchmarks.false_alarms --runs 100`.

Every run is a process of its own, as a run of the gate is. It measures the time ratio of each timed point of the suite as it is
(an alarm is false), and of one whose method takes a fifth more steps than it says (no alarm is a miss). The thresholds come
from the first runs, in the way a baseline gets them, and the runs after those are judged, also as the gate does it.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Literal

from conservative.method import Grid, Method, Run
from conservative.registry import method as named
from conservative.registry import scene
from conservative.scene import Scene

from . import points, yardstick
from .baseline import time_limit

SLOWED = ("brick_flip", "reduced")
"""Scene and method that are also measured slower."""
SLOW = "slowed"


@dataclass(frozen=True)
class Slower(Method):
    """A method that is really slower: it takes `factor` times as many steps as it is asked for and says."""

    inner: Method
    factor: float

    family: ClassVar[str] = "slower"
    room: ClassVar[Literal["ours", "engine", "truth"]] = "ours"

    @property
    def name(self) -> str:
        return self.inner.name

    @property
    def order(self) -> int | None:
        return self.inner.order

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        n = round(grid.n_steps * self.factor)
        return self.inner.prepare(scene, Grid(grid.dt, n, n))


def ratios(limits: Mapping[str, float]) -> dict[str, float]:
    """Return the time ratio of every timed point of the suite, and of the slowed one, measured as a run of the gate does."""
    slowed = points.Point(scene(SLOWED[0]), Slower(named(SLOWED[1]), 1.2))
    found = {point.id: point for point in timed()} | {SLOW: slowed}
    measures = {name: partial(yardstick.time_ratio, point.method, point.scene, point.scene.dt) for name, point in found.items()}
    first = {name: measure() for name, measure in measures.items()}
    return {name: yardstick.confirmed(first[name], limits.get(name, math.inf), measures[name]) for name in first}


def timed() -> list[points.Point]:
    """Return the points whose time is gated."""
    return [point for point in points.points() if point.timed and not point.method.unsupported(point.scene)]


def limits_from(runs: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Return the largest ratio that passes, by row; that of the slowed row is the one of the row it is a slower version of."""
    names = [name for name in runs[0] if name != SLOW]
    limits = {name: time_limit([run[name] for run in runs], len(names)).limit for name in names}
    return limits | {SLOW: limits[points.Point(scene(SLOWED[0]), named(SLOWED[1])).id]}


def summary(runs: Sequence[Mapping[str, float]], limits: Mapping[str, float]) -> dict[str, Any]:
    """Return how many runs had a false alarm and which, and how many caught the slow-down."""
    alarms = [[name for name in run if name != SLOW and run[name] > limits[name]] for run in runs]
    return {
        "runs": len(runs),
        "rows": len(limits) - 1,
        "runs with a false alarm": sum(map(bool, alarms)),
        "rows with a false alarm": sorted({name for each in alarms for name in each}),
        "slow-downs of 20 % caught": sum(run[SLOW] > limits[SLOW] for run in runs),
    }


def main() -> None:
    """Run, and print one JSON object."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.false_alarms", description=__doc__)
    parser.add_argument("--runs", type=int, default=100, help="runs that are judged")
    parser.add_argument("--learning", type=int, default=10, help="runs before those, from which the thresholds come")
    parser.add_argument("--once", metavar="LIMITS", help="print the ratios of one run, in this process; limits as JSON")
    options = parser.parse_args()
    if options.once:
        print(json.dumps(ratios(json.loads(options.once))))
        return
    limits = limits_from([_process({}) for _ in range(options.learning)])
    print(json.dumps(summary([_process(limits) for _ in range(options.runs)], limits), indent=1))


def _process(limits: Mapping[str, float]) -> dict[str, float]:
    command = [sys.executable, "-m", "benchmarks.false_alarms", "--once", json.dumps(limits)]
    found: dict[str, float] = json.loads(subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout)
    return found


if __name__ == "__main__":
    main()
