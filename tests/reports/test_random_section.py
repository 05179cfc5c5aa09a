"""The report's first section: random bodies first, the scenes of the report second."""

import pandas as pd
import pytest

from conservative.benchmarks.measures import measurement
from conservative.reports import document, view
from conservative.reports.run.measure import Measurements
from conservative.reports.run.plan import BODIES, QUICK_BODIES, plan_report
from conservative.reports.run.provenance import provenance
from conservative.reports.run.terms import terms

from .made_up import measurements
from .test_random_ratios import SLOWER, TWICE

METHODS = ["reduced:order=4", "heyoka:tol=1e-9"]
ROWS = measurement.frame([each for lines in (*TWICE, *SLOWER) for each in lines])
SECTION = "Random bodies: what a statement about speed is about"


@pytest.fixture(scope="module")
def plan():
    return plan_report(["brick_flip"], METHODS, quick=True, bodies=2, seed=7)


def built(plan, *tables):
    found = measurements()
    return view.build(plan, Measurements(pd.concat([found.table, *tables]), found.samples), provenance(["report"]))


@pytest.fixture(scope="module")
def folder(plan, tmp_path_factory):
    place = tmp_path_factory.mktemp("random")
    document.render(built(plan, ROWS), place, png=False)
    return place


@pytest.mark.parametrize(
    ("file", "then"), [("report.md", "The scenes of this report"), ("index.html", '<section id="brick_flip"')]
)
def test_random_bodies_come_before_the_scenes(folder, file, then):
    text = (folder / file).read_text(encoding="utf-8")
    assert 0 < text.index(SECTION) < text.index(then)
    assert "Bodies in each field: 2, from seed 7" in " ".join(text.split())
    assert "over 2 bodies the cheapest engine takes" in text
    assert "0.50" in text


def test_the_picture_is_there(folder):
    assert (folder / "random_bodies.svg").read_text(encoding="utf-8").startswith("<svg")
    assert "random_bodies.svg" in (folder / "report.md").read_text(encoding="utf-8")
    assert 'data-figure="random_bodies"' in (folder / "index.html").read_text(encoding="utf-8")


def test_a_report_without_random_bodies_does_not_mention_them(tmp_path):
    without = plan_report(["brick_flip"], METHODS, quick=True)
    found = built(without)
    document.render(found, tmp_path, png=False)
    assert found.random is None
    assert SECTION not in (tmp_path / "report.md").read_text() + (tmp_path / "index.html").read_text()


def test_rows_of_random_bodies_are_nowhere_else(plan):
    alone, both = built(plan), built(plan, ROWS)
    assert [each for each in both.headline if not each.scene.startswith("random")] == list(alone.headline)
    assert both.scenes[0].summary.classes == alone.scenes[0].summary.classes
    assert len(both.failures[1]) == len(alone.failures[1])


def test_how_many_bodies_a_report_has():
    assert plan_report(["brick_flip"], METHODS).bodies == 0
    assert plan_report([], METHODS).bodies == plan_report(["brick_flip"], METHODS, full=True).bodies == 0
    assert plan_report([], METHODS, full=True).bodies == BODIES
    assert plan_report([], METHODS, full=True, quick=True).bodies == QUICK_BODIES
    first = plan_report(["brick_flip"], METHODS, bodies=1).studies[0]
    assert (first.name, len(first.scenes)) == ("random", 4)
    assert plan_report([], METHODS, bodies=0).studies[0].name != "random"


def test_methods_that_are_no_candidates_make_no_study():
    assert "random" not in plan_report([], ["reduced:order=2", "convected"]).names


def test_a_report_is_not_resumed_on_other_bodies(plan):
    source = provenance(["report"])
    other = plan_report(["brick_flip"], METHODS, quick=True, bodies=2, seed=8)
    assert terms(plan, source) != terms(other, source)
    assert terms(plan, source) == terms(plan_report(["brick_flip"], METHODS, quick=True, bodies=2, seed=7), source)
