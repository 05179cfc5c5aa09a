"""The study of throughput: random bodies, ways to run them, and the timed settings."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from conservative import BadInput, MissingEngine, MoserVeselov, Reduced, Taylor
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import many_runs, studies, throughput
from conservative.benchmarks.studies.ensembles import DURATION, KINDS, draw
from conservative.benchmarks.studies.many_runs import Way
from conservative.benchmarks.studies.selection import Missing
from conservative.grid import Grid
from conservative.method import Role
from conservative.outcome import OutcomeKind
from conservative.references.environments.catalogue import MuJoCo
from conservative.references.precise import Precise
from conservative.references.solvers.scipy import SciPy
from conservative.references.truth import TIGHTEST, Disagreement, Truth

from ..environments import PATIENCE


@dataclass(frozen=True)
class Ours(MuJoCo):
    """A method with the role of ours that needs no compilation."""

    family: ClassVar[str] = "ours"
    role: ClassVar[Role] = Role.OURS


@dataclass(frozen=True)
class Fails(MuJoCo):
    """An engine that raises where many bodies are prepared."""

    family: ClassVar[str] = "fails"

    def prepare_many(self, bodies, grid):
        raise RuntimeError("planted")


def test_bodies_differ_and_do_not_depend_on_their_number():
    few, many = draw("heavy_tops", 3, seed=1), draw("heavy_tops", 200, seed=1)
    for name in ("R_WB0", "w_WB_B0", "inertia"):
        assert np.array_equal(getattr(few, name), getattr(many, name)[:3])
    assert np.array_equal(few.parameters["com_B"], many.parameters["com_B"][:3])
    moments = np.sort(many.principal[0], axis=1)
    assert (moments[:, 2] / moments[:, 0]).max() < 5.5
    assert (np.diff(moments, axis=1) / moments[:, :1]).min() > 1e-6  # asymmetric, all of them
    assert np.abs(draw("heavy_tops", 3, seed=2).inertia - few.inertia).min() > 1e-6
    with pytest.raises(BadInput):
        draw("other", 3)


def test_starts_of_one_body_differ_and_the_body_does_not():
    starts = draw("one_body", 5)
    first, last = starts.take(0), starts.take(4)
    assert first.body is last.body is starts.scene.body
    assert first.potential is last.potential
    assert np.abs(first.R_WB0 - last.R_WB0).max() > 0.1
    assert np.abs(first.w_WB_B0 - last.w_WB_B0).max() > 0.1
    J = first.body.moments
    assert 20 * np.sqrt(J.mean() / np.linalg.norm(first.potential.moment_B)) == pytest.approx(DURATION)
    assert draw("one_body", 5, seed=1).scene.body.moments[0] != J[0]


@pytest.fixture(scope="module")
def few_steps():
    """No run has more than a tenth of the steps: the finest ones take most of the time and change no conclusion."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(throughput, "STEPS", throughput.STEPS[:14])
        yield


@pytest.fixture(scope="module")
def rows(few_steps):
    study = throughput.throughput_study((Ours("RK4"), MuJoCo("Euler"), Fails()), quick=True, sizes=(1, 3), bodies=1)
    return list(studies.rows(replace(study, scenes=study.scenes[:1], time_limit=PATIENCE)))


def of(rows, method, measure, **fields):
    results = [row for row in rows if (row.family, row.measure) == (method, measure)]
    return [row for row in results if all(getattr(row, name) == value for name, value in fields.items())]


def test_errors_fall_and_times_are_of_each_number_of_bodies(rows):
    errors = [row.value for row in of(rows, "ours", Measure.ATTITUDE_MAX, quantity="median", way="")]
    assert len(errors) >= 4
    assert errors[-1] < 1e-4 < errors[0]
    for size, way in ((1, ""), (3, ""), (3, "one at a time"), (3, "2 threads")):
        times = of(rows, "ours", Measure.TIME, bodies=size, way=way)
        assert times
        assert all(row.value > 0 or row.outcome.kind is OutcomeKind.SKIPPED for row in times)
    assert not of(rows, "mujoco", Measure.TIME, bodies=3)  # Euler does not get to the least error within the time
    assert not of(rows, "mujoco", Measure.ATTITUDE_MAX, way="one at a time")
    assert {(row.field, row.seed) for row in rows} == {("heavy_tops", 0)}


def test_the_truths_agree(rows):
    (row,) = [row for row in rows if row.measure is Measure.AGREEMENT]
    assert row.value < 1e-9  # measured 4e-13
    assert row.label == " and ".join(each.label for each in (Precise(), SciPy("DOP853", TIGHTEST)))


def keep_result(generator, results):
    results.append((yield from generator))


def test_a_body_whose_truths_disagree_is_dropped(few_steps):
    bodies = draw("heavy_tops", 3)

    def find(scene, grid):
        if np.array_equal(scene.w_WB_B0, bodies.w_WB_B0[1]):
            raise Disagreement("planted", ("one", "other"), 0.5, 1e-8)
        return Truth(Taylor(tolerance=1e-13).solve(scene, grid), 1e-13, ("taylor", "other"), float(grid.t[-1]))

    study = throughput.throughput_study((MuJoCo("RK4"),), quick=True, sizes=(2,), bodies=3, truth=find, processes=2)
    study = replace(study, scenes=study.scenes[:1])
    found = list(studies.rows(study))
    dropped, kept = [row for row in found if row.measure is Measure.AGREEMENT]
    assert (dropped.body, dropped.value, dropped.outcome.kind) == (1, 0.5, OutcomeKind.SKIPPED)
    assert kept.value < 1e-9
    kinds = []
    list(keep_result(throughput.find_truth(study, study.scenes[0]), kinds))
    assert np.array_equal(kinds[0].bodies[kinds[0].measured].w_WB_B0, bodies.w_WB_B0[[0, 2]])
    assert {row.process for row in of(found, "mujoco", Measure.TIME, bodies=2) if row.outcome.ok} == {0, 1}


def test_an_engine_that_raises_has_a_row(rows):
    results = of(rows, "fails", Measure.ATTITUDE_MAX, quantity="median")
    assert {row.outcome.kind for row in results} == {OutcomeKind.CRASHED}
    with pytest.raises(RuntimeError):
        many_runs.attempt_many(Way(OursFails()), draw("heavy_tops", 2), Grid(0.1, 2), PATIENCE)


def test_a_missing_engine_is_an_error_or_an_outcome():
    absent, bodies, grid = Missing("mjx", error=MissingEngine("MJX", "mjx")), draw("free_bodies", 2), Grid(0.1, 2)
    assert many_runs.attempt_many(Way(absent), bodies, grid, PATIENCE, skip_missing=True).kind is OutcomeKind.MISSING
    with pytest.raises(MissingEngine):
        many_runs.attempt_many(Way(absent), bodies, grid, PATIENCE)


def test_without_a_truth_there_is_one_row_of_each_kind():
    def refuse(*_):
        raise MissingEngine("heyoka", "heyoka")

    skipping = throughput.throughput_study((Ours(),), quick=True, skip_missing=True, truth=refuse)
    assert [row.outcome.kind for row in studies.rows(skipping)] == [OutcomeKind.MISSING] * len(KINDS)
    with pytest.raises(MissingEngine):
        list(studies.rows(throughput.throughput_study((Ours(),), quick=True, truth=refuse)))


class OursFails(Fails):
    """A method of ours: its exceptions are bugs."""

    role: ClassVar[Role] = Role.OURS


def test_ways_have_the_same_results():
    bodies, grid = draw("free_bodies", 3), Grid(0.1, 4, 2)
    results = [many_runs.RunBlocks(way, bodies, grid)().R_WB for way in many_runs.list_ways(Ours("RK4"))]
    assert len(results) == 3
    assert np.abs(results[0] - results[1]).max() < 1e-14  # measured 4e-16
    assert np.array_equal(results[0], results[2])


def test_a_setting_beyond_the_time_limit_is_skipped_with_a_reason():
    point = throughput.BatchSetting(Way(Ours()), None, {}, spent=0.01, prepare=0.02)
    assert throughput.refuse_long(point, 10, 0.2) is None
    assert throughput.refuse_long(point, 30, 0.2).reason.startswith("a call would take 0.3 s")
    assert "preparing" in throughput.refuse_long(throughput.BatchSetting(Way(Ours()), None, {}, 1e-6, 1.0), 10, 0.2).reason
    assert throughput.refuse_long(point, 1, 1e-9) is None  # one body is always tried


def test_an_exact_setting_stands_for_its_family_in_the_coarse_study():
    methods = (MoserVeselov(order=2), MoserVeselov(), Reduced())
    assert many_runs.family_settings(methods) == (MoserVeselov(), Reduced())


@pytest.mark.parametrize("extent", [{"sizes": (0,)}, {"sizes": ()}, {"bodies": 0}, {"time_limit": -1.0}])
def test_numbers_that_make_no_study(extent):
    with pytest.raises(BadInput):
        throughput.throughput_study((Ours(),), **extent)
