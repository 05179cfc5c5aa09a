"""What charts draw is in the unit that their axes name."""

import pandas as pd
import pytest

from conservative.benchmarks.measures.measure import Measure
from conservative.reports.charts import figures
from conservative.reports.charts.style import power_axis
from conservative.reports.tables import orders, work_precision

from .rows import frame, point, row, table


def axes(spec):
    """Yield channel, field and title of every axis of a chart."""
    for channel in ("x", "y"):
        found = spec.get("encoding", {}).get(channel, {})
        if found.get("axis"):
            yield channel, found["field"], found["axis"]["title"]
    for key in ("layer", "vconcat", "hconcat"):
        for part in spec.get(key, ()):
            yield from axes(part)


def drawn(spec, field):
    return sorted({each[field] for rows in spec["datasets"].values() for each in rows if field in each})


def test_time_against_error_is_in_microseconds_and_radians():
    points = work_precision.points(table(point("a", "ours", 1e-3, 2e-6, 0.2), point("a", "ours", 1e-6, 5e-6, 0.1)))
    spec = figures.work_precision(points, work_precision.front(points), "made_up").to_dict()
    assert set(axes(spec)) == {
        ("x", "error", "largest attitude error over the run, rad"),
        ("y", "microseconds", "wall time per simulated second, µs"),
    }
    assert drawn(spec, "microseconds") == pytest.approx([2.0, 5.0], rel=1e-12)
    assert drawn(spec, "error") == [1e-6, 1e-3]


def test_convergence_is_in_seconds_and_radians():
    rows = [row("convergence", "a", Measure.ATTITUDE_MAX, dt**2, dt) for dt in (0.4, 0.2, 0.1)]
    errors = orders.errors(frame(rows), Measure.ATTITUDE_MAX)
    spec = figures.convergence(errors, orders.fit_ends(orders.fits(errors)), "made_up").to_dict()
    assert set(axes(spec)) == {("x", "dt", "step, s"), ("y", "error", "largest attitude error over the run, rad")}


def test_drift_is_relative_over_seconds():
    drifts = pd.DataFrame({"family": "a", "name": "a", "t": [1.0, 2.0], "quantity": "energy", "drift": [0.0, 1e-9]})
    spec = figures.drift(drifts, "made_up").to_dict()
    (panel,) = spec["vconcat"]
    assert panel["encoding"]["x"]["title"] == "t, s"
    assert panel["encoding"]["y"]["axis"]["title"] == "largest so far, relative"
    assert drawn(spec, "shown") == [figures.FLOOR, 1e-9]


@pytest.mark.parametrize(("low", "high", "powers"), [(0.05, 200.0, [0.1, 1.0, 10.0, 100.0]), (1.0, 100.0, [1.0, 10.0, 100.0])])
def test_a_logarithmic_axis_has_a_label_at_each_power_of_ten(low, high, powers):
    assert power_axis("title", low, high).values == pytest.approx(powers)
