"""Wall time of every method on every scene, in its own loop, with accuracy in `extra_info`."""

from typing import Any

import pytest

from conservative.benchmarks.gate.results import find_runaway
from conservative.benchmarks.measures.timing import prepare_and_run
from conservative.benchmarks.studies.speed import keep_end
from conservative.benchmarks.suite import points
from conservative.benchmarks.suite.points import Point
from conservative.method import Role

POINTS = [pytest.param(point, id=point.id) for point in points.points()]


@pytest.mark.parametrize("point", POINTS)
def test_speed(benchmark: Any, point: Point) -> None:
    scene, method = point.scene, point.method
    reason = method.unsupported(scene)
    if reason:
        pytest.skip(reason)
    benchmark.group = scene.name
    grid = keep_end(point.grid)
    run, result, cost = prepare_and_run(lambda: method.prepare(scene, grid))
    last = method.check(scene, grid, result)
    if method.role == Role.ENGINE and not last.ok:
        pytest.xfail(f"{method.label}: {last.outcome}")  # a finding, which the studies report, and no time to compare
    assert last.ok, last.outcome
    values, spreads = points.measure(point)
    runaway = find_runaway(values)
    if method.role == Role.ENGINE and runaway:
        pytest.xfail(f"{method.label}: {runaway}")
    assert not runaway
    benchmark.extra_info.update(point.labels, order=method.order, prepare_s=cost.prepare, first_call_s=cost.first_call)
    benchmark.extra_info.update(values, spreads=spreads)
    benchmark(run)
