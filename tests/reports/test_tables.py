import math

import pytest

from conservative.benchmarks.measures.measure import Measure
from conservative.errors import Diverged
from conservative.outcome import Outcome, OutcomeKind
from conservative.reports import labels
from conservative.reports.tables import cells, orders, runs, scene

from . import rows
from .rows import frame

DIVERGED = Diverged(1.0, "").outcome


def row(study, measure, value, dt=0.01, method="reduced", **fields):
    return rows.row(study, method, measure, value, dt, **fields)


def cannot(reason, kind="unsupported"):
    return Outcome(OutcomeKind(kind), reason)


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (1.0, "1"), (0.0123, "0.012"), (1.234e-5, "1.2e-5"), (-2e6, "-2.0e6"), (math.nan, "–")],
)
def test_number(value, text):
    assert cells.number(value) == text


@pytest.mark.parametrize(
    ("parts", "text"),
    [
        (("mujoco", "4.0.0", "RK4"), "mujoco 4.0.0 RK4"),
        (("gauss", "", "stages=2"), "gauss stages=2"),
        (("reduced", "", ""), "reduced"),
    ],
)
def test_what_a_method_is_called(parts, text):
    assert labels.display_name(*parts) == text


def test_rows_have_the_names_of_their_method_and_of_their_line():
    found = frame([row("paper", "energy drift max", 1.0, method="heyoka", setting="tol=1e-06,body", series_setting="body")])
    assert found[["name", "line"]].to_numpy().tolist() == [["heyoka tol=1e-6,body", "heyoka body"]]


def test_drift_is_that_of_the_scenes_own_step():
    found = [row("paper", "energy drift max", 2e-16), row("paper", "energy drift max", 5e-16, dt=0.005)]
    found += [row("paper", "energy drift slope", 3e-18), row("paper", "energy drift slope stderr", 1e-18)]
    found += [row("paper", "orthonormality max", 4e-16)]
    header, body = scene.drift(frame(found), "made_up")
    assert header == ["method", "energy", "energy, 1/s", "orthonormality"]
    assert body == [["reduced", "2.0e-16", "3.0e-18 ± 1e-18", "4.0e-16"]]


def test_time_is_in_steps_of_reduced_too():
    found = [row("speed", "time per step", 5e-8), row("speed", "time per simulated second", 5e-6, detail="9 rounds")]
    engine = {"method": "mujoco", "version": "4.0.0", "setting": "RK4"}
    found += [row("speed", "time per step", 6e-6, **engine), row("speed", "time per simulated second", 6e-4, **engine)]
    body = scene.time(frame(found), "made_up")[1]
    assert body[0][:3] == ["reduced", "1", "50"]
    assert body[1][:3] == ["mujoco 4.0.0 RK4", "120", "6,000"]
    assert body[0][-1] == "9 rounds"


def test_what_is_paid_once_is_in_the_units_of_its_columns():
    found = [row("speed", "prepare time", 0.002), row("speed", "first call time", 0.03), row("speed", Measure.TIME, 4e-6)]
    header, body = scene.costs_paid_once(frame(found), "made_up")
    assert dict(zip(header, body[0], strict=True)) == {
        "method": "reduced",
        "prepare, ms": "2",
        "first call, ms": "30",
        "simulated second, µs": "4",
    }


def test_every_time_is_in_the_unit_of_its_column():
    measures = (Measure.TIME_PER_STEP, Measure.TIME_PER_STEP_MEDIAN, Measure.TIME, Measure.TIME_MEDIAN)
    found = [row("speed", measure, value) for measure, value in zip(measures, (1e-9, 2e-9, 3e-6, 4e-6), strict=True)]
    found += [row("speed", Measure.PREPARE, 5e-3), row("speed", Measure.FIRST_CALL, 6e-3)]
    header, ((_, *values, _),) = scene.time(frame(found), "made_up")
    assert header[2:8] == ["step, ns, min", "median", "simulated second, µs, min", "median", "prepare, ms", "first call, ms"]
    assert values[1:] == ["1", "2", "3", "4", "5", "6"]


def test_errors_have_the_unit_that_they_are_measured_in():
    found = [
        row("paper", Measure.ATTITUDE_MAX, 1.0),
        row("paper", Measure.ATTITUDE_FINAL, 2.0),
        row("paper", Measure.RATES_MAX, 3.0),
    ]
    assert scene.accuracy(frame(found), "made_up") == (
        [
            "method",
            *(
                f"{name}, dt 0.01"
                for name in ("attitude error max, rad", "attitude error final, rad", "rate error max, relative")
            ),
        ],
        [["reduced", "1", "2", "3"]],
    )


def order_table(found):
    table = frame(found)
    return scene.order(*(orders.fits(orders.errors(table, measure)) for measure in (Measure.ATTITUDE_MAX, Measure.RATES_MAX)))


def test_order_is_fitted_and_its_window_told():
    found = [
        row("convergence", measure, 3 * dt**2, dt=dt)
        for measure in (Measure.ATTITUDE_MAX, Measure.RATES_MAX)
        for dt in (0.08, 0.04, 0.02, 0.01)
    ]
    body = order_table(found)[1]
    assert body == [["reduced", "2.00 ± 0.00", "2.00 ± 0.00", "0.08 to 0.01", "4", "–"]]


def test_too_few_points_give_the_reason_and_no_order():
    found = [row("convergence", Measure.ATTITUDE_MAX, dt, dt=dt) for dt in (0.2, 0.1)]
    (cells,) = order_table(found)[1]
    assert cells[1] == "no order"
    assert "2 runs" in cells[3]


def test_failures_and_what_is_unsupported_are_told_apart():
    nan = math.nan
    found = [
        row("paper", "energy drift max", nan, outcome=DIVERGED),
        row("long_runs", "energy drift max", nan, outcome=DIVERGED),
        row("work_precision", "attitude error max", nan, outcome=cannot("for free bodies")),
        row("paper", "energy drift max", nan, outcome=cannot("for free bodies")),
        row("speed", "time per step", nan, outcome=cannot("pip install x", "missing")),
        row("convergence", "observed order", nan, dt=nan, outcome=cannot("2 points", "no order")),
    ]
    table = frame(found)
    assert runs.failures(table)[1] == [["made_up", "reduced", "diverged after t = 1 s", "paper, long_runs", "0.01"]]
    assert runs.unsupported(table)[1] == [
        ["made_up", "unsupported", "for free bodies", "reduced"],
        ["made_up", "missing", "pip install x", "reduced"],
    ]


def test_what_a_method_cannot_do_is_told_once_with_its_first_reason():
    found = [
        row("paper", "energy drift max", math.nan, method=method, outcome=cannot(reason))
        for method, reason in (("a", "2 > 1"), ("a", "3 > 1"), ("b", "for free bodies"), ("c", "for free bodies"))
    ]
    assert runs.unsupported(frame(found))[1] == [
        ["made_up", "unsupported", "2 > 1", "a"],
        ["made_up", "unsupported", "for free bodies", "b, c"],
    ]


def test_markdown_escapes_what_would_end_a_cell():
    assert cells.markdown((["a", "b"], [["|w|", "1"]])) == "| a | b |\n| --- | ---: |\n| \\|w\\| | 1 |"
