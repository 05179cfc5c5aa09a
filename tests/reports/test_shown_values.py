"""Commands show values under the names of their columns, angles in the unit beside them, and the faster one as faster."""

import math

import numpy as np
import pandas as pd
import pytest

import conservative as cv
from conservative.outcome import OK
from conservative.reports.animation.frames import make_panels
from conservative.reports.document import cells
from conservative.reports.document.model import Facts
from conservative.reports.rows.names import MethodClass
from conservative.reports.sections import run, speed, sweep

DRIFTS = {"energy": 1e-1, "momentum": 2e-2, "axial momentum": 3e-3}
SHOWN = {  # of the table of several methods: the values have different sizes, so that no two can be confused
    **{f"drift of {name}": value for name, value in DRIFTS.items()},
    "attitude error, rad": 4e-4,
    "rate error, rad/s": 5e-5,
    "steps": 6e6,
    "wall time, s": 7e-7,
}


def summary(method, factor):
    return {
        **{"scene": "body", "t_end": 1.0, "dt": 0.1, "method": method, "label": method, "typed": method, "outcome": OK},
        "drift": {name: factor * value for name, value in DRIFTS.items()},
        "error": {"attitude": factor * 4e-4, "rate": factor * 5e-5},
        "counters": {"steps": int(factor * 6e6)},
        "wall_time": factor * 7e-7,
        **{"orthonormality": 0.0, "last": None, "choice": None},
    }


def test_each_value_of_a_run_is_in_the_column_of_its_name_and_the_row_of_its_method():
    (table,) = run.build([summary("a", 1.0), summary("b", 0.5)]).blocks
    rows = {cells[0]: dict(zip(table.header, cells, strict=True)) for cells in table.rows}
    for method, factor in (("a", 1.0), ("b", 0.5)):
        found = {name: float(str(rows[method][name]).replace(",", "")) for name in SHOWN}
        assert found == pytest.approx({name: factor * value for name, value in SHOWN.items()}, rel=0.02)


def test_angles_of_a_sweep_are_in_the_unit_beside_them():
    angles = {"t": 1.0, "p5": 0.1, "p50": 0.5, "p95": 1.5}
    shown = {"scene": "body", "label": "a", "bodies": 3, "outcomes": {"ok": 3}, "spread": {}, "seed": 1, "failures": []}
    shown |= {"t_end": 1.0, "steps": 10, "dt": 0.1, "samples": 2, "found_before": 0, "wall_time": 1.0}
    shown |= {"error": {"asked": None, "estimate": None, "reason": "not estimated"}, "angle_from_mean": [angles]}
    shown |= {"bodies_per_second": 1.0, "body_steps_per_second": 1.0, "drift": {}}
    (facts,) = sweep.build(shown | {"out": None, "picture": None}).blocks
    assert isinstance(facts, Facts)
    (text,) = (value for name, value in facts.facts if name == "  at t = 1 s")
    numbers = [float(word.rstrip("°,")) for word in text.split() if word.rstrip(",").endswith("°")]
    assert numbers == pytest.approx([math.degrees(each) for each in (0.5, 0.1, 1.5)], rel=5e-3)


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (0.0547, "0.055"),
        (0.05, "0.05"),
        (1.0001e-10, "1.1e-10"),
        (0.07, "0.07"),
        (999999.5, "1.0e6"),
        (0.0, "0"),
        (-0.171, "-0.18"),
    ],
)
def test_an_error_or_a_drift_is_rounded_up(value, shown):
    assert cells.bound(value) == shown
    assert abs(float(shown)) >= abs(value)


@pytest.mark.parametrize(
    ("value", "shown"), [(0.0547, "0.055"), (2.38, "2.4"), (3.1137, "3.12"), (3.14159, "π"), (math.pi, "π")]
)
def test_an_attitude_error_is_not_above_the_largest_possible(value, shown):
    assert cells.angle(value) == shown


def test_no_size_is_shown_smaller_than_it_is():
    for value in 10 ** np.random.default_rng(7).uniform(-17, 8, 500):
        for digits in (1, 2, 3):
            assert (
                value
                <= float(cells.bound(value, digits).replace(",", "")) * (1 + 1e-15)
                <= value * (1 + 10.0 ** (1 - digits)) * (1 + 1e-14)
            )


@pytest.mark.parametrize(("ours", "theirs", "words"), [(1.0, 4.0, "4.0 times as fast as"), (4.0, 1.0, "4.0 times as slow as")])
def test_the_shorter_time_is_the_faster_one(ours, theirs, words):
    rows = [("mine", MethodClass.GENERAL, ours), ("solver", MethodClass.SOLVER, theirs), ("engine", MethodClass.ENGINE, theirs)]
    points = pd.DataFrame(
        [(name, kind, speed.MIDDLE, time) for name, kind, time in rows], columns=["name", "class", "error", "time"]
    )
    assert speed._sentence("a body", points).count(words) == 2


def test_the_arrow_of_momentum_is_as_long_as_the_momentum():
    scene = cv.scenes.brick_flip(t_end=1.0)
    lost = cv.integrate(scene, 0.01)
    lost.w_WB_B[:] *= np.exp(-lost.t)[:, None]  # a method that loses momentum
    times, (panel,) = make_panels([lost], ["lost"], None)
    np.testing.assert_allclose(np.linalg.norm(panel.L_W, axis=1), np.exp(-times), rtol=0.02)  # measured 0.01, of a frame's time
