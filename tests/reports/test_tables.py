import math

import pytest

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import frame
from conservative.errors import Diverged
from conservative.outcome import Outcome, OutcomeKind
from conservative.reports import labels
from conservative.reports.tables import cells, orders, runs, scene

from . import rows

DIVERGED = Diverged(1.0, "").outcome


def row(study, measure, value, dt=0.01, method="reduced", label="conservative==0.1.0/reduced", **fields):
    return rows.row(study, method, measure, value, dt, label=label, **fields)


def cannot(reason, kind="unsupported"):
    return Outcome(OutcomeKind(kind), reason)


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (1.0, "1"), (0.0123, "0.012"), (1.234e-5, "1.2e-05"), (-2e6, "-2.0e+06"), (math.nan, "–")],
)
def test_number(value, text):
    assert cells.number(value) == text


@pytest.mark.parametrize(
    ("method", "label", "text"),
    [
        ("mujoco", "mujoco==4.0.0/RK4", "mujoco 4.0.0 RK4"),
        ("pinocchio", "pin==4.1.0/aba+RK4", "pinocchio 4.1.0 aba+RK4"),
        ("gauss:stages=2", "conservative==0.1.0/gauss:stages=2", "gauss stages=2"),
        ("mujoco:integrator=Euler", "mujoco:integrator=Euler", "mujoco integrator=Euler"),
    ],
)
def test_what_a_method_is_called(method, label, text):
    assert labels.display_name(method, label) == text
    assert labels.family(text) == labels.family(method)


def test_name_without_tolerance():
    assert labels.without_tolerance("heyoka 7.13.2 tol=1e-06,body") == "heyoka 7.13.2 body"
    assert labels.without_tolerance("scipy 1.17.1 DOP853,rtol=1e-09") == "scipy 1.17.1 DOP853"
    assert labels.without_tolerance("reduced") == "reduced"


def test_drift_is_that_of_the_scenes_own_step():
    found = [row("paper", "energy drift max", 2e-16), row("paper", "energy drift max", 5e-16, dt=0.005)]
    found += [row("paper", "energy drift slope", 3e-18), row("paper", "energy drift slope stderr", 1e-18)]
    found += [row("paper", "orthonormality max", 4e-16)]
    header, body = scene.drift(frame(found), "made_up")
    assert header == ["method", "energy", "energy, 1/s", "orthonormality"]
    assert body == [["reduced", "2.0e-16", "3.0e-18 ± 1e-18", "4.0e-16"]]


def test_time_is_in_steps_of_reduced_too():
    found = [row("speed", "time per step", 5e-8), row("speed", "time per simulated second", 5e-6, detail="9 rounds")]
    engine = {"method": "mujoco", "label": "mujoco==4.0.0/RK4"}
    found += [row("speed", "time per step", 6e-6, **engine), row("speed", "time per simulated second", 6e-4, **engine)]
    body = scene.time(frame(found), "made_up")[1]
    assert body[0][:3] == ["reduced", "1", "50"]
    assert body[1][:3] == ["mujoco 4.0.0 RK4", "120", "6e+03"]
    assert body[0][-1] == "9 rounds"


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


def test_markdown_escapes_what_would_end_a_cell():
    assert cells.markdown((["a", "b"], [["|w|", "1"]])) == "| a | b |\n| --- | ---: |\n| \\|w\\| | 1 |"
