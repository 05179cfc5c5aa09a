"""The study of prices: processes that run both sides, the error of their results, and the table."""

import os

import pytest

import conservative as cv
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import frame
from conservative.benchmarks.studies import price, price_program
from conservative.benchmarks.studies.study import Study
from conservative.reports.rows.names import with_names
from conservative.reports.sections.price import section

SCENES = price.scenes()[:2]
STUDY = Study("price", SCENES, (cv.Reduced(),))


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    cache = os.environ.get("NUMBA_CACHE_DIR") or str(tmp_path_factory.mktemp("kernels"))
    return [row for side in ("ours", "heyoka") for row in price.measure_side(STUDY, *SCENES, side, "", cache)]


def test_both_sides_reach_the_error(rows):
    errors = {row.family: row.value for row in rows if row.measure is Measure.ATTITUDE_FINAL}
    assert len(errors) == 2
    assert errors["heyoka"] < price_program.ERROR / 10  # measured 1.1e-10
    assert max(errors.values()) < price_program.ERROR  # ours: measured 1.2e-8


def test_a_thousand_runs_contain_the_first(rows):
    for family in {row.family for row in rows}:
        once, thousand, other = (row.value for row in rows if row.family == family and row.measure in price.MEASURES.values())
        assert other > 0
        assert 0 < once < thousand


def test_the_table_has_medians_and_the_largest_error(rows):
    named = with_names(frame(rows + rows))
    table = section(named, named).blocks[0]
    assert [row[0] for row in table.rows] == ["conservative", "heyoka"]
    assert [row[1] for row in table.rows] == ["2", "2"]
    for line, family in zip(table.rows, (rows[0].family, "heyoka"), strict=True):
        values = [row.value for row in rows if row.family == family]
        assert [cell.value for cell in line[2:]] == pytest.approx(values)


def test_the_bodies_are_two_of_each_field():
    scenes = price.scenes()
    assert len({type(scene.potential) for scene in scenes[::2]}) >= 4
    assert all(type(a.potential) is type(b.potential) for a, b in zip(scenes[::2], scenes[1::2], strict=True))
