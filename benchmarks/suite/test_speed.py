"""Wall time of every method on every scene, in its own loop, with accuracy in `extra_info`; and the ratios that we claim."""

from collections.abc import Callable
from functools import partial
from typing import Any

import pytest

from conservative.benchmarks.gate.results import TIME_RATIO, find_runaway
from conservative.benchmarks.gate.stash import REPEAT
from conservative.benchmarks.gate.yardstick import time_ratio, time_ratio_elsewhere
from conservative.benchmarks.measures.timing import prepare_and_run, time_interleaved
from conservative.benchmarks.studies.case import Case, Success, attempt
from conservative.benchmarks.studies.speed import keep_end, lengthen
from conservative.benchmarks.suite import points
from conservative.benchmarks.suite.points import Point
from conservative.deferred_imports import kernels
from conservative.integration.one import integrate
from conservative.method import Method, Role, grid_for
from conservative.registry import list_families
from conservative.registry import method as named
from conservative.registry import scene as registered
from conservative.scene import Scene

POINTS = [pytest.param(point, id=point.id) for point in points.points()]
RATIOS, CALLS = "33f1e1d237a63627", "b069cf647739a756"
"""Fixed ids: these rows gate nothing, so editing the test must not change their definition."""
FEW_STEPS, OVERHEAD_GOAL = 5, 20
STEP_GOALS = {"mujoco:Euler": 25, "mujoco:RK4": 100, "convected": 100}
"""How many times longer than a step of `reduced` a step of these methods is meant to take."""


@pytest.mark.parametrize("point", POINTS)
def test_speed(request: pytest.FixtureRequest, benchmark: Any, point: Point) -> None:
    scene, method = point.scene, point.method
    reason = method.unsupported(scene)
    if reason:
        pytest.skip(reason)
    benchmark.group = scene.name
    grid = keep_end(point.grid)
    run, found, cost = prepare_and_run(lambda: method.prepare(scene, grid))
    last = method.check(scene, grid, found)
    if method.role == Role.ENGINE and not last.ok:
        pytest.xfail(f"{method.label}: {last.outcome}")  # a finding, which the studies report, and no time to compare
    assert last.ok, last.outcome
    values = points.measure(point)
    runaway = find_runaway({name: found.value for name, found in values.items()})
    if method.role == Role.ENGINE and runaway:
        pytest.xfail(f"{method.label}: {runaway}")
    assert not runaway
    benchmark.extra_info.update(point.labels, order=method.order, prepare_s=cost.prepare, first_call_s=cost.first_call)
    benchmark.extra_info.update({name: found.value for name, found in values.items()})
    benchmark.extra_info["spreads"] = {name: found.spread for name, found in values.items()}
    if point.timed:
        benchmark.extra_info[TIME_RATIO] = time_ratio(method, scene, scene.dt)
        request.node.stash[REPEAT] = partial(time_ratio_elsewhere, scene.name, method.name)
    benchmark(run)


def test_step_ratios(benchmark: Any) -> None:
    """Times per step of a free body relative to those of `reduced`, in one interleaved run; nothing is asserted."""
    scene = registered(points.PAPER[0])
    ready = {name: long_run(scene, named(name)) for name in ("reduced", *STEP_GOALS)}
    timings = time_interleaved({name: done.run for name, (_, done) in ready.items()}, rounds=15)
    per_step = {name: timings[name].minimum / case.grid.n_steps for name, (case, _) in ready.items()}
    labels = {name: case.method.label for name, (case, _) in ready.items()}
    benchmark.group = f"{scene.name}, ratios"
    benchmark.extra_info["definition"] = RATIOS
    own = per_step["reduced"]
    for name, goal in STEP_GOALS.items():
        benchmark.extra_info[f"{labels[name]} / reduced (goal {goal:g})"] = per_step[name] / own
    benchmark.extra_info["reduced, s a step"] = own
    benchmark(ready["reduced"][1].run)


def test_call_overhead(benchmark: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a call of `integrate` costs beside its kernel, us, a few steps with a sample of each; nothing is asserted."""
    runs: dict[str, Callable[[], Any]] = {}
    for method in compiled_methods():
        scene = next(scene for scene in map(registered, points.PAPER) if not method.unsupported(scene))
        call = partial(integrate, scene, scene.dt, method, FEW_STEPS * scene.dt)
        runs[method.name] = call
        runs[f"kernel of {method.name}"] = kernel_alone(call, method, monkeypatch)
    timings = time_interleaved(runs, rounds=15, min_time=0.002)
    benchmark.group = "calls"
    benchmark.extra_info["definition"] = CALLS
    for method in compiled_methods():
        over = timings[method.name].minimum - timings[f"kernel of {method.name}"].minimum
        benchmark.extra_info[f"{method.name}, us (goal {OVERHEAD_GOAL})"] = 1e6 * over
    scene = registered(points.PAPER[0])
    benchmark(partial(integrate, scene, scene.dt, t_end=FEW_STEPS * scene.dt))  # with the default method


def compiled_methods() -> list[Method]:
    """Return the settings of the families whose steps are one call of a kernel."""
    return [method for family in list_families().values() if family.kernel for method in family.variants()]


def kernel_alone(call: Callable[[], Any], method: Method, monkeypatch: pytest.MonkeyPatch) -> Callable[[], Any]:
    """Return the kernel with what `call` hands to it."""
    module = kernels(method.kernel)
    enter, handed = module.enter, []

    def record(*arguments: Any) -> Any:
        handed.append(arguments)
        return enter(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(module, "enter", record)
        call()
    return partial(enter, *handed[0])


def long_run(scene: Scene, method: Method) -> tuple[Case, Success]:
    """Return a run so long that what a call costs beside its steps does not count."""
    case = Case("ratios", scene, method, keep_end(grid_for(scene, scene.dt)))
    done = attempt(case)
    assert isinstance(done, Success), done
    return lengthen(case, done)
