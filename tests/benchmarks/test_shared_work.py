"""What studies share instead of doing it again: motions, truths, and what is prepared of a scene."""

from dataclasses import dataclass

import conservative as cv
from conservative.benchmarks.studies import step_ladder, studies
from conservative.benchmarks.studies.study import MOST_TRUTHS, Study, Truths
from conservative.method import Grid
from conservative.registry import method

from .generic_study import SCENE, Broken, truth


def test_a_motion_is_found_once_by_the_studies_that_share_it():
    asked = []

    def find(scene, grid):
        asked.append((scene, grid))
        return truth(scene, grid)

    truths = Truths(find)
    for name in ("convergence", "work_precision"):
        assert list(studies.rows(Study(name, (SCENE,), (cv.Reduced(), method("mujoco:Euler")), quick=True, truth=truths)))
    assert asked == [(SCENE, step_ladder.samples(SCENE, cv.Reduced()))]
    list(studies.rows(Study("convergence", (SCENE,), (cv.Reduced(),), quick=True, truth=Truths(find))))
    assert len(asked) == 2


def test_the_studies_of_a_report_share_their_truths():
    found = studies.cross_studies(studies.MAIN, (SCENE,), (cv.Reduced(),))
    assert [study.name for study in found] == list(studies.MAIN)
    assert len({id(study.truth) for study in found}) == 1
    assert studies.cross_studies(studies.MAIN, (SCENE,), (cv.Reduced(),))[0].truth is not found[0].truth


def test_truths_keep_a_bounded_number_of_motions():
    asked = []
    truths = Truths(lambda scene, grid: asked.append(grid))
    grids = [Grid(0.01, n) for n in range(1, MOST_TRUTHS + 2)]
    for grid in [*grids, grids[-1], grids[0]]:
        truths(SCENE, grid)
    assert asked == [*grids, grids[0]]  # the last is kept, the first had to go


def test_preparation_converts_a_scene_that_other_studies_converted():
    converted = []

    @dataclass(frozen=True)
    class Converting(Broken):
        """A method that keeps what it makes of a scene with the scene."""

        def prepare(self, scene, grid):
            scene.derive(converted.append)
            return cv.Reduced().prepare(scene, grid)

    SCENE.derive(converted.append)
    list(studies.rows(Study("speed", (SCENE,), (Converting("works"),), quick=True, truth=truth)))
    assert converted == [SCENE, SCENE]
