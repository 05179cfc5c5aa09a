"""The study of random bodies: measured settings, instants of the errors, and timed settings."""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between, rotation_about
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import frame
from conservative.benchmarks.measures.processes import Processes
from conservative.benchmarks.speed_ratio import costs
from conservative.benchmarks.studies import random, selection, studies
from conservative.benchmarks.studies.case import NOT_DRAWN, Case
from conservative.benchmarks.studies.random import DECADES, SAMPLES, TimedSetting
from conservative.benchmarks.studies.speed import timed_part
from conservative.benchmarks.studies.study import Study
from conservative.grid import Grid
from conservative.method import Role
from conservative.outcome import Outcome, OutcomeKind
from conservative.references import truth
from conservative.registry import method
from conservative.reports.rows.names import with_names
from conservative.reports.rows.points import points as points_of
from conservative.scenes.random_body import FIELDS, random_body

from ..sampling import sampled
from .generic_study import SCENE, Broken

BODY = random_body()
METHODS = (cv.Projected(), method("heyoka"))


@pytest.fixture(scope="module")
def rows():
    """Rows of one body in uniform gravity, of a quick study."""
    every = random.random_study(METHODS, 1, 3, quick=True)
    study = replace(every, scenes=every.scenes[:1], drawn=every.drawn[:1])
    return list(studies.findings(study))


def made_up(name, error, spent):
    """Return a point of a line without a run."""
    return TimedSetting(Case("random", SCENE, method(name), Grid(0.1, 12)), error, spent, None)


def line_of(value, quick=False):
    """Return the settings of a method on one body."""
    return random.list_cases(Case("random", BODY, value, Grid(BODY.t_end / SAMPLES, SAMPLES)), quick)


def test_bodies_are_the_first_ones_whatever_their_number():
    few, many = (random.random_study(METHODS, number, 3).scenes for number in (2, 5))
    assert len(many) == 5 * len(FIELDS)
    by_name = {scene.name: scene for scene in many}
    assert all(np.array_equal(scene.w_WB_B0, by_name[scene.name].w_WB_B0) for scene in few)
    assert {scene.name for scene in few} < set(by_name)


def test_rows_have_field_seed_and_index_of_their_body(rows):
    assert {(row.field, row.seed, row.body) for row in rows} == {("gravity", 3, 0)}


@pytest.mark.parametrize(("bodies", "seed", "argument"), [(0, 0, "bodies"), (1.5, 0, "bodies"), (1, -1, "seed")])
def test_bad_numbers(bodies, seed, argument):
    with pytest.raises(cv.BadInput) as caught:
        random.random_study(METHODS, bodies, seed)
    assert caught.value.argument == argument


def test_every_point_has_an_error_and_a_time_or_a_reason(rows):
    errors = {(row.method, row.dt): row for row in rows if row.measure is Measure.ATTITUDE_MAX}
    times = {(row.method, row.dt): row for row in rows if row.measure is Measure.TIME}
    assert set(times) == {key for key, row in errors.items() if row.outcome.ok}
    assert all(row.value > 0 or row.outcome == random.UNTIMED for row in times.values())
    assert {row.series for row in times.values() if row.outcome.ok} == {"projected", "heyoka"}


def test_errors_fall_as_far_as_the_last_decade(rows):
    for name in ("projected", "heyoka"):
        errors = [row.value for row in rows if row.series == name and row.measure is Measure.ATTITUDE_MAX and row.outcome.ok]
        assert min(errors) < DECADES[-1] * 10  # measured 2e-13 and 4e-14
        assert errors[0] == max(errors)


def test_all_settings_are_read_at_the_same_instants():
    times = [case.grid.t for method in METHODS for case in line_of(method)]
    assert {len(t) for t in times} == {SAMPLES + 1}
    assert all(np.allclose(t, times[0], rtol=1e-12, atol=0) for t in times)


def test_ours_with_a_tolerance_are_among_the_settings():
    assert [setting.tolerance for setting in random.settings(cv.Taylor())] == [None, None, None, 1e-9]
    assert not random.settings(cv.MoserVeselov())


def test_a_program_with_two_names_is_measured_once():
    """For a body without symmetry in a field, heyoka's lean frame is that of base vectors."""
    names = ("heyoka:frame=base_vectors", "heyoka:frame=lean", "heyoka")
    study = Study("random", (BODY, cv.scenes.brick_flip()), tuple(map(method, names)))
    assert [same and same.reason for _, same in study.programs(BODY)] == [
        None,
        "the same program as heyoka:frame=base_vectors",
        None,
    ]
    assert [same for _, same in study.programs(study.scenes[1])] == [None] * 3
    lean = replace(
        random.random_study(METHODS, 1, 3, quick=True), methods=study.methods[:2], scenes=(BODY,), drawn=(NOT_DRAWN,)
    )
    measured = [row for row in studies.findings(lean) if row.series == "heyoka:frame=lean"]
    assert [row.outcome.kind for row in measured] == [OutcomeKind.SKIPPED]


def test_tolerances_of_ours_are_credited_and_interpolated_as_one_line():
    study = replace(random.random_study((cv.Taylor(tolerance=1e-9),), 1, 3, quick=True), scenes=(BODY,), drawn=(NOT_DRAWN,))
    points = points_of(with_names(frame(studies.findings(study))), "random", untimed=True)
    assert set(points["name"]) == {"taylor tolerance"}
    assert len(points) == points["method"].nunique() >= 5  # measured 7; no tolerance is finer than the last decade
    between = math.sqrt(points["error"][3] * points["error"][4])
    assert len(costs(points, [between])) == 1  # an error between two settings, of a line and not of each setting


def test_both_sides_have_as_many_settings():
    assert [len(line_of(method)) for method in METHODS] == [17, 17]
    assert [len(line_of(method, quick=True)) for method in METHODS] == [9, 9]


def test_a_tolerance_that_an_engine_does_not_take_is_left_out():
    scipy = [case.method.rtol for case in line_of(method("scipy"))]
    assert min(scipy) == 1e-13


def test_the_settings_of_each_family():
    assert cv.Lame not in {
        type(method) for method in selection.methods(settings=random.settings)
    }  # exact, for symmetric bodies
    chosen = random.select(selection.methods())
    ours = {each.name for each in chosen if each.role == Role.OURS}
    assert {"projected", "gauss", "reduced:order=6"} <= ours
    assert "reduced" not in ours  # of order 2
    assert {each.frame for each in chosen if each.family == "heyoka"} == {"body", "lean", "angle"}
    assert {each.name for each in chosen if each.family in ("mujoco", "pinocchio")} == {"mujoco", "pinocchio"}


def test_only_settings_that_may_decide_are_timed():
    cheap = [made_up("projected", error, time) for error, time in ((1e-1, 1.0), (1e-5, 2.0), (1e-13, 4.0))]
    expensive = [made_up("gauss", error, random.MARGIN * 8 * time) for error, time in ((1e-1, 1.0), (1e-5, 2.0), (1e-13, 4.0))]
    other = [made_up("heyoka", 1e-13, 1e3)]  # another side, however expensive
    assert random.worth_timing([cheap, expensive, other]) == [*cheap, *other]
    near = [replace(point, spent=point.spent / 24) for point in expensive]
    assert set(map(id, random.worth_timing([cheap, near, other]))) == set(map(id, [*cheap, *near, *other]))


def test_an_isolated_good_point_is_timed_by_its_credited_error():
    line = [made_up("projected", error, time) for error, time in ((1e-13, 1.0), (1e-1, 2.0), (1e-13, 4.0), (1e-14, 8.0))]
    assert random.worth_timing([line]) == line[1:3]


def test_the_timed_motion_is_the_one_whose_errors_are_read(monkeypatch):
    """Final state only, and as long as the scene. 50 times as long, a method could be faster on another part of the motion."""
    prepared, study = [], random.random_study(METHODS, 1, 3, quick=True)
    real = random.prepare_unchecked
    monkeypatch.setattr(random, "prepare_unchecked", lambda case: prepared.append(case) or real(case))
    point = line_of(METHODS[0])[3]
    with Processes() as processes:
        rows = list(random.time_rows(study, [TimedSetting(point, 1e-6, 1e-6, METHODS[0].solve(BODY, point.grid))], processes))
    assert [case.grid for case in prepared] == [Grid(point.grid.dt, point.grid.n_steps, point.grid.n_steps)]
    assert prepared[0].grid.dt * prepared[0].grid.n_steps == pytest.approx(BODY.t_end)
    assert [row.measure for row in rows] == list(random.TIMES)
    assert all(row.value > 0 for row in rows)


TIMED = "taylor", "projected", "gauss", "heyoka", "heyoka:frame=base_vectors"
COMPILED = [("gradient", "taylor"), ("gradient", "projected")]
"""The loops of these are those of `gravity`, with another field, whose kernels take seconds to compile."""


@pytest.mark.parametrize(("field", "name"), sampled(product(("gravity", "gradient"), TIMED), leave=COMPILED))
def test_the_timed_loop_reaches_the_final_state(name, field):
    """`own_loop` of a run leaves the kernel's arrays, or heyoka's state, as the run itself does."""
    scene = random_body(field, 3, 0)
    run = method(name)
    if run.unsupported(scene):
        pytest.skip("its field turns")
    run = run.prepare(scene, Grid(scene.t_end / 48, 48, 48))
    before, counts = run(), run.own_loop()
    if not name.startswith("heyoka"):
        assert before.counters.steps == counts[0]
    assert np.array_equal(run().R_WB, before.R_WB)


def deliver(value, scene):
    """Return what the timed call of a user delivers: final attitude and rates. A second call starts again."""
    run = value.prepare(scene, Grid(scene.t_end, 1, 1))
    call = timed_part(run, Measure.TIME_DELIVERED)
    first, second = call(), call()
    if isinstance(first, cv.Trajectory):
        assert call is run  # the public call of ours
        first, second = ((each.R_WB[-1], each.w_WB_B[-1]) for each in (first, second))
    for before, after in zip(first, second, strict=True):
        assert np.array_equal(before, after)
        assert not np.shares_memory(before, after)
    return first


@pytest.mark.parametrize("index", range(2))
@pytest.mark.parametrize("field", FIELDS)
def test_both_sides_deliver_the_same_attitude_and_rates(field, index):
    """Every setting of heyoka that is timed, against `Taylor`: R_WB and w_WB_B of bodies whose axes are not principal axes."""
    scene = random_body(field, 6001, index)
    R_WB, w_WB_B = deliver(cv.Taylor(tolerance=1e-15), scene)
    assert not np.allclose(scene.body.R_BP, np.eye(3), atol=0.1)
    settings = [setting for setting in random.settings(method("heyoka")) if not setting.unsupported(scene)]
    assert len(settings) == (4 if field == "gradient" else 5)
    for setting in settings:
        R, w = deliver(replace(setting, tol=1e-16), scene)
        assert angle_between(R, R_WB) < 2e-13, setting.name  # measured: 4.2e-14
        assert np.abs(w - w_WB_B).max() < 2e-13, setting.name  # measured: 3.3e-14
    R, w = deliver(method("scipy:rtol=1e-14,loop=compiled"), scene)
    assert angle_between(R, R_WB) < 2e-12  # measured: 2.1e-13
    assert np.abs(w - w_WB_B).max() < 2e-12  # measured: 1.3e-13


def test_a_user_s_call_and_the_compiled_loop_are_timed(monkeypatch):
    """In this process and in others: the public call of ours, and heyoka's call with the conversion of its state."""
    timed, study = {}, random.random_study(METHODS, 1, 3, quick=True)

    class Noting(Processes):
        def time(self, runs, prepares, *others, **more):
            timed.update({key: (runs[key], prepares[key]) for key in runs})
            return {}

    for value in (cv.Taylor(tolerance=1e-6), method("heyoka:tol=1e-6")):
        point = replace(line_of(value)[0], method=value)
        with Noting() as processes:
            trajectory = value.solve(BODY, point.grid)
            assert not list(random.time_rows(study, [TimedSetting(point, 1.0, 1e-6, trajectory)], processes))
    assert [(case.method.family, measure) for case, measure in timed] == [
        (family, measure) for family in ("taylor", "heyoka") for measure in random.TIMES
    ]
    for (case, measure), (run, prepare) in timed.items():
        results = run(), prepare()()
        if measure is Measure.TIME:  # counts of ours, or heyoka's state
            assert not any(isinstance(result, cv.Trajectory) for result in results)
        elif case.method.role is Role.OURS:
            assert all(isinstance(result, cv.Trajectory) for result in results)
        else:
            assert all([part.shape for part in result] == [(3, 3), (3,)] for result in results)


def test_settings_at_the_compared_tolerances_are_timed():
    """Also where they decide no error: here two frames, one of them slower, and one that is slower by more than `MARGIN`."""
    names = ("taylor:tolerance=1e-06", "heyoka:tol=1e-06", "heyoka:tol=1e-06,frame=lean", "heyoka:tol=1e-06,frame=angle")
    lines = [[made_up(name, 1.0, spent)] for name, spent in zip(names, (1.0, 2.0, 2.9, 2.0 * random.MARGIN + 0.1), strict=True)]
    assert random.worth_timing(lines) == [points[0] for points in lines[:3]]
    assert not random.worth_timing([[made_up("heyoka:tol=1e-05", 1.0, 1.0)]])


@pytest.mark.parametrize(
    ("how", "kind"), [("raises", OutcomeKind.CRASHED), ("diverges", OutcomeKind.DIVERGED), ("is skewed", None)]
)
def test_a_run_that_is_timed_has_to_end_and_may_drift(how, kind):
    result = random.prepare_unchecked(Case("random", SCENE, Broken(how), Grid(0.1, 12, 12)))
    assert (result.kind if isinstance(result, Outcome) else None) == kind


def test_a_bug_of_ours_is_no_outcome():
    class Ours(Broken):
        role = Role.OURS

    with pytest.raises(RuntimeError, match="planted"):
        random.prepare_unchecked(Case("random", SCENE, Ours("raises"), Grid(0.1, 12, 12)))


def test_bodies_whose_truths_disagree_are_not_compared(monkeypatch):
    """Planted: a second solution that is wrong by 1e-12 rad."""
    real = truth.collocate

    def wrong(*arguments):
        found = real(*arguments)
        return replace(found, R_WB=found.R_WB @ rotation_about((1.0, 2.0, 3.0), 1e-12))

    monkeypatch.setattr(truth, "collocate", wrong)
    study = random.random_study(METHODS, 1, 3, quick=True)
    short = study.scenes[0].rename(study.scenes[0].name, t_end=study.scenes[0].t_end / 8)
    (row,) = studies.findings(replace(study, scenes=(short,), drawn=study.drawn[:1]))
    assert (row.measure, row.outcome.kind) == (Measure.AGREEMENT, OutcomeKind.SKIPPED)
    assert row.value == pytest.approx(1e-12, rel=0.05)
    assert (row.field, row.seed, row.body) == ("gravity", 3, 0)
