"""Wall time of every method on every scene, in its own loop, with accuracy in `extra_info`; and the ratios that we claim."""

from collections.abc import Callable
from functools import partial
from typing import Any

import pytest

from conservative.benchmarks.gate.stash import REPEAT
from conservative.benchmarks.gate.yardstick import elsewhere, time_ratio
from conservative.benchmarks.measures.timing import interleaved, prepared
from conservative.benchmarks.studies.case import Case, Done, attempt
from conservative.benchmarks.studies.speed import end_only, stretched
from conservative.benchmarks.suite import points
from conservative.benchmarks.suite.points import Point
from conservative.lazy_kernels import kernels
from conservative.method import Method, Role, grid_for, integrate
from conservative.registry import method as named
from conservative.registry import scene as registered
from conservative.scene import Scene

POINTS = [pytest.param(point, id=point.id) for point in points.points()]
GOALS = {"mujoco:Euler": 25, "mujoco:RK4": 100, "convected": 100}
"""How many times cheaper than these a step of `reduced` is meant to be on the brick."""
KERNELS = {"reduced": "march", "gauss": "gauss", "moser_veselov": "moser_veselov", "lame": "lame", "projected": "projected"}
"""Modules in `conservative.kernels` by the families that they take the steps of."""
FEW_STEPS, OVERHEAD_GOAL = 5, 20


@pytest.mark.parametrize("point", POINTS)
def test_speed(request: pytest.FixtureRequest, benchmark: Any, point: Point) -> None:
    scene, method = point.scene, point.method
    reason = method.unsupported(scene)
    if reason:
        pytest.skip(reason)
    benchmark.group = scene.name
    run, last, cost = prepared(lambda: method.prepare(scene, end_only(point.grid)))
    if method.role == Role.ENGINE and not last.ok:
        pytest.xfail(f"{method.label}: {last.outcome}")  # a finding, which the studies report, and no time to compare
    assert last.ok, last.outcome
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


def test_call_overhead(benchmark: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a call of `integrate` costs beside its kernel, us, a few steps with a sample of each; nothing is asserted."""
    runs: dict[str, Callable[[], Any]] = {}
    for method in compiled():
        scene = next(scene for scene in map(registered, points.PAPER) if not method.unsupported(scene))
        call = partial(integrate, scene, scene.dt, method, FEW_STEPS * scene.dt)
        runs[method.name] = call
        runs[f"kernel of {method.name}"] = kernel_alone(call, method, monkeypatch)
    timings = interleaved(runs, rounds=15, min_time=0.002)
    benchmark.group = "calls"
    for method in compiled():
        over = timings[method.name].minimum - timings[f"kernel of {method.name}"].minimum
        benchmark.extra_info[f"{method.name}, us (goal {OVERHEAD_GOAL})"] = 1e6 * over
    benchmark(runs["reduced"])


def compiled() -> list[Method]:
    """Return the settings of those families of ours whose steps are one call of a kernel."""
    return [method for family in KERNELS for method in type(named(family)).variants()]


def kernel_alone(call: Callable[[], Any], method: Method, monkeypatch: pytest.MonkeyPatch) -> Callable[[], Any]:
    """Return the kernel with what `call` hands to it."""
    module = kernels(KERNELS[method.family])
    march, handed = module.march, []

    def recorded(*arguments: Any) -> Any:
        handed.append(arguments)
        return march(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(module, "march", recorded)
        call()
    return partial(march, *handed[0])


def long_run(scene: Scene, method: Method) -> tuple[Case, Done]:
    """Return a run so long that what a call costs beside its steps does not count."""
    case = Case("ratios", scene, method, end_only(grid_for(scene, scene.dt)))
    done = attempt(case)
    assert isinstance(done, Done), done
    return stretched(case, done)
