"""Many bodies in tables and the report, on made-up measurements with known results."""

from dataclasses import replace

import pandas as pd
import pytest

from conservative.benchmarks.measures import measurement
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.throughput import EXACT, QUICK_BODIES
from conservative.reports.report import render
from conservative.reports.rows.names import MethodClass, with_names
from conservative.reports.run.measure import Measurements
from conservative.reports.run.plan import plan_report
from conservative.reports.run.provenance import provenance
from conservative.reports.sections import many_bodies as throughput
from conservative.reports.sections.report import build

from .made_up import measurements
from .rows import row, texts

GENERAL, SOLUTION = MethodClass.GENERAL, MethodClass.SOLUTION


def line(method, role, points, way="", scene="heavy_tops", detail="", sizes=(10, 1000)):
    """Rows of a line: pairs of an error, which is that of the median and a tenth of that of the 95th percentile, and a time."""
    common = {"scene": scene, "role": role, "way": way}
    found = []
    for dt, (error, time) in enumerate(points, start=1):
        for which, value in (("median", error), ("95 %", 10 * error)):
            found.append(row("throughput", method, Measure.ATTITUDE_MAX, value, dt, quantity=which, detail=detail, **common))
        for size in sizes:
            a_body = time * (2 if size == 10 else 1)
            found.append(row("throughput", method, Measure.TIME, a_body, dt, bodies=size, **common))
            found.append(row("throughput", method, Measure.BODY_STEPS, 1 / time, dt, bodies=size, **common))
    return found


OURS = line("taylor", "ours", [(1e-3, 1e-6), (1e-6, 2e-5), (1e-10, 4e-5)])
ALONE = line("taylor", "ours", [(1e-10, 1e-9)], way="one at a time")
HEYOKA = line("heyoka", "engine", [(1e-3, 4e-6), (1e-6, 1e-5), (1e-10, 2e-5)], sizes=(10,))
SHORT = line("mujoco", "engine", [(1e-3, 1e-3)])
FREE = line("moser_veselov", "ours", [(1e-14, 1e-7)], scene="free_bodies", detail=EXACT)
THEIRS = line("heyoka", "engine", [(1e-10, 1e-6)], scene="free_bodies")
ROWS = measurement.frame([*OURS, *ALONE, *HEYOKA, *SHORT, *FREE, *THEIRS])


@pytest.fixture(scope="module")
def compared():
    rows = throughput.lines(with_names(ROWS))
    return list(throughput.speed_ratios(rows, throughput.body_costs(rows)))


def speed_ratio(compared, kind, engine, group, error, statistic="median"):
    """Number of bodies and speed ratio of ours with an engine."""
    ((size, found),) = [
        (size, each)
        for side, rival, which, size, each in compared
        if (side, rival, which, each.scene, each.error) == (group, engine, statistic, kind, error)
    ]
    return size, found


def test_contests_are_among_the_most_bodies_of_both_sides(compared):
    size, found = speed_ratio(compared, "heavy_tops", "heyoka", GENERAL, 1e-3)
    assert (size, found.ratio) == (10, pytest.approx(4.0))
    assert found.ours.name == "taylor"  # one at a time takes less, and is another way
    size, found = speed_ratio(compared, "heavy_tops", "mujoco", GENERAL, 1e-3)
    assert (size, found.ratio) == (1000, pytest.approx(1000.0))


def test_the_table_grades_the_ratio_and_a_side_without_a_time_has_none(compared):
    rows = [row for row in texts(throughput.as_table(compared)) if row[:2] == ["heavy tops", GENERAL] and row[4] == "median"]
    ratios = {
        (engine, error): (number, ratio, *names)
        for _, _, engine, error, _, number, ratio, *_, first, second in rows
        for names in [(first, second)]
    }
    assert ratios["heyoka", "1e-3"] == ("10", "✓ 4.00", "taylor", "heyoka")
    assert ratios["heyoka", "1e-6"] == ("10", "✗ 0.500", "taylor", "heyoka")
    assert ratios["mujoco", "1e-6"][1:] == ("–", "taylor", "no time")
    assert speed_ratio(compared, "heavy_tops", "mujoco", GENERAL, 1e-3, "95 %")[1].theirs is None


def test_the_table_has_every_line_and_at_how_many_bodies():
    found = throughput.lines(with_names(ROWS))
    rows = texts(throughput.cost_table(found, throughput.body_costs(found)))
    assert ["heavy tops", "taylor, one at a time"] in [row[:2] for row in rows]
    (heyoka,) = [row for row in rows if row[:2] == ["heavy tops", "heyoka"]]
    assert heyoka[5:7] == ["8 (10)", "20 (10)"]
    (taylor,) = [row for row in rows if row[:2] == ["heavy tops", "taylor"]]
    assert taylor[5:7] == ["1 (1,000)", "20 (1,000)"]
    assert {row[2] for row in rows} == {
        "our general integrators",
        "our solutions of integrable motions",
        "ODE solvers",
        "physics engines",
    }


def test_a_method_that_did_not_run_has_its_reason():
    failed = row(
        "throughput", "mjx", "attitude error max", float("nan"), outcome="unsupported", role="engine", scene="heavy_tops"
    )
    elsewhere = replace(failed, study="speed")
    rows = throughput.absent(with_names(measurement.frame([*OURS, failed, elsewhere]))).rows
    assert rows == [["heavy tops", "mjx", "unsupported: "]]


def test_the_report_has_a_section_with_a_picture(tmp_path):
    plan, found = plan_report(["brick_flip"], ["reduced:order=4", "heyoka:tol=1e-9"], full=True, bodies=1), measurements()
    assert plan.names[-1] == "throughput"
    assert (plan.studies[-1].quick, plan.studies[-1].bodies) == (True, QUICK_BODIES)  # not those of `random`
    plan = replace(plan, scenes=())  # the tables of scenes take a second
    built = build(plan, Measurements(pd.concat([found.table, ROWS]), found.samples), provenance(["report"]))
    render(built, tmp_path, png=False)
    for name in ("report.md", "index.html"):
        assert "✗ 0.500" in (tmp_path / name).read_text(encoding="utf-8")
    assert (tmp_path / "many_bodies.svg").read_text(encoding="utf-8").count("<path") > 20
    assert "many_bodies.svg" in (tmp_path / "report.md").read_text(encoding="utf-8")
    assert 'data-figure="many_bodies"' in (tmp_path / "index.html").read_text(encoding="utf-8")


def test_a_report_of_scenes_alone_and_a_quick_one_have_no_such_section():
    for extent in ({"full": True}, {"full": True, "quick": True, "bodies": 1}, {"bodies": 1}):
        assert "throughput" not in plan_report(["brick_flip"], ["reduced", "heyoka:tol=1e-9"], **extent).names


def test_exact_solutions_are_a_class_of_their_own(compared):
    assert {group for group, *_, found in compared if found.scene == "free_bodies"} == {SOLUTION}
