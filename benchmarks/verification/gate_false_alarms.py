"""How often the time gate is wrong, measured: `python -m conservative.benchmarks.verification.gate_false_alarms --runs 100`.

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
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

from conservative.method import Grid, Method, Role, Run
from conservative.registry import method as named
from conservative.registry import scene
from conservative.scene import Scene

from ..gate import yardstick
from ..gate.baseline import time_limit
from ..suite import points

SLOWED = ("brick_flip", "reduced")
"""Scene and method that are also measured slower."""
SLOW = "slowed"


@dataclass(frozen=True)
class Slower(Method):
    """A method that is really slower: it takes `factor` times as many steps as it is asked for and says."""

    inner: Method
    factor: float

    family: ClassVar[str] = "slower"
    role: ClassVar[Role] = Role.OURS

    @property
    def name(self) -> str:
        return self.inner.name

    @property
    def order(self) -> int | None:
        return self.inner.order

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        n = round(grid.n_steps * self.factor)
        return self.inner.prepare(scene, Grid(grid.dt, n, n))


def measures() -> dict[str, Callable[[], float]]:
    """Return what measures the time ratio of every timed point of the suite, and of the slowed one, by name."""
    slowed = points.Point(scene(SLOWED[0]), Slower(named(SLOWED[1]), 1.2))
    found = {point.id: point for point in list_timed_points()} | {SLOW: slowed}
    return {name: partial(yardstick.time_ratio, point.method, point.scene, point.scene.dt) for name, point in found.items()}


def list_timed_points() -> list[points.Point]:
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


def run_gate_once(limits: Mapping[str, float]) -> dict[str, float]:
    """Return the ratios of one run of the gate: all in one process, and those above their limits again in others."""
    first = _process(list(measures()))
    return {name: yardstick.confirm(first[name], limits.get(name, math.inf), partial(_alone, name)) for name in first}


def _alone(name: str) -> float:
    return _process([name])[name]


def _process(names: Sequence[str]) -> dict[str, float]:
    command = [sys.executable, "-m", "conservative.benchmarks.verification.gate_false_alarms", "--once", *names]
    found: dict[str, float] = json.loads(subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout)
    return found


def main() -> None:
    """Run, and print one JSON object for each run and one with the summary."""
    parser = argparse.ArgumentParser(
        prog="python -m conservative.benchmarks.verification.gate_false_alarms", description=__doc__
    )
    parser.add_argument("--runs", type=int, default=100, help="runs that are judge")
    parser.add_argument("--learning", type=int, default=10, help="runs before those, from which the thresholds come")
    parser.add_argument("--once", nargs="+", metavar="NAME", help="print the ratios of these rows, from this process")
    options = parser.parse_args()
    if options.once:
        known = measures()
        print(json.dumps({name: known[name]() for name in options.once}))
        return
    limits = limits_from([run_gate_once({}) for _ in range(options.learning)])
    runs = []
    for _ in range(options.runs):
        runs.append(run_gate_once(limits))
        print(json.dumps(runs[-1]), flush=True)
    print(json.dumps({"limits": limits, **summary(runs, limits)}, indent=1))


if __name__ == "__main__":
    main()
