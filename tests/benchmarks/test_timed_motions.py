"""What is timed is what is credited: every timed run ends at the time and in the state of the run whose error is reported."""

from collections import defaultdict
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import rotation_about
from conservative.benchmarks.measures import processes
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.timing import Timing
from conservative.benchmarks.recommendation import recommend
from conservative.benchmarks.studies import speed, studies
from conservative.benchmarks.studies.study import Study
from conservative.benchmarks.versions import engine
from conservative.benchmarks.versions.times import Clock
from conservative.grid import grid_for
from conservative.outcome import OK
from conservative.references.truth import Truth

from ..sampling import sampled
from .generic_study import SCENE
from .versions.made_up import TIMED, Side

credited, timed = defaultdict(list), defaultdict(list)
now = [credited]


class Logged:
    """A method that notes the end of each motion, by scene, setting and step size, as credited or as timed."""

    def prepare(self, scene, grid):
        run = super().prepare(scene, grid)

        def note():
            now[0][scene.key, self.name, grid.dt].append((grid.dt * grid.n_steps, run().R_WB[-1]))

        def whole():
            note()
            return run()

        whole.own_loop = note
        return whole

    def prepare_many(self, bodies, grid):
        return None  # one at a time


@dataclass(frozen=True)
class Steps(Logged, cv.Gauss): ...


@dataclass(frozen=True)
class Tolerance(Logged, cv.Taylor): ...


METHODS = (Steps(), Tolerance(tolerance=1e-9))


def truth(scene, grid):
    return Truth(cv.Taylor(tolerance=1e-13).solve(scene, grid), 1e-13, ("taylor", "other"), scene.t_end)


def call_once(runs, *_, **__):
    now[0] = timed
    for run in runs.values():
        run()
    now[0] = credited
    return dict.fromkeys(runs, Timing(1.0, 1.0, 1, 1))


@pytest.fixture(autouse=True)
def _noted(monkeypatch):
    credited.clear()
    timed.clear()
    for module in (speed, processes, recommend, engine):
        monkeypatch.setattr(module, "time_interleaved", call_once)


def check():
    assert timed
    for key, motions in timed.items():
        end, R_WB = credited[key][0]
        for other, R in motions:
            assert other == pytest.approx(end, rel=1e-14)
            np.testing.assert_allclose(R, R_WB, atol=1e-9)  # a step that ends at a sample differs by 3e-11


def assert_over(t_end):
    assert [end for motions in timed.values() for end, _ in motions] == pytest.approx([t_end] * sum(map(len, timed.values())))


@pytest.mark.parametrize("name", sampled([name for name, each in studies.STUDIES.items() if each.timed], leave=["long_time"]))
def test_a_study_times_the_motion_that_it_credits(name):
    declared = studies.STUDIES[name]
    few = {"quick": True, "bodies": 1, **({"sizes": (1,)} if "sizes" in declared.options else {})}
    study = declared.plan(METHODS, **few) if declared.draw else declared.plan(METHODS, (SCENE,), quick=True)
    study = replace(study, scenes=study.scenes[:1], drawn=study.drawn[:1], truth=truth)
    list(studies.findings(study))
    if name == "long_time":  # its runs are as long as its time allows, and it has no times
        assert not timed
        return
    check()
    assert {key[1].partition(":")[0] for key in timed} == {"gauss", "taylor"}
    if not declared.draw:
        assert_over(SCENE.t_end)


class Elsewhere(cv.Gauss):
    """A method that ends 0.1 rad elsewhere if samples are not asked for."""

    conserves = frozenset()

    def prepare(self, scene, grid):
        run = super().prepare(scene, grid)

        def elsewhere():
            done = run()
            turned = np.stack([done.R_WB[0], done.R_WB[-1] @ rotation_about([0, 0, 1], 0.1)])
            return replace(done, R_WB=turned) if len(done.t) == 2 else done

        return elsewhere


@pytest.mark.parametrize("name", ["work_precision", "each_step", "random"])
def test_a_run_that_ends_elsewhere_is_not_timed(name):
    declared = studies.STUDIES[name]
    study = (
        declared.plan((Elsewhere(),), quick=True, bodies=1)
        if declared.draw
        else declared.plan((Elsewhere(),), (SCENE,), quick=True)
    )
    study = replace(study, scenes=study.scenes[:1], drawn=study.drawn[:1], truth=truth)
    rows = [row for row in studies.findings(study) if row.measure in (Measure.TIME, Measure.TIME_SAMPLED)]
    assert not timed
    assert any("0.1 rad" in row.outcome.reason for row in rows), [row.outcome for row in rows]


def test_versions_of_an_engine_are_timed_over_the_scene():
    study = Study("speed", (SCENE,), METHODS)
    engine.time_versions(study, SCENE, dict(zip("12", METHODS, strict=True)))
    check()
    assert_over(SCENE.t_end)


def test_recommended_settings_are_timed_over_the_motion_of_their_probes():
    probes = [SimpleNamespace(outcome=OK, length=1.2, dt=0.02, method=method) for method in METHODS]
    for probe in probes:
        probe.method.prepare(SCENE, cv.Grid(0.02, 60))()
        credited[SCENE.key, probe.method.name, 1.2] = credited[SCENE.key, probe.method.name, 0.02]
    refinements = {probe.method.name: SimpleNamespace(best=lambda target, probe=probe: probe) for probe in probes}
    conditions = SimpleNamespace(target=1e-3, scene=SCENE, time_limit=60.0, duration=9.0)
    assert len(recommend.time_settings(conditions, refinements)) == 2
    check()


@pytest.mark.parametrize(("factor", "share"), [(1.0, 1.0), (100.0, 0.0)])
def test_versions_of_a_project_are_timed_over_the_scene_or_its_first_steps(factor, share):
    base, head = Side(factor), Side(factor)
    asked = []
    for side in (base, head):
        side.timed = lambda *row, real=side.timed: asked.append(row[-1]) or real(*row)
    Clock(base, head).measure([TIMED], 1)
    scene = cv.registry.scene(TIMED[0])
    whole = grid_for(scene, scene.dt).n_steps
    assert max(asked) <= whole
    assert (asked[-1] == whole) == bool(share)  # of 600 steps of 1 us, or of 100 us
