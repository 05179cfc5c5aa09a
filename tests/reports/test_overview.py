import math

import pytest

from conservative.benchmarks.measures.measure import Measure
from conservative.errors import Diverged
from conservative.reports.tables import hard_cases, overview
from conservative.reports.tables.cells import Cell, Grade, grade_drift
from conservative.reports.tables.work_precision import points

from .made_up import row, table
from .rows import frame, point


def test_verdict_names_the_cheapest_and_what_it_keeps():
    header, body = overview.verdict(table(), points(table()))
    rows = [dict(zip(header, line, strict=True)) for line in body]
    assert [line["error, rad"] for line in rows] == ["1e-03"]  # nothing reaches 1e-6 or 1e-9
    assert rows[0]["cheapest"] == "reduced"
    assert "energy ✓" in rows[0]["conserves"]
    assert rows[0]["fails"] == "nowhere here"


def test_a_line_of_tolerances_keeps_what_its_tightest_keeps():
    names = {"scene": "brick_flip", "role": "engine", "series": "heyoka"}
    found = [
        finding
        for method, error, drift in (("heyoka:tol=1e-3", 1e-2, 1e-3), ("heyoka:tol=1e-15", 1e-9, 1e-15))
        for finding in (
            *point("heyoka", "engine", error, 1e-6, scene="brick_flip", method=method, series_setting=""),
            row("long_runs", method, "energy drift max", drift, **names),
        )
    ]
    header, (first, *_) = overview.verdict(frame(found), points(frame(found)))
    assert dict(zip(header, first, strict=True))["conserves"] == "energy ✓ 1.0e-15"


def test_verdict_tells_where_the_cheapest_fails():
    failed = row("long_runs", "reduced", "energy drift max", math.nan, scene="other", outcome=Diverged(0.36, "why").outcome)
    cannot = [row("long_runs", "reduced", "energy drift max", math.nan, scene=f"s{k}", outcome="unsupported") for k in range(5)]
    shown = overview.verdict(frame([failed, *cannot]), points(table()))
    assert shown[1][0][-1] == "diverged: other; unsupported: s0, s1 and 3 more scenes"


def test_a_step_that_a_method_does_not_have_is_no_failure_on_the_scene():
    found = [
        row("convergence", "a", "attitude error max", math.nan, outcome="unsupported"),
        row("long_runs", "a", "energy drift max", 1e-15),
    ]
    assert overview.scenes_in_trouble(frame(found)).empty
    assert len(overview.scenes_in_trouble(frame(found[:1]))) == 1


@pytest.mark.parametrize(
    ("value", "text", "grade"),
    [
        (3e-15, "✓ 3.0e-15", "good"),
        (2e-6, "≈ 2.0e-06", "fair"),
        (0.3, "✗ 0.3", "bad"),
        (math.inf, "✗ inf", "bad"),
        (math.nan, "–", "none"),
    ],
)
def test_drift_is_graded_by_symbol_and_colour(value, text, grade):
    assert grade_drift(value) == Cell(text, Grade(grade))


def test_hard_cases_are_a_matrix():
    found = [
        row("hard_cases", "reduced", "energy drift max", 1e-15, scene="needle"),
        row("hard_cases", "reduced", "energy drift max", math.nan, scene="falling_top", outcome="not converged"),
        row("hard_cases", "mujoco", "energy drift max", 0.1, scene="needle", role="engine"),
    ]
    header, body = hard_cases.hard_cases(frame(found))
    assert header == ["method", "needle", "falling_top"]
    assert [[str(cell)[0] for cell in line[1:]] for line in body] == [["✓", "✗"], ["✗", "–"]]
    assert hard_cases.hard_cases(table()) is None


def test_a_hard_case_is_graded_by_its_largest_drift():
    found = [row("hard_cases", "reduced", "energy drift max", drift, dt) for drift, dt in ((1e-15, 0.1), (1e-2, 0.2))]
    assert hard_cases.hard_cases(frame(found))[1][0][1].grade is Grade.BAD


def test_longest_steps_are_a_matrix():
    largest, first = Measure.LONGEST_STEP, Measure.FAILING_STEP
    found = [
        row("stability", "a", largest, 1.0, scene="needle"),
        row("stability", "a", first, 3.2, scene="needle", outcome="not converged"),
        row("stability", "b", largest, 10.0, scene="needle"),
        row("stability", "c", largest, math.nan, scene="needle", outcome="unsupported"),
    ]
    _, body = hard_cases.stability(frame(found))
    assert [str(line[1]) for line in body] == ["≈ 1 rad, then not converged", "✓ 10 rad and more", "– unsupported"]
    assert overview.scenes_in_trouble(frame(found)).empty
