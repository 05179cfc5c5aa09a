"""Wall time of every method on every scene, in its own loop, with accuracy in `extra_info`; and the ratios that we claim."""

from functools import cache
from typing import Any

import pytest

from benchmarks import selection
from benchmarks.cases import Case, Done, attempt
from benchmarks.cost import end_only, stretched
from benchmarks.errors import measure
from benchmarks.studies import reference
from benchmarks.timing import interleaved, prepared
from conservative.method import Method, grid_for
from conservative.registry import method as named
from conservative.scene import Scene
from conservative.trajectory import Trajectory

SHOWN = ("attitude error max", "rate error max", "energy drift max", "orthonormality max")
SCENES = selection.scenes()
POINTS = [
    pytest.param(scene, method, id=selection.identifier(scene, method, scene.dt))
    for scene in SCENES
    for method in selection.methods(skip_missing=True)
    if method.room != "truth"
]
GOALS = {"mujoco:Euler": 25, "mujoco:RK4": 100, "convected": 100}
"""How many times cheaper than these a step of `reduced` is meant to be on the brick."""


@cache
def truth(scene: Scene) -> Trajectory:
    exact: Trajectory = reference(scene, grid_for(scene, scene.dt)).trajectory
    return exact


@pytest.mark.parametrize(("scene", "method"), POINTS)
def test_speed(benchmark: Any, scene: Scene, method: Method) -> None:
    reason = method.unsupported(scene)
    if reason:
        pytest.skip(reason)
    benchmark.group = scene.name
    grid = grid_for(scene, scene.dt)
    run, last, cost = prepared(lambda: method.prepare(scene, end_only(grid)))
    if method.room == "engine" and not last.ok:
        pytest.xfail(f"{method.label}: {last.status}")  # a finding, which the studies report, and no time to compare
    assert last.status == "ok"
    found = {name: value for name, value, _ in measure(method.prepare(scene, grid)(), truth(scene))}
    benchmark.extra_info.update({name: found[name] for name in SHOWN})
    work = {name: count for name, count in vars(last.counters).items() if count is not None}
    benchmark.extra_info.update(label=method.label, order=method.order, prepare_s=cost.prepare, first_call_s=cost.first_call)
    benchmark.extra_info.update(work)
    benchmark(run)


def test_step_ratios(benchmark: Any) -> None:
    """Times per step on the brick relative to ours, from one interleaved run, beside the goals; nothing is asserted."""
    scene = SCENES[0]
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
