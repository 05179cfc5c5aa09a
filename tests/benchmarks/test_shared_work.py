"""Work shared by studies: instants, reference solutions, and the conversion of a scene."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import conservative as cv
from conservative.benchmarks.measures import errors
from conservative.benchmarks.studies import step_ladder, studies, work_precision
from conservative.benchmarks.studies.study import MOST_TRUTHS, Study, remember_truths
from conservative.grid import Grid
from conservative.method import Role
from conservative.references.exact.method import Exact
from conservative.registry import method
from conservative.reports.run.plan import plan_report

from .generic_study import SCENE, Broken, truth


def test_studies_share_their_reference_solutions():
    asked = []

    def find(scene, grid):
        asked.append((scene, grid))
        return truth(scene, grid)

    truths = remember_truths(find)
    for name in ("convergence", "work_precision"):
        assert list(studies.rows(Study(name, (SCENE,), (cv.Reduced(), method("mujoco:Euler")), quick=True, truth=truths)))
    assert asked == [(SCENE, step_ladder.samples(SCENE, cv.Reduced()))]
    list(studies.rows(Study("convergence", (SCENE,), (cv.Reduced(),), quick=True, truth=remember_truths(find))))
    assert len(asked) == 2


def test_a_quick_study_has_all_tolerances():
    """With a third of them, `taylor` was 1.6 times as fast as heyoka on the Lagrange top at 1e-3 rad; with all, 0.5 times."""
    whole, quick = (
        work_precision.list_cases(Study("work_precision", (SCENE,), (method("heyoka"),), quick=few), SCENE, method("heyoka"))
        for few in (False, True)
    )
    assert [case.method for case in quick] == [case.method for case in whole]
    assert {case.method.tol for case in quick} > set(step_ladder.TOLERANCES)


def test_the_studies_of_a_report_share_their_truths():
    one, other = (plan_report(["brick_flip"], ["reduced"]).studies for _ in range(2))
    assert len(one) > 4
    assert len({id(study.truth) for study in one}) == 1
    assert other[0].truth is not one[0].truth


def test_truths_keep_a_bounded_number_of_motions():
    asked = []
    truths = remember_truths(lambda scene, grid: asked.append(grid))
    grids = [Grid(0.01, n) for n in range(1, MOST_TRUTHS + 2)]
    for grid in [*grids, grids[-1], grids[0]]:
        truths(SCENE, grid)
    assert asked == [*grids, grids[0]]  # the last is kept, the first had to go


def test_preparation_converts_a_scene_that_other_studies_converted():
    converted = []

    @dataclass(frozen=True)
    class Converting(Broken):
        """A method that stores its conversion of a scene with the scene."""

        def prepare(self, scene, grid):
            scene.derive(converted.append)
            return cv.Reduced().prepare(scene, grid)

    SCENE.derive(converted.append)
    list(studies.rows(Study("speed", (SCENE,), (Converting("works"),), quick=True, truth=truth)))
    assert converted == [SCENE, SCENE]


@dataclass(frozen=True)
class Closed(cv.Method):
    """The exact motion under the name of a method of some order; None: a method with exact steps."""

    steps: int | None
    family: ClassVar[str] = "closed"
    role: ClassVar[Role] = Role.OURS
    kernel: ClassVar[str] = "known to end, so that it runs in this process"

    @property
    def order(self):
        return self.steps

    def prepare(self, scene, grid):
        return Exact().prepare(scene, grid)


@dataclass(frozen=True)
class Adaptive(Closed):
    """The same with a tolerance instead of a step."""

    steps: None = None
    tol: float = 1e-9
    family: ClassVar[str] = "adaptive"


METHODS = (Closed(1), Closed(2), Closed(8), Closed(None), Adaptive())


@pytest.mark.parametrize("name", ["convergence", "work_precision"])
def test_every_line_has_the_same_instants(name, monkeypatch):
    seen, measure = [], errors.measure_errors

    def record(trajectory, exact):
        seen.append(trajectory.t)
        return measure(trajectory, exact)

    monkeypatch.setattr(errors, "measure_errors", record)
    result = list(studies.rows(Study(name, (SCENE,), METHODS, quick=True, truth=truth)))
    read = {row.series for row in result if row.measure.text.startswith("attitude") and row.outcome.ok}
    assert len(read) == (3 if name == "convergence" else len(METHODS))  # that one is of methods with an order alone
    expected = np.linspace(0.0, SCENE.t_end, step_ladder.SAMPLES + 1)
    assert len(seen) >= 3 * len(read) - 1
    assert all(t.shape == expected.shape and np.allclose(t, expected, rtol=1e-14, atol=0) for t in seen)  # measured 2e-16
