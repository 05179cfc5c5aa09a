"""Wall time of every method on every scene, in its own loop, with accuracy in `extra_info`; and the ratios that we claim."""

from functools import partial
from typing import Any

import pytest

from benchmarks import points
from benchmarks.cases import Case, Done, attempt
from benchmarks.cost import end_only, stretched
from benchmarks.plugin import REPEAT
from benchmarks.points import Point
from benchmarks.timing import interleaved, prepared
from benchmarks.yardstick import elsewhere, time_ratio
from conservative.method import Method, grid_for
from conservative.registry import method as named
from conservative.registry import scene as registered
from conservative.scene import Scene

POINTS = [pytest.param(point, id=point.id) for point in points.points()]
GOALS = {"mujoco:Euler": 25, "mujoco:RK4": 100, "convected": 100}
"""How many times cheaper than these a step of `reduced` is meant to be on the brick."""


@pytest.mark.parametrize("point", POINTS)
def test_speed(request: pytest.FixtureRequest, benchmark: Any, point: Point) -> None:
    scene, method = point.scene, point.method
    reason = method.unsupported(scene)
    if reason:
        pytest.skip(reason)
    benchmark.group = scene.name
    run, last, cost = prepared(lambda: method.prepare(scene, end_only(point.grid)))
    if method.room == "engine" and not last.ok:
        pytest.xfail(f"{method.label}: {last.status}")  # a finding, which the studies report, and no time to compare
    assert last.status == "ok"
    gated = points.gated(point)
    benchmark.extra_info.update(point.labels, order=method.order, prepare_s=cost.prepare, first_call_s=cost.first_call)
    benchmark.extra_info.update({name: found.value for name, found in gated.items()})
    benchmark.extra_info["spreads"] = {name: found.spread for name, found in gated.items()}
    if point.timed:
        benchmark.extra_info["time ratio"] = time_ratio(method, scene, scene.dt)
        request.node.stash[REPEAT] = partial(elsewhere, scene.name, method.name)
    benchmark(run)


def test_step_ratios(benchmark: Any) -> None:
    """Times per step on the brick relative to ours, from one interleaved run, beside the goals; nothing is asserted."""
    scene = registered("brick_flip")
    ready = {name: long_run(scene, named(name)) for name in ("reduced", *GOALS)}
    timings = interleaved({name: done.run for name, (_, done) in ready.items()}, rounds=15)
    per_step = {name: timings[name].minimum / case.grid.n_steps for name, (case, _) in ready.items()}
    benchmark.group = f"{scene.name}, ratios"
    for name, goal in GOALS.items():
        label = ready[name][0].method.label
        benchmark.extra_info[f"{label} / reduced (goal {goal})"] = per_step[name] / per_step["reduced"]
    benchmark.extra_info["reduced, s a step"] = per_step["reduced"]
    benchmark(ready["reduced"][1].run)


def long_run(scene: Scene, method: Method) -> tuple[Case, Done]:
    """Return a run so long that what a call costs beside its steps does not count."""
    case = Case("ratios", scene, method, end_only(grid_for(scene, scene.dt)))
    done = attempt(case)
    assert isinstance(done, Done), done
    return stretched(case, done)
