import math

import pandas as pd
import pytest

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.paper import APPROXIMATE
from conservative.reports.tables import headline, work_precision

from .rows import point, row, table

OURS = (point("ours", "ours", 1e-2, 1.0, dt=0.4), point("ours", "ours", 1e-4, 4.0, dt=0.2), point("ours", "ours", 1e-6, 16.0))
ENGINE = (point("engine", "engine", 1e-3, 2.0, dt=0.2), point("engine", "engine", 1e-8, 8.0))


def statements(contests):
    return [f"{found.scene}: {found.text}" for found in headline.statements(contests)]


def contest(error, *groups):
    return next(c for c in work_precision.contests(work_precision.points(table(*groups)), [error]))


def test_measured_point_is_its_own_cost():
    found = contest(1e-4, *OURS, *ENGINE)
    assert found.ours == work_precision.CheapestLine("ours", 4.0)


def test_the_cheapest_of_several_lines_counts():
    dear = (point("dear", "ours", 1e-4, 5.0), point("dearer", "engine", 1e-4, 90.0))
    found = contest(1e-4, *OURS, *ENGINE, *dear)
    assert found.ours == work_precision.CheapestLine("ours", 4.0)
    assert found.theirs.name == "engine"


def test_a_lucky_point_is_no_cost():
    line = pd.DataFrame({"error": [1e-3, 1e-8, 1e-5], "time": [1.0, 2.0, 3.0]})
    assert work_precision.cost(line, 1e-5) == 2.0
    assert math.isnan(work_precision.cost(line, 1e-6))


def test_between_points_the_cost_is_log_log():
    found = contest(1e-3, *OURS, *ENGINE)
    assert found.ours.time == pytest.approx(2.0, rel=1e-14)  # half way in the exponent from 1 to 4
    assert found.ratio == pytest.approx(1.0, rel=1e-14)


def test_lines_stay_coarse_to_fine_where_they_share_steps():
    first = [point("first", "ours", dt, 1 / dt, dt=dt) for dt in (2.0, 1.0)]
    second = [point("second", "engine", dt, 1 / dt, dt=dt) for dt in (3.0, 2.0, 1.5, 1.0)]
    found = work_precision.points(table(*first, *second))
    assert found[["name", "dt"]].to_numpy().tolist() == [
        *(["first", 2.0], ["first", 1.0]),
        *(["second", 3.0], ["second", 2.0], ["second", 1.5], ["second", 1.0]),
    ]


def test_nothing_is_claimed_below_what_the_truth_is_known_to():
    def agreement(detail):
        return [row("paper", "truth", Measure.AGREEMENT, 1e-5, role="truth", detail=detail)]

    checked = work_precision.points(table(*OURS, *ENGINE, agreement(APPROXIMATE)))
    assert [c.error for c in work_precision.contests(checked)] == [1e-1, 1e-2, 1e-3, 1e-4, 1e-5]
    exact = work_precision.points(table(*OURS, *ENGINE, agreement("")))
    assert work_precision.contests(exact)[-1].error == 1e-8


def test_a_more_accurate_point_counts_for_a_larger_error():
    assert contest(1e-1, *OURS, *ENGINE).theirs.time == 2.0


def test_nothing_is_extrapolated():
    found = contest(1e-7, *OURS, *ENGINE)
    assert found.ours is None
    assert found.lost
    assert math.isnan(found.ratio)
    assert work_precision.contests(work_precision.points(table(*OURS, *ENGINE)), [1e-9]) == []


def test_points_of_failed_runs_and_of_truths_do_not_compete():
    failed = point("ours", "ours", float("nan"), float("nan"), outcome="not converged", dt=0.01)
    truth = point("exact", "truth", 1e-15, 1e-9)
    found = contest(1e-5, *OURS, *ENGINE, failed, truth)
    assert found.ours.time == pytest.approx(8.0, rel=1e-14)
    assert found.theirs.name == "engine"


def test_lines_that_differ_in_tolerance_alone_are_one():
    groups = [
        point("heyoka", "engine", 10.0**-k, k, method=f"heyoka:tol=1e-{k}", version="7.13.2", series_setting="body")
        for k in (3, 9)
    ]
    found = work_precision.points(table(*groups))
    assert found["name"].unique().tolist() == ["heyoka 7.13.2 body"]
    assert found["setting"].unique().tolist() == ["body"]
    assert found["series"].unique().tolist() == ["heyoka"]


def test_front_is_what_nothing_beats():
    groups = (*OURS, *ENGINE, point("bad", "engine", 1e-3, 9.0))
    front = work_precision.front(work_precision.points(table(*groups)))
    assert front["error"].tolist() == [1e-2, 1e-3, 1e-4, 1e-8]


def test_verdict_names_the_engine_the_errors_and_the_factor():
    decades = [1e-2, 1e-6, 1e-7]
    lines = statements(work_precision.contests(work_precision.points(table(*OURS, *ENGINE)), decades))
    assert lines == [
        "made_up: engine is 3.5 times as fast as our general integrators, at 1e-6 rad, "  # 16 / (2 x 4^0.6)
        "and reaches 1e-7 rad, which none of them was measured to reach.",
        "made_up: our general integrators are 2.0 times as fast as the cheapest engine, at 1e-2 rad.",
    ]


def test_verdict_where_ours_wins_everywhere():
    lines = statements(work_precision.contests(work_precision.points(table(point("ours", "ours", 1e-6, 1.0), *ENGINE)), [1e-2]))
    assert lines[0] == "made_up: no engine beats our general integrators at any error that it reaches."


def test_verdict_joins_neighbouring_decades():
    lines = statements(work_precision.contests(work_precision.points(table(*OURS, *ENGINE))))
    assert "reaches 1e-7, 1e-8 rad" in lines[0]
    assert "1e-4 to 1e-6 rad" in lines[0]


def test_verdict_without_engines_claims_nothing():
    lines = statements(work_precision.contests(work_precision.points(table(*OURS)), [1e-2]))
    assert lines == ["made_up: no engine was measured."]
    assert "no engine" in statements([])[0]
