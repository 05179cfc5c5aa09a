"""Ratios on random bodies and their section of the report, on made-up measurements with known results."""

import math
import re
from dataclasses import replace

import pandas as pd
import pytest

from conservative.benchmarks import speed_ratio as speed
from conservative.benchmarks.measures import measurement
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.random import DECADES
from conservative.reports.charts import figures, style
from conservative.reports.document import SVG_MARK
from conservative.reports.document.cells import tolerance
from conservative.reports.document.model import Section, Table, walk
from conservative.reports.report import render
from conservative.reports.run.checkpoint import terms
from conservative.reports.run.measure import Measurements
from conservative.reports.run.plan import FEW_BODIES, FEW_METHODS, FULL, KINDS, QUICK_FULL, plan_report
from conservative.reports.run.provenance import provenance
from conservative.reports.run.single_study import plan_study
from conservative.reports.sections import random_bodies
from conservative.reports.sections.random_bodies import ANY, ratios
from conservative.reports.sections.report import build
from conservative.scenes.random_body import FIELDS, name_of

from .made_up import measurements
from .rows import frame, row, texts

FIELD = "spring"


def line(index, method, role, points, field=FIELD, **fields):
    """Rows of a line of settings on a body: pairs of an error and a time, coarse to fine."""
    common = {"scene": name_of(field, 7, index), "field": field, "seed": 7, "body": index, "role": role, **fields}
    return [
        row("random", method, measure, value, dt, **common)
        for dt, point in enumerate(points)
        for measure, value in zip((Measure.ATTITUDE_MAX, Measure.TIME_DELIVERED), point, strict=True)
    ]


def flat(time, least=1e-13):
    """A line that takes the same time for every error down to the least."""
    return [(least, time)]


def found(*lines):
    return ratios(frame([row for rows in lines for row in rows]))


def against(ratios_found, engine=ANY, error=1e-6):
    (speed_ratio,) = [each for each in ratios_found if each.engine == engine and each.error == error]
    return speed_ratio


TWICE = [line(0, "gauss", "ours", flat(1.0)), line(0, "heyoka", "engine", flat(2.0))]
SLOWER = [line(1, "gauss", "ours", flat(4.0)), line(1, "heyoka", "engine", flat(2.0))]
OURS_ALONE = [line(2, "gauss", "ours", flat(1.0)), line(2, "heyoka", "engine", flat(2.0, least=1e-4))]
ENGINE_ALONE = [line(3, "gauss", "ours", flat(1.0, least=1e-4)), line(3, "heyoka", "engine", flat(2.0))]
NEITHER = [line(4, "gauss", "ours", flat(1.0, least=1e-4)), line(4, "heyoka", "engine", flat(2.0, least=1e-4))]


def test_the_mean_is_geometric_and_the_worst_body_is_named():
    speed_ratio = against(found(*TWICE, *SLOWER))
    assert (speed_ratio.ratio, speed_ratio.worst, speed_ratio.best) == (pytest.approx(1.0), 0.5, 2.0)
    assert speed_ratio.both[0].scene == name_of(FIELD, 7, 1)


def test_a_body_that_a_side_misses_is_counted_and_not_dropped():
    speed_ratio = against(found(*TWICE, *SLOWER, *OURS_ALONE, *ENGINE_ALONE, *NEITHER))
    assert (len(speed_ratio.speed_ratios), len(speed_ratio.both), speed_ratio.only_ours, speed_ratio.only_theirs) == (
        5,
        2,
        1,
        1,
    )
    assert speed_ratio.ratio == pytest.approx(1.0)
    assert random_bodies.count_text(speed_ratio) == "2 of 5 (only ours 1, only engine 1, neither 1)"
    assert random_bodies.count_text(against(found(*TWICE))) == "1 of 1"


def test_a_decade_that_no_pair_reaches_has_no_ratio():
    speed_ratio = against(found(*NEITHER))
    assert all(math.isnan(value) for value in (speed_ratio.ratio, speed_ratio.worst, speed_ratio.best))
    assert "neither" in random_bodies.count_text(speed_ratio)


def test_ours_is_the_cheapest_of_all_lines_and_so_is_the_engine():
    lean = line(0, "heyoka:frame=lean", "engine", flat(1.5))
    speed_ratio = against(found(*TWICE, line(0, "projected", "ours", flat(0.5)), lean, line(0, "scipy", "engine", flat(9.0))))
    assert speed_ratio.ratio == pytest.approx(3.0)
    assert (speed_ratio.speed_ratios[0].ours.name, speed_ratio.speed_ratios[0].theirs.name) == (
        "projected",
        "heyoka frame=lean",
    )
    assert against(found(*TWICE, line(0, "scipy", "engine", flat(9.0))), "scipy").ratio == pytest.approx(9.0)


def test_a_lucky_setting_of_ours_does_not_decide():
    lucky = line(0, "gauss", "ours", [(1e-9, 0.1), (1e-5, 0.9), (1e-13, 1.0)])
    speed_ratio = against(found(lucky, line(0, "heyoka", "engine", flat(2.0))), error=1e-6)
    between = 0.9 * (1.0 / 0.9) ** (1 / 8)
    assert speed_ratio.ratio == pytest.approx(2.0 / between)  # and not 20


def test_a_setting_that_was_not_timed_or_failed_is_no_way_there():
    untimed = line(0, "gauss", "ours", [(1e-13, math.nan)])
    failed = line(0, "projected", "ours", [(math.nan, math.nan)])
    assert against(found(untimed, failed, TWICE[1])).only_theirs == 1


def test_every_decade_and_every_field_has_its_row():
    other = [line(0, name, role, flat(1.0), field="gravity") for name, role in (("gauss", "ours"), ("heyoka", "engine"))]
    every = found(*TWICE, *other)
    rows = texts(random_bodies.as_table(every))
    assert [row[:2] for row in rows] == [[field, tolerance(e)] for field in (FIELD, "gravity") for e in DECADES]


def test_an_engine_that_takes_no_field_of_this_kind_has_no_row():
    missing = line(0, "mujoco", "engine", [(math.nan, math.nan)], outcome="unsupported")
    assert {each.engine for each in found(*TWICE, missing)} == {ANY, "heyoka"}


def test_a_body_without_a_confirmed_truth_is_in_no_count():
    dropped = {"scene": name_of(FIELD, 7, 9), "field": FIELD, "seed": 7, "body": 9, "role": "truth", "outcome": "skipped"}
    rows = [row("random", "precise:bits=96", Measure.AGREEMENT, 1e-12, **dropped)]
    assert len(against(found(*TWICE, rows)).speed_ratios) == 1
    confirmed = row("random", "precise:bits=96", Measure.AGREEMENT, 2e-15, **{**dropped, "body": 0, "outcome": "ok"})
    assert random_bodies.truths(frame([*rows, confirmed])) == (
        "Two reference solutions agree within 2e-15 rad on 1 bodies. They differ by more on 1, which are not compared."
    )


def test_without_an_engine_there_are_no_ratios():
    assert found(TWICE[0]) == ()
    assert random_bodies.sentence(()) == "On no random body do our integrators and an engine both reach 1e-6 rad."


def test_the_sentence_has_the_mean_and_the_bodies_that_are_lost():
    assert random_bodies.sentence(found(*TWICE)) == (
        "On one random body in fields, our fastest general integrator reaches 1e-6 rad "
        "2.0 times as fast as the fastest engine or solver (geometric mean; single bodies: 2.0 to 2.0)."
    )
    every = [[line(i, "gauss", "ours", flat(1.0)), line(i, "heyoka", "engine", flat(2.0 + i))] for i in range(5)]
    assert "(geometric mean; interval " in random_bodies.sentence(found(*(each for pair in every for each in pair)))
    lost = random_bodies.sentence(found(*TWICE, *SLOWER, *NEITHER))
    assert "(geometric mean; an engine or solver is faster on 1, by up to 2.0 times; 1 more are not reached by both)" in lost


def test_the_table_grades_a_ratio_below_one():
    first, *_ = texts(random_bodies.as_table(found(*SLOWER)))
    assert first[3:] == ["0", "0", "1", "✗ 0.500", "✗ 0.500", "✗ 0.500", "1", "gauss", "heyoka"]
    assert str(random_bodies.as_table(found(*TWICE)).rows[0][6]) == "✓ 2.00"


def in_processes(*pairs):
    """Rows of a body with the times of both sides in each process."""
    names = zip(("gauss", "heyoka"), ("ours", "engine"), zip(*pairs, strict=True), strict=True)
    rows = []
    for name, role, times in names:
        error, time = line(0, name, role, flat(1.0))
        rows += [[error, *(replace(time, value=value, process=n) for n, value in enumerate(times))]]
    return rows


def test_a_ratio_has_an_interval_over_processes_and_is_open_around_1():
    speed_ratio = against(found(*in_processes((1.0, 2.0), (1.1, 2.2), (1.0, 2.1), (2.0, 3.8), (1.0, 2.0))))
    assert speed_ratio.ratio == pytest.approx((2 * 2 * 2.1 * 1.9 * 2) ** 0.2)
    assert 1.9 <= speed_ratio.interval[0] < speed_ratio.ratio < speed_ratio.interval[1] <= 2.1
    even = found(*in_processes((1.0, 0.9), (1.0, 1.1), (1.0, 1.2), (1.0, 0.95), (1.0, 1.05)))
    assert (against(even).won, against(even).open, against(even).lost) == (0, 1, 0)
    shown = texts(random_bodies.as_table(even))[0]
    assert shown[3:6] == ["0", "1", "0"]
    assert re.fullmatch(r"≈ 1\.03 \(0\.9\d+ to 1\.\d+\)", shown[6])
    assert "1 undecided" in random_bodies.sentence(even)


def test_each_engine_has_a_row():
    table = random_bodies.by_engine(found(*TWICE, *SLOWER, line(0, "scipy", "engine", flat(30.0, least=1e-7))))
    assert table.header == ["field", "engine", "1e-3", "1e-6", "1e-9", "1e-12"]
    assert [[text[1], text[2].split(" ")[0], text[5]] for text in texts(table)] == [
        ["heyoka", "1.00", "1.00 (0.500 to 2.00)"],
        ["scipy", "30.0", "–, 0 of 1 bodies"],
    ]


def test_an_engine_is_compared_on_bodies_that_its_adapter_supports():
    refused = line(1, "scipy", "engine", [(math.nan, math.nan)], outcome="unsupported")
    speed_ratio = against(found(*TWICE, *SLOWER, line(0, "scipy", "engine", flat(9.0)), refused), "scipy")
    assert len(speed_ratio.speed_ratios) == 1


def test_a_call_decides_and_compiled_loops_are_the_last_columns():
    """Ours is faster by a compiled loop, but slower by a call."""
    error, call = line(0, "gauss", "ours", flat(4.0))
    ours = [error, call, replace(call, measure=Measure.TIME, value=1.0)]
    error, call = line(0, "heyoka", "engine", flat(2.0))
    table = frame([*ours, error, call, replace(call, measure=Measure.TIME, value=2.0)])
    first, *_ = texts(random_bodies.as_table(ratios(table), ratios(table, Measure.TIME)))
    assert first[3:7] == ["0", "0", "1", "✗ 0.500"]
    assert first[-2:] == ["✓ 2.00", "✓ 2.00"]
    assert "Won: 0, open: 0, lost: 11." in random_bodies.counts(ratios(table))
    assert "Won: 11, open: 0, lost: 0." in random_bodies.counts(ratios(table, Measure.TIME))


def at_tolerance(index, name, role, time, error=1e-7):
    return line(index, name, role, [(error, time)])


def test_at_a_tolerance_the_fastest_frame_of_each_body_decides():
    """heyoka's quaternion is faster on the first body, base vectors on the second. Errors play no part."""
    rows = [
        *at_tolerance(0, "taylor:tolerance=1e-06", "ours", 1.0),
        *at_tolerance(1, "taylor:tolerance=1e-06", "ours", 1.0, error=1e-3),
        *(at_tolerance(0, "heyoka:tol=1e-06", "engine", 2.0) + at_tolerance(0, "heyoka:tol=1e-06,frame=lean", "engine", 9.0)),
        *(at_tolerance(1, "heyoka:tol=1e-06", "engine", 9.0) + at_tolerance(1, "heyoka:tol=1e-06,frame=lean", "engine", 0.5)),
        *at_tolerance(0, "heyoka:tol=1e-07", "engine", 0.1),  # at a tolerance that is not compared
        *at_tolerance(0, "gauss", "ours", 0.1),  # without a tolerance
    ]
    found = {each.tolerance: each for each in random_bodies.typed_ratios(frame(rows)) if each.both}
    assert list(found) == [1e-6]
    assert [pair.ratio for pair in found[1e-6].both] == pytest.approx([0.5, 2.0])
    assert (found[1e-6].won, found[1e-6].lost) == (1, 1)
    shown = [row for row in texts(random_bodies.typed_table(random_bodies.typed_ratios(frame(rows)))) if row[1] == "1e-6"]
    assert [row[3:7] for row in shown] == [["1", "0", "1", "≈ 1.00 (0.500 to 2.00)"]]


def test_a_study_without_losses_bounds_the_share_of_bodies():
    """The rule of three, and Clopper and Pearson's limit for one of ten: 39.4 %."""
    bodies = [[line(i, "gauss", "ours", flat(1.0)), line(i, "heyoka", "engine", flat(2.0))] for i in range(10)]
    without = random_bodies.counts(found(*(each for pair in bodies for each in pair)))
    assert "Cases (one body at one error): 110. Won: 110, open: 0, lost: 0." in without
    assert "at most 26 % of such bodies" in without  # 1 - 0.05^(1/10)
    bodies[0][1] = line(0, "heyoka", "engine", flat(0.5))
    assert "at most 39 % of such bodies" in random_bodies.counts(found(*(each for pair in bodies for each in pair)))
    assert speed.bound_share(0, 100) == pytest.approx(0.03, rel=0.02)
    assert math.isnan(speed.bound_share(0, 0))


def test_numbers_of_json_are_those_of_the_table():
    record = random_bodies.records(found(*TWICE, *SLOWER))[0]
    assert (record["mean"], record["worst_scene"], record["both"]) == (pytest.approx(1.0), name_of(FIELD, 7, 1), 2)
    assert math.isnan(random_bodies.records(found(*ENGINE_ALONE))[-1]["mean"])


def test_the_picture_draws_mean_and_band():
    points = random_bodies.chart_points(found(*TWICE, *SLOWER, *ENGINE_ALONE))
    assert len(points) == len(DECADES)
    assert points[["mean", "worst", "best"]].iloc[-1].tolist() == pytest.approx([1.0, 0.5, 2.0])
    (panel,) = figures.random_ratios(points, 3, 7).to_dict()["concat"]
    drawn = {(part["mark"]["type"], part["encoding"]["y"]["field"]) for part in panel["layer"]}
    assert drawn == {("area", "worst"), ("rule", "even"), ("line", "mean")}


METHODS = ["reduced:order=4", "heyoka:tol=1e-9"]
ROWS = measurement.frame([each for lines in (*TWICE, *SLOWER) for each in lines])


@pytest.fixture(scope="module")
def plan():
    return plan_report(["brick_flip"], METHODS, quick=True, bodies=2, seed=7)


def built(plan, *tables):
    found = measurements()
    return build(plan, Measurements(pd.concat([found.table, *tables]), found.samples), provenance(["report"]))


@pytest.fixture(scope="module")
def document(plan):
    return built(plan, ROWS)


@pytest.fixture(scope="module")
def document_without():
    return built(plan_report(["brick_flip"], METHODS, quick=True))


@pytest.fixture(scope="module")
def folder(document, tmp_path_factory):
    place = tmp_path_factory.mktemp("random")
    render(document, place, png=False)
    return place


PLACES = [
    ("report.md", "### Random bodies", "### All tables of brick_flip"),
    ("index.html", '<details id="random"', '<details id="brick_flip"'),
]


@pytest.mark.parametrize(("file", "first", "then"), PLACES)
def test_random_bodies_come_before_the_scenes(folder, file, first, then):
    text = (folder / file).read_text(encoding="utf-8")
    assert 0 < text.index(first) < text.index(then)
    assert "Bodies in each field: 2, from seed 7" in " ".join(text.split())
    assert "On 2 random bodies in fields" in text
    assert "0.500" in text
    assert ("random_bodies.svg" if file == "report.md" else 'data-figure="random_bodies"') in text
    assert (folder / "random_bodies.svg").read_text(encoding="utf-8").startswith(f"{SVG_MARK}\n<svg")


def test_a_report_without_random_bodies_does_not_mention_them(document_without, tmp_path, monkeypatch):
    monkeypatch.setattr(style, "picture_file", lambda picture, kind: b"")
    render(document_without, tmp_path, png=False)
    assert not any(first in (tmp_path / file).read_text() for file, first, _ in PLACES)
    assert "Environments of engines" not in (tmp_path / "report.md").read_text()  # neither are there engines


def test_rows_of_random_bodies_are_nowhere_else(document, document_without):
    def shown(report):
        sections = {section.title: section for section in walk(report.blocks) if isinstance(section, Section)}
        titles = ("All tables of brick_flip", "Failures, unsupported runs, and the reference solutions")
        return [texts(block) for title in titles for block in walk(sections[title].blocks) if isinstance(block, Table)]

    assert shown(document) == shown(document_without) != []


def test_how_many_bodies_a_report_has():
    assert plan_report(["brick_flip"], METHODS).bodies == 0
    assert plan_report([], METHODS).bodies == plan_report(["brick_flip"], METHODS, full=True).bodies == 0
    assert plan_report([], METHODS, full=True).bodies == KINDS[FULL].bodies == 3
    assert plan_report([], METHODS, full=True, quick=True).bodies == KINDS[QUICK_FULL].bodies == 1
    first = plan_report(["brick_flip"], METHODS, bodies=1).studies[0]
    assert (first.name, len(first.scenes)) == ("random", len(FIELDS))
    assert plan_report([], METHODS, bodies=0).studies[0].name != "random"
    default, all_methods = plan_report().studies[0], plan_report(bodies=1).studies[0]
    assert (len(default.scenes), len(default.methods), default.quick) == (FEW_BODIES, len(FEW_METHODS), True)
    assert set(default.methods) < set(all_methods.methods)


def test_a_full_report_and_single_studies_of_times_have_several_processes():
    full, usual = (plan_report([], METHODS, full=whole, bodies=1).studies for whole in (True, False))
    assert {each.name for each in full if each.processes == 5} >= {"random", "work_precision", "each_step"}
    assert {each.processes for each in usual} == {1}
    assert [plan_study("random", methods=METHODS, quick=quick).processes for quick in (False, True)] == [5, 3]
    assert plan_study("paper", methods=METHODS).processes == 1


def test_methods_that_are_no_candidates_make_no_study():
    assert "random" not in plan_report([], ["reduced:order=2", "convected"]).names


def test_a_report_is_not_resumed_on_other_bodies(plan):
    source = provenance(["report"])
    other = plan_report(["brick_flip"], METHODS, quick=True, bodies=2, seed=8)
    assert terms(plan, source) != terms(other, source)
    assert terms(plan, source) == terms(plan_report(["brick_flip"], METHODS, quick=True, bodies=2, seed=7), source)
