"""Tables have the values they are given, in the unit of their header, and so do cards and columns of samples."""

import math
from itertools import chain
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import conservative as cv
from conservative.benchmarks.measures.measure import Measure
from conservative.errors import Diverged
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.reports.document import cells, markdown
from conservative.reports.document.model import Grade
from conservative.reports.rows import lines
from conservative.reports.rows.points import points
from conservative.reports.run import single_run
from conservative.reports.sections import failures, hard_cases, long_time, recommendation, scene_ratios, scenes
from conservative.reports.sections import run as single
from conservative.trajectory import Trajectory

from . import made_up, rows
from .rows import frame, point, texts

DIVERGED = Diverged(1.0, "").outcome


def row(study, measure, value, dt=0.01, method="reduced", **fields):
    return rows.row(study, method, measure, value, dt, **fields)


def cannot(reason, kind="unsupported"):
    return Outcome(OutcomeKind(kind), reason)


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (1.0, "1"), (0.0123, "0.012"), (1.234e-5, "1.2e-5"), (-2e6, "-2.0e6"), (-0.25, "-0.25"), (math.nan, "–")],
)
def test_number(value, text):
    assert cells.number(value) == text


def test_rows_have_the_names_of_their_method_and_of_their_line():
    found = frame([row("paper", "energy drift max", 1.0, method="heyoka", setting="tol=1e-06,body", series_setting="body")])
    assert found[["name", "line"]].to_numpy().tolist() == [["heyoka tol=1e-6,body", "heyoka body"]]


def test_drift_is_that_of_the_scenes_own_step():
    found = [row("paper", "energy drift max", 2e-16), row("paper", "energy drift max", 5e-16, dt=0.005)]
    found += [row("paper", "energy drift slope", 3e-18), row("paper", "energy drift slope stderr", 1e-18)]
    found += [row("paper", "orthonormality max", 4e-16)]
    found += [row("paper", Measure.PRECISION, 64.0, method="mujoco", outcome=DIVERGED)]  # no row of a run that failed
    table = scenes.drift(frame(found), "made_up")
    assert table.header == ["method", "energy", "energy, 1/s", "orthonormality"]
    assert texts(table) == [["reduced", "2.0e-16", "3.0e-18 ± 1e-18", "4.0e-16"]]


def test_time_is_in_steps_of_reduced_too():
    found = [row("speed", "time per step", 5e-8), row("speed", "time per simulated second", 5e-6, detail="9 rounds")]
    engine = {"method": "mujoco", "version": "4.0.0", "setting": "RK4"}
    found += [row("speed", "time per step", 6e-6, **engine), row("speed", "time per simulated second", 6e-4, **engine)]
    body = texts(scenes.time(frame(found), "made_up"))
    assert body[0][:3] == ["reduced", "1", "50"]
    assert body[1][:3] == ["mujoco 4.0.0 RK4", "120", "6,000"]
    assert body[0][-1] == "9 rounds"


def test_every_time_is_in_the_unit_of_its_column():
    measures = (Measure.TIME_PER_STEP, Measure.TIME_PER_STEP_MEDIAN, Measure.TIME, Measure.TIME_MEDIAN)
    found = [row("speed", measure, value) for measure, value in zip(measures, (1e-9, 2e-9, 3e-6, 4e-6), strict=True)]
    found += [row("speed", Measure.PREPARE, 5e-3), row("speed", Measure.FIRST_CALL, 6e-3)]
    table = scenes.time(frame(found), "made_up")
    ((_, *values, _),) = texts(table)
    assert table.header[2:8] == [
        "step, ns, min",
        "median",
        "simulated second, µs, min",
        "median",
        "prepare, ms",
        "first call, ms",
    ]
    assert values[1:] == ["1", "2", "3", "4", "5", "6"]


def test_errors_have_the_unit_that_they_are_measured_in():
    found = [
        row("paper", Measure.ATTITUDE_MAX, 1.0),
        row("paper", Measure.ATTITUDE_FINAL, 2.0),
        row("paper", Measure.RATES_MAX, 3.0),
    ]
    table = scenes.accuracy(frame(found), "made_up")
    assert (table.header, texts(table)) == (
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
    fits = (lines.fits(lines.errors(table, measure)) for measure in (Measure.ATTITUDE_MAX, Measure.RATES_MAX))
    return scenes.order(*fits, "made_up")


def test_order_is_fitted_in_a_window():
    found = [
        row("convergence", measure, 3 * dt**2, dt=dt)
        for measure in (Measure.ATTITUDE_MAX, Measure.RATES_MAX)
        for dt in (0.08, 0.04, 0.02, 0.01)
    ]
    assert texts(order_table(found)) == [["reduced", "2.00 ± 0.00", "2.00 ± 0.00", "0.08 to 0.01", "4", "–"]]


def test_too_few_points_give_the_reason_and_no_order():
    found = [row("convergence", Measure.ATTITUDE_MAX, dt, dt=dt) for dt in (0.2, 0.1)]
    (cells,) = texts(order_table(found))
    assert cells[1] == "no order"
    assert "2 runs" in cells[3]


def test_a_legend_has_an_order_that_is_sure_and_no_other():
    fits = pd.DataFrame(
        {"name": ["a", "b", "c"], "text": ["2.00 ± 0.01", "18.38 ± 18.96", "no order"], "stderr": [0.01, 18.96, math.nan]}
    )
    assert list(lines.with_slopes(fits, fits)["name"]) == ["a (2.00 ± 0.01)", "b (no clear order)", "c (no clear order)"]


def test_a_line_that_ends_before_the_others_has_its_end_and_the_reason():
    drifts = pd.DataFrame({"name": ["a", "a", "b", "b", "exact"], "t": [0.0, 10.0, 0.0, 3.0, 1.0]})
    assert lines.early_ends(drifts) == {"b": 3.0, "exact": 1.0}
    assert lines.early_ends(drifts[drifts["name"] == "b"]) == {}
    grown = pd.DataFrame({"scene": "top", "name": ["a", "b", "c"], "t": [1e6, 1e4, 1e2]})
    failed = pd.DataFrame(
        {"study": "long_time", "scene": "top", "name": ["b"], "outcome": OutcomeKind.DIVERGED, "reason": "at t = 3 s"}
    )
    note = long_time.why_early(grown, failed)
    assert "b on top (10,000 turns: at t = 3 s); c on top (100 turns: longer runs" in note
    assert long_time.why_early(grown[:1], failed) == ""


def test_failures_and_unsupported_runs_have_separate_tables():
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
    assert failures.failures(table).rows == [["made_up", "reduced", "diverged after t = 1 s", "", "paper, long_runs", "0.01"]]
    assert failures.unsupported(table).rows == [
        ["made_up", "unsupported", "for free bodies", "reduced"],
        ["made_up", "missing", "pip install x", "reduced"],
    ]


def test_an_unsupported_method_has_one_row_with_its_first_reason():
    found = [
        row("paper", "energy drift max", math.nan, method=method, outcome=cannot(reason))
        for method, reason in (("a", "2 > 1"), ("a", "3 > 1"), ("b", "for free bodies"), ("c", "for free bodies"))
    ]
    assert failures.unsupported(frame(found)).rows == [
        ["made_up", "unsupported", "2 > 1", "a"],
        ["made_up", "unsupported", "for free bodies", "b, c"],
    ]


def test_contests_are_in_microseconds():
    lines = [*point("gauss", "ours", 1e-3, 2e-6), *point("scipy", "engine", 1e-3, 8e-6), *point("lame", "ours", 1e-3, 1e-6)]
    table = scene_ratios.as_table(points(frame(lines)), 0.5)
    *_, line = texts(table)
    assert [name for name in table.header if "µs" in name] == ["µs per s", "µs a sample"] * 3
    sides = (["gauss", "2.00", "1.00"], ["scipy", "8.00", "4.00"], ["4.00"], ["lame", "1.00", "0.500"], ["8.00"])
    assert line == ["1e-3", *chain.from_iterable(sides)]


def advice(reached):
    probe = SimpleNamespace(
        method=cv.Reduced(), dt=0.25, setting=0.25, drifts=(), expected=2e-5, error=1e-5, holds=7.0, length=3.0, outcome=OK
    )
    return SimpleNamespace(best=probe, reached=reached, cost=4e-6, line="reduced", order=None, probes=(probe,))


def test_a_recommendation_is_in_microseconds_and_tells_how_long_an_error_holds():
    answer = SimpleNamespace(conditions=SimpleNamespace(cost_limit=1.0), advice=(advice(True), advice(False)))
    (reaching, failing), probes = recommendation.tables(answer), recommendation.probe_table(answer)
    assert dict(zip(reaching.header, reaching.rows[0], strict=True)) == {
        "method": "reduced",
        "setting": "dt = 0.25 s",
        "µs per simulated s": "4",
        "error to expect, rad": "2.0e-5",
        "drift to expect": "conserved",
    }
    shown = dict(zip(failing.header, failing.rows[0], strict=True))
    assert (shown["µs per simulated s"], shown["reaches the error for"], shown["to expect, rad"]) == ("4", "7 s", "2.0e-5")
    assert dict(zip(probes.header, probes.rows[0], strict=True))["run, s"] == "3"


def test_reference_solutions_have_their_agreement():
    found = [rows.row("paper", "exact", Measure.AGREEMENT, 2.5e-15, 0.01, role="truth", label="exact and heyoka")]
    table = failures.truths(frame(found))
    assert table.header[1:] == ["dt, s", "reference solutions", "largest angle between them, rad"]
    assert texts(table) == [["made_up", "0.01", "exact and heyoka", "2.5e-15"]]


@pytest.fixture
def bumped():
    """A run with an energy error of 2e-3 in the middle and none at the end."""
    exact = cv.integrate(cv.scenes.brick_flip(), 0.1)
    bump = 1 + 1e-3 * np.sin(np.pi * np.arange(len(exact)) / (len(exact) - 1))
    return Trajectory(exact.scene, exact.t, exact.R_WB, exact.w_WB_B * bump[:, None], "bumped")


def test_the_largest_drift_is_shown_and_not_the_last(bumped):
    assert bumped.drift(bumped.scene.invariants[0])[-1] < 1e-12
    assert "2.01e-03 (relative)" in bumped._repr_html_()
    summary = single_run.summarize(bumped, cv.Reduced(), 0.1)
    assert summary["drift"]["energy"] == pytest.approx(2.001e-3, rel=1e-6)
    assert "2.01e-3 (relative)" in markdown.render(single.build([summary | {"error": {"reason": "not computed"}}]))
    assert (summary["last"]["t"], summary["last"]["energy"]) == (bumped.t[-1], bumped.energy[-1])


def test_methods_are_ranked_by_their_drift():
    """The smallest drift comes first and failures last, for our methods and engines alike."""
    found = [
        made_up.row("long_runs", "b", "energy drift max", math.nan, outcome=Diverged(0.36, "why").outcome),
        made_up.row("long_runs", "mujoco", "energy drift max", 1e-2, role="engine"),
        made_up.row("long_runs", "reduced", "energy drift max", 1e-15),
    ]
    body = scenes.conservation(frame(found), "brick_flip").rows
    assert [line[0] for line in body] == ["reduced", "mujoco", "b"]


@pytest.mark.parametrize(
    ("value", "text", "grade"),
    [
        (3e-15, "✓ 3.0e-15", "good"),
        (2e-6, "≈ 2.0e-6", "fair"),
        (0.3, "✗ 0.3", "bad"),
        (math.inf, "✗ inf", "bad"),
        (math.nan, "–", "none"),
    ],
)
def test_drift_is_graded_by_symbol_and_colour(value, text, grade):
    cell = cells.grade(value)
    assert (cell.text, cell.grade) == (text, Grade(grade))


def test_hard_cases_are_a_matrix():
    found = [
        made_up.row("hard_cases", "reduced", "energy drift max", 1e-15, scene="needle"),
        made_up.row("hard_cases", "reduced", "energy drift max", math.nan, scene="falling_top", outcome="not converged"),
        made_up.row("hard_cases", "mujoco", "energy drift max", 0.1, scene="needle", role="engine"),
    ]
    table = hard_cases.hard_cases(frame(found))
    assert table.header == ["case", "reduced", "mujoco"]
    assert texts(table) == [
        ["needle", "motion –, invariants ✓ 1.0e-15 energy", "motion –, invariants ✗ 0.1 energy"],
        ["falling_top", "✗ not converged", "– not run"],
    ]
    assert hard_cases.hard_cases(made_up.table()) is None


def graded(*values):
    found = [made_up.row("hard_cases", "reduced", measure, value) for measure, value in values]
    cell = hard_cases.grades(frame(found).to_dict("records"))
    return tuple(part.grade for part in cell.parts)


def test_a_hard_case_is_graded_by_its_motion_and_by_its_worst_invariant():
    """The two are independent: a method can conserve everything with an error of 0.2 rad, or be accurate and drift."""
    wrong = graded(("attitude error max", 0.2), ("energy drift max", 1e-15), ("momentum drift max", 0))
    assert wrong == (Grade.BAD, Grade.GOOD)
    assert graded(("attitude error max", 1.4e-6), ("energy drift max", 1e-8)) == (Grade.GOOD, Grade.FAIR)
    assert graded(("attitude error max", 0.05), ("energy drift max", 1e-15), ("momentum drift max", 1e-2))[1] is Grade.BAD


def test_methods_stand_in_the_order_in_which_they_did_well():
    found = [
        made_up.row("hard_cases", name, "attitude error max", error, scene="needle")
        for name, error in (("a", 1.0), ("b", 1e-9))
    ]
    assert hard_cases.hard_cases(frame(found)).header == ["case", "b", "a"]


def test_longest_steps_are_a_matrix():
    largest, first = Measure.LONGEST_STEP, Measure.FAILING_STEP
    found = [
        made_up.row("stability", "a", largest, 1.0, scene="needle"),
        made_up.row("stability", "a", first, 3.2, scene="needle", outcome="not converged"),
        made_up.row("stability", "b", largest, 10.0, scene="needle"),
        made_up.row("stability", "c", largest, math.nan, scene="needle", outcome="unsupported"),
    ]
    body = hard_cases.stability(frame(found)).rows
    assert [str(line[1]) for line in body] == ["≈ 1 rad, then not converged", "✓ 10 rad and more", "– unsupported"]
