"""The studies that yield lines of pictures, and the one that starts interpreters."""

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import Measurement
from conservative.benchmarks.measures.samples import Samples
from conservative.benchmarks.studies import long_runs, paper_figures, sphere_curves, studies
from conservative.benchmarks.studies.study import Study
from conservative.outcome import OutcomeKind

BRICK = registry.scene("brick_flip:t_end=1")


def findings(name, *methods, scenes=(BRICK,)):
    found = list(studies.findings(Study(name, scenes, methods, quick=True)))
    return [each for each in found if isinstance(each, Measurement)], [each for each in found if isinstance(each, Samples)]


def test_a_long_run_has_a_line_for_everything_that_stays():
    rows, lines = findings("long_runs", cv.Reduced())
    names = [invariant.name for invariant in BRICK.invariants]
    assert [line.quantity for line in lines] == [*names, long_runs.ORTHONORMALITY]
    largest = {row.quantity: row.value for row in rows if row.measure is Measure.DRIFT_MAX}
    for line in lines[:-1]:
        assert line.t[-1] == pytest.approx(long_runs.DURATIONS * BRICK.t_end, rel=1e-12)
        assert np.all(np.diff(line.value) >= 0)
        assert line.value[-1] == largest[line.quantity]
        assert len(line.t) <= long_runs.SAMPLES


def test_a_long_run_that_fails_has_rows_and_no_line():
    rows, lines = findings("long_runs", cv.Lame())
    assert lines == []
    assert {(row.quantity, row.outcome.kind) for row in rows} == {
        (invariant.name, OutcomeKind.UNSUPPORTED) for invariant in BRICK.invariants
    }


@pytest.mark.parametrize("scene", [BRICK, registry.scene("lagrange_top:t_end=0.1")], ids=lambda scene: scene.name)
def test_a_curve_lies_on_the_unit_sphere(scene):
    rows, lines = findings("sphere_curves", cv.Reduced(), registry.method("exact"), scenes=(scene,))
    assert rows == []
    assert [line.method for line in lines] == ["exact"] * 3 + ["reduced"] * 3
    assert [line.quantity for line in lines] == [*sphere_curves.AXES] * 2
    for three in (lines[:3], lines[3:]):
        off = np.linalg.norm([line.value for line in three], axis=0) - 1
        assert np.abs(off).max() < 1e-13  # measured 3e-16
        assert len(off) <= sphere_curves.SAMPLES


def test_the_papers_figures_are_those_of_its_scenes():
    rows, lines = findings("paper_figures", cv.Reduced())
    assert rows == []
    rates = {line.quantity for line in lines if line.method == paper_figures.PAPER_MAP}
    assert rates == {*paper_figures.RATES, paper_figures.ENERGY, paper_figures.MOMENTUM}
    assert findings("paper_figures", cv.Reduced(), scenes=(registry.scene("needle"),)) == ([], [])
