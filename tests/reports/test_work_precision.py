"""Costs at an error from work against precision, costs with every step stored, and the ratios of the ratios."""

import math
from types import SimpleNamespace

import pytest

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.speed_ratio import Cheapest, costs
from conservative.benchmarks.studies.paper import APPROXIMATE
from conservative.reports.rows import points as work_precision
from conservative.reports.rows.names import MethodClass
from conservative.reports.rows.points import points
from conservative.reports.sections import random_bodies, ratios, scene_ratios

from .rows import frame, point, row, table, texts
from .test_random_ratios import SLOWER, TWICE

OURS = (point("ours", "ours", 1e-2, 1.0, dt=0.4), point("ours", "ours", 1e-4, 4.0, dt=0.2), point("ours", "ours", 1e-6, 16.0))
ENGINE = (point("engine", "engine", 1e-3, 2.0, dt=0.2), point("engine", "engine", 1e-8, 8.0))


def speed_ratios(found, errors=work_precision.DECADES):
    return scene_ratios.ratios_of_class(costs(found, errors), MethodClass.GENERAL, errors)


def speed_ratio(error, *groups):
    return speed_ratios(points(table(*groups)), [error])[0]


def test_the_cheapest_of_several_lines_counts():
    expensive = (point("expensive", "ours", 1e-4, 5.0), point("more expensive", "engine", 1e-4, 90.0))
    found = speed_ratio(1e-4, *OURS, *ENGINE, *expensive)
    assert found.ours == Cheapest(4.0, "ours", (4.0,))
    assert found.theirs.name == "engine"


def test_between_points_the_cost_is_log_log():
    found = speed_ratio(1e-3, *OURS, *ENGINE)
    assert found.ours.time == pytest.approx(2.0, rel=1e-14)  # half way in the exponent from 1 to 4
    assert found.ratio == pytest.approx(1.0, rel=1e-14)


def test_lines_stay_coarse_to_fine_where_they_share_steps():
    first = [point("first", "ours", dt, 1 / dt, dt=dt) for dt in (2.0, 1.0)]
    second = [point("second", "engine", dt, 1 / dt, dt=dt) for dt in (3.0, 2.0, 1.5, 1.0)]
    found = points(table(*first, *second))
    assert found[["name", "dt"]].to_numpy().tolist() == [
        *(["first", 2.0], ["first", 1.0]),
        *(["second", 3.0], ["second", 2.0], ["second", 1.5], ["second", 1.0]),
    ]


def test_errors_below_the_resolution_of_the_reference_are_raised_to_it():
    def agreement(detail):
        return [row("paper", "truth", Measure.AGREEMENT, size, role="truth", detail=detail) for size in (1e-7, 1e-5)]

    checked = points(table(*OURS, *ENGINE, agreement(APPROXIMATE)))
    assert [c.error for c in speed_ratios(checked)] == [1e-1, 1e-2, 1e-3, 1e-4, 1e-5]
    exact = points(table(*OURS, *ENGINE, agreement("")))
    assert speed_ratios(exact)[-1].error == 1e-8


def test_nothing_is_extrapolated():
    found = speed_ratio(1e-7, *OURS, *ENGINE)
    assert found.ours is None
    assert found.lost
    assert math.isnan(found.ratio)
    assert speed_ratios(points(table(*OURS, *ENGINE)), [1e-9]) == []


def test_points_of_failed_runs_and_of_truths_do_not_compete():
    failed = point("ours", "ours", float("nan"), float("nan"), outcome="not converged", dt=0.01)
    truth = point("exact", "truth", 1e-15, 1e-9)
    found = speed_ratio(1e-5, *OURS, *ENGINE, failed, truth)
    assert found.ours.time == pytest.approx(8.0, rel=1e-14)
    assert found.theirs.name == "engine"


def test_lines_that_differ_in_tolerance_alone_are_one():
    groups = [
        point("heyoka", "engine", 10.0**-k, k, method=f"heyoka:tol=1e-{k}", version="7.13.2", series_setting="body")
        for k in (3, 9)
    ]
    found = points(table(*groups))
    assert found["name"].unique().tolist() == ["heyoka 7.13.2 body"]
    assert found["setting"].unique().tolist() == ["body"]
    assert found["series"].unique().tolist() == ["heyoka"]


def test_front_has_the_points_that_no_other_beats():
    groups = (*OURS, *ENGINE, point("bad", "engine", 1e-3, 9.0))
    front = work_precision.front(points(table(*groups)))
    assert front["error"].tolist() == [1e-2, 1e-3, 1e-4, 1e-8]


def test_a_cell_has_the_ratio_or_the_side_that_is_alone():
    cells = [str(ratios.ratio_cell(each)) for each in speed_ratios(points(table(*OURS, *ENGINE)), [1e-2, 1e-6, 1e-7])]
    assert cells == ["✓ 2.0", "✗ 0.29", "✗ engine only"]  # 2 x 4^0.6 / 16
    assert [str(ratios.ratio_cell(each)) for each in speed_ratios(points(table(*OURS)), [1e-2])] == ["✓ ours only"]


POINTS = [*point("gauss", "ours", 1e-7, 4e-6), *point("heyoka", "engine", 1e-7, 2e-6)]
DT = 0.1


def each(line, role, stored, final, **fields):
    """A method on the made-up scene: its times per sample, s, with every step stored, and with the final state only."""
    times = ("time per simulated second, each step kept", stored / DT), ("time per simulated second", final / DT)
    values = (("attitude error max", 1e-7), *times)
    return [row("each_step", line, measure, value, DT, role=role, **fields) for measure, value in values]


OWN_LOOP = "time per simulated second, each step kept, engine's own loop"
TABLE = frame(
    [
        *POINTS,
        *each("gauss", "ours", 3e-7, 2e-7),
        *each("reduced", "ours", 5e-7, 1e-7),
        *each("lame", "ours", 1e-7, 1e-8),
        *each("heyoka", "engine", 6e-7, 5e-8),
        row("each_step", "heyoka", OWN_LOOP, 4e-7 / DT, DT, role="engine"),
        row("each_step", "mujoco", "attitude error max", 1e-3, DT, role="engine"),
    ]
)
FOUND = scene_ratios.each_step(TABLE, "made_up")


def test_contests_end_with_both_kinds_of_runs_in_the_units_of_their_columns():
    table = scene_ratios.as_table(points(TABLE), 0.5, FOUND)
    assert table.header[1:4] == ("our fastest general integrator", "µs per s", "µs a sample")
    stored, own_loop, final = texts(table)[-3:]
    assert stored[:8] == ["1e-6, every 0.1 s stored", "gauss", "3.00", "0.300", "heyoka", "6.00", "0.600", "2.00"]
    assert stored[8:] == ["lame", "1.00", "0.100", "6.00"]
    assert own_loop[:8] == [f"{stored[0]}, engines without conversion", *stored[1:5], "4.00", "0.400", "1.33"]
    only = ["1e-6, every 0.1 s, final state only", "reduced", "1.00", "0.100", "heyoka", "0.500", "0.0500", "0.500"]
    assert final[:8] == only
    assert len(scene_ratios.as_table(points(TABLE), 0.5).rows) == len(table.rows) - 3


@pytest.mark.parametrize("table", [frame(POINTS), frame([*POINTS, *each("gauss", "ours", 1e-7, 1e-7, outcome="diverged")])])
def test_without_the_study_or_a_run_that_ends_there_is_nothing(table):
    assert scene_ratios.each_step(table, "made_up") is None


def test_the_verdict_has_a_row_for_each_motion_and_class_and_names_the_faster_engine():
    scene = SimpleNamespace(name="made_up", t_end=1.0)
    random = random_bodies.ratios(frame([row for rows in (*TWICE, *SLOWER) for row in rows]))
    measured = SimpleNamespace(
        plan=SimpleNamespace(scenes=[scene]), ratios=random, points=points(TABLE), every_step={"made_up": FOUND}
    )
    found = ratios.ratio_table(measured)
    at_1e_6 = {tuple(line[:2]): (line[found.header.index("1e-6")], line[-1]) for line in texts(found)}
    general, solution = MethodClass.GENERAL.value, MethodClass.SOLUTION.value
    assert at_1e_6 == {
        ("random bodies, spring", general): ("≈ 1.0 (0.50 to 2.0) (1 of 2)", "–"),
        ("made_up", general): ("✗ 0.50", "heyoka"),
        ("made_up, every 0.1 s stored", general): ("✓ 2.0", "–"),
        ("made_up, every 0.1 s stored", solution): ("✓ 6.0", "–"),
        ("made_up, every 0.1 s stored, engines without conversion", general): ("✓ 1.3", "–"),
        ("made_up, every 0.1 s stored, engines without conversion", solution): ("✓ 4.0", "–"),
        ("made_up, every 0.1 s, final state only", general): ("✗ 0.50", "heyoka"),
        ("made_up, every 0.1 s, final state only", solution): ("✓ 5.0", "–"),
    }


def test_an_engine_whose_time_is_within_5_percent_is_not_named_as_faster():
    table = frame([*point("gauss", "ours", 1e-7, 1.03), *point("heyoka", "engine", 1e-7, 1.0)])
    scene = SimpleNamespace(name="made_up")
    measured = SimpleNamespace(
        plan=SimpleNamespace(scenes=[scene]), ratios=[], points=points(table), every_step={"made_up": None}
    )
    (line,) = texts(ratios.ratio_table(measured))
    assert line[-2:] == ["≈ 0.97", "–"]
