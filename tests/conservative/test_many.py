"""Many bodies at once: numbers, drifts and failures equal those of each body alone; bad input is refused first."""

from __future__ import annotations

import os
import pickle
import signal
import threading
import time
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.attitude import from_quaternion, orthonormality, rotation_about
from conservative.batch import Batch
from conservative.drifts import arrange_drifts, find_reference, list_drifts, measure_drifts
from conservative.integration import blocks, memory, shared_choice
from conservative.integration.inputs import read_bodies
from conservative.invariants import Invariant, kept_sizes, momentum_W, sizes
from conservative.method import Method, Role
from conservative.methods.between import SampleTimes
from conservative.methods.many import Block, pause
from conservative.methods.trials import Estimate
from conservative.outcome import ProgressOfMany
from conservative.trajectory import Trajectory

from ..environments import wait_until
from .one_body import BODY, TURN, body_in_axes


def starts(n, seed=14):
    """Return attitudes (n, 3, 3) and rates (n, 3), rad/s."""
    rng = np.random.default_rng(seed)
    q = rng.normal(size=(n, 4))
    return from_quaternion(q / np.linalg.norm(q, axis=1)[:, None]), rng.normal(size=(n, 3))


def tensors(n, seed=14):
    """Return inertia (n, 3, 3), kg m^2, with moments that are well apart."""
    rng = np.random.default_rng(seed)
    axes = from_quaternion(rng.normal(size=(n, 4)))
    axes /= np.cbrt(np.linalg.det(axes))[:, None, None]
    moments = np.array([1.0, 1.4, 2.0]) * rng.uniform(0.9, 1.1, (n, 3))
    found = axes @ (moments[:, :, None] * np.swapaxes(axes, 1, 2))
    return (found + np.swapaxes(found, 1, 2)) / 2


def scene(potential=None, body=BODY, **more):
    return cv.Scene("generic", body, rotation_about((1, 0.2, -1), 0.7), (0.3, -2.0, 1.0), 2.0, potential, **more)


def fields(n, seed=14):
    """Return potentials by name, and parameters that differ from body to body."""
    rng = np.random.default_rng(seed)
    points, anchors = rng.uniform(0.1, 0.3, (n, 3)), rng.uniform(0.6, 0.9, (n, 3))
    size = rng.uniform(1.0, 3.0, n)
    gradient = cv.GravityGradient(0.7, BODY.inertia, (1, 0, 1))
    orbit = cv.Orbit(0.7, (0, 0, 1)).gravity_gradient(BODY.inertia, (1, 0, 0))
    own = cv.FunctionPotential(lambda R: R[2, 0] ** 3, lambda R: np.outer([0, 0, 1], [3 * R[2, 0] ** 2, 0, 0]), 1.0)
    return {
        "free": (None, {}),
        "gravity": (cv.UniformGravity(3.0, (0.1, 0.2, 0.3)), {"weight": size, "com_B": points}),
        "gravity, one number": (cv.UniformGravity(3.0, (0.1, 0.2, 0.3)), {"com_B": points}),
        "spring": (cv.LinearSpring(3.0, (0.2, 0.1, 0.4), (0.5, 0, 0.3), 0.1), {"stiffness": size, "anchor_W": anchors}),
        "rest length": (cv.LinearSpring(3.0, (0.2, 0.1, 0.4), (0.5, 0, 0.3), 0.1), {"rest_length": size, "point_B": points}),
        "attraction": (cv.PointAttraction(2.0, (0.2, 0.1, 0.4), (1.5, 0, 0.3)), {"strength": -size, "anchor_W": anchors}),
        "gradient": (gradient, {"rate": size, "direction_W": anchors, "inertia": tensors(n)}),
        "orbit": (orbit, {"inertia": tensors(n)}),
        "function": (own, {}),
    }


N = 11
WAYS = {
    "alone": cv.Gauss(2),
    "on lanes": cv.Reduced(),
}
SAMPLES = {"dt": 0.05, "t_end": 0.5, "sample_every": 3}


def rename(given):
    """Return the scene of a body as users write it, with every check."""
    return cv.Scene("one", cv.RigidBody(given.body.inertia), given.R_WB0, given.w_WB_B0, given.t_end, given.potential)


def require_same(found, method):
    """Compare all bodies of an ensemble with `integrate`."""
    for i, of_many in enumerate(found):
        alone = cv.integrate(rename(found.bodies.take(i)), 0.05, method, 0.5, 3)
        np.testing.assert_array_equal(of_many.t, alone.t)
        np.testing.assert_allclose(of_many.R_WB, alone.R_WB, rtol=0, atol=1e-14)  # 3e-15
        np.testing.assert_allclose(of_many.w_WB_B, alone.w_WB_B, rtol=0, atol=1e-14)
        assert of_many.ok
    assert found.label.startswith(method.label)  # of one body, it says more


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("field", ["free", "gravity"])
def test_numbers_are_those_of_one_at_a_time(way, field):
    potential, parameters = fields(N)[field]
    given = {"inertia": tensors(N), "parameters": parameters, "method": WAYS[way], **SAMPLES}
    found = cv.integrate_many(scene(potential), *starts(N), **given)
    require_same(found, WAYS[way])
    assert len(found) == N
    assert found.R_WB.shape == (N, 5, 3, 3)
    assert max(values.max() for values in found.drifts.values()) < 1e-14  # 2e-15
    assert set(found.drifts) == {"orthonormality", *(invariant.name for invariant in scene(potential).invariants)}


def test_missing_arguments_are_those_of_the_scene():
    R, w = starts(2)
    own = scene(cv.UniformGravity(3.0, (0.1, 0.2, 0.3)))
    for given in (
        {"w_WB_B0": w},
        {"R_WB0": R},
        {"R_WB0": Rotation.from_matrix(R)},
        {"inertia": [[1.0, 1.4, 2.0], [2.0, 1.4, 1.0]]},
        {"parameters": {"weight": [1.0, 2.0]}},
        {},
    ):
        require_same(cv.integrate_many(own, **given, method=cv.Gauss(2), **SAMPLES), cv.Gauss(2))


def test_one_body_costs_no_other_bits():
    given, dt = scene(), {"dt": 0.05, "method": "reduced"}
    alone, found = cv.integrate(given, **dt), cv.integrate_many(given, **dt)
    np.testing.assert_array_equal(found.R_WB[0], alone.R_WB)
    np.testing.assert_array_equal(found[0].w_WB_B, alone.w_WB_B)
    assert found.bodies.first is given  # with all that it has been converted to
    assert dict(found.drifts).keys() == {"orthonormality", "energy", "momentum"}
    assert len(found.drifts) == 3
    assert found.drifts["energy"].shape == (1,)


def test_numbers_depend_neither_on_blocks_nor_on_threads(monkeypatch):
    runs, before = [{"threads": 1}, {"threads": 1}, {"threads": 2}, {}], threading.active_count()
    found = []
    for most, run in zip((1024, 4, 4, 3), runs, strict=True):
        monkeypatch.setattr(blocks, "MOST_BODIES", most)
        found.append(cv.integrate_many(scene(), *starts(N), inertia=tensors(N), **run, **SAMPLES))
    for other in found[1:]:
        np.testing.assert_array_equal(other.R_WB, found[0].R_WB)
        np.testing.assert_array_equal(other.w_WB_B, found[0].w_WB_B)
        assert all((values == found[0].drifts[name]).all() for name, values in other.drifts.items())
    assert threading.active_count() <= before


def test_blocks_are_as_large_as_their_samples_allow():
    assert blocks.list_blocks(2500, cv.Grid(0.1, 10)) == range(0, 2500, 1024)
    assert blocks.list_blocks(1, cv.Grid(0.1, 10**4)).step == 17  # 16.3 MB
    assert blocks.list_blocks(1, cv.Grid(0.1, 10**6)).step == 1


def test_progress_is_reported_after_each_block(monkeypatch):
    monkeypatch.setattr(blocks, "MOST_BODIES", 4)
    told = []
    cv.integrate_many(scene(), *starts(N), progress=told.append, threads=1, **SAMPLES)
    assert [each.done for each in told] == [4, 8, 11]
    assert {each.total for each in told} == {11}
    assert told[-1].left == 0
    cv.integrate_many(scene(), progress=told.append, **SAMPLES)
    assert (told[-1].done, told[-1].total) == (1, 1)


@pytest.fixture(scope="module")
def ensemble():
    return cv.integrate_many(scene(), *starts(N), **SAMPLES)


def test_bodies_that_were_there_count_for_no_speed():
    progress = ProgressOfMany(elapsed=2.0, done=50, total=100, found=30)
    assert progress.rate == 10.0


def test_parts_of_an_ensemble(ensemble):
    part = ensemble[3:9:2]
    assert len(part) == 3
    np.testing.assert_array_equal(part[1].R_WB, ensemble[5].R_WB)
    np.testing.assert_array_equal(part[-1].R_WB, ensemble[7].R_WB)
    np.testing.assert_array_equal(part.drifts["energy"], ensemble.drifts["energy"][3:9:2])
    assert isinstance(part.bodies, Batch)
    assert ensemble.outcome(-1).ok
    assert ensemble.ok.all()
    with pytest.raises(IndexError):
        ensemble[N]


def test_tables_of_samples_and_of_bodies(ensemble):
    assert "11 bodies, 5 samples to 0.5 s, 11 ok" in repr(ensemble)
    samples, bodies = ensemble.to_pandas(), ensemble.to_pandas("bodies")
    assert list(samples.columns)[:3] == ["body", "t", "R_WB_11"]
    assert len(samples) == N * 5
    own = samples[samples["body"] == 4].drop(columns="body").reset_index(drop=True)
    assert own.equals(ensemble[4].to_pandas())
    assert list(bodies["outcome"]) == ["ok"] * N
    assert bodies.loc[4, "drift of energy"] == ensemble.drifts["energy"][4]


def test_one_step_for_all_comes_from_an_error():
    wanted = {"t_end": 2.0, "error": 1e-6, "dt": 1.0, "parameters": {"weight": np.linspace(1, 9, N)}}
    own, (R, w) = scene(cv.UniformGravity(3.0, (0.1, 0.2, 0.3))), starts(N)
    w = np.concatenate([w[:-1], 9 * w[-1:]])
    found = cv.integrate_many(own, R, w, **wanted)
    assert found.choice.bodies == N  # of more, 16
    assert found.choice.reached
    assert found.choice.grid.n_steps == found.grid.n_steps
    np.testing.assert_allclose(found.t, [0, 1, 2], rtol=1e-15)
    finer = cv.integrate_many(
        own, R, w, parameters=wanted["parameters"], method=cv.Taylor(), dt=0.01, t_end=2.0, sample_every=100
    )
    assert np.abs(found.R_WB - finer.R_WB).max() < 1e-6  # 2e-9
    with pytest.raises(cv.BadInput, match=r"^method: .* None together with error"):
        cv.integrate_many(own, R, w, **wanted, method="reduced")


def test_a_body_that_fails_verification_shortens_the_step_of_all(monkeypatch):
    n, error = 100, 1e-6
    bodies = read_bodies(scene(cv.UniformGravity(3.0, (0.1, 0.2, 0.3))), *starts(n), None, None)
    numbers = shared_choice.pick(bodies)
    sensitive, steps = numbers[-1], []  # one of those that are only verified
    assert len(numbers) == 16

    def find_worst(bodies, numbers, method, grid):
        steps.append(grid.dt)
        truncation = error / 2 * (grid.dt / steps[0]) ** method.order
        worst, number = max((truncation * (1e6 if i == sensitive else 1), i) for i in numbers)
        return Estimate(worst, 0.0), number

    monkeypatch.setattr(shared_choice, "find_worst", find_worst)
    choice = shared_choice.choose_for_all(bodies, error, 2.0, SampleTimes(None, 1))
    assert choice.reached
    assert choice.grid.dt < steps[0] * 5e5 ** (-1 / choice.method.order)


def test_the_estimate_is_the_largest_of_all_bodies_that_are_tried(monkeypatch):
    """Bodies that only verify a step can have a larger error than those that chose it, as long as it is allowed."""
    bodies = read_bodies(scene(cv.UniformGravity(3.0, (0.1, 0.2, 0.3))), *starts(100), None, None)
    last = shared_choice.pick(bodies)[-1]
    monkeypatch.setattr(
        shared_choice, "find_worst", lambda bodies, numbers, *_: (Estimate(9e-7 if last in numbers else 4e-7, 0.0), numbers[-1])
    )
    choice = shared_choice.choose_for_all(bodies, 1e-6, 2.0, SampleTimes(None, 1))
    assert (choice.estimate, choice.reached) == (9e-7, True)


def test_an_error_below_round_off_is_a_warning():
    with pytest.warns(cv.AccuracyNotReached):
        found = cv.integrate_many(scene(body=BODY), *starts(3), error=1e-18, t_end=1.0)
    assert not found.choice.reached


def test_a_shared_choice_says_that_and_where_its_error_is_not_reached(monkeypatch):
    bodies = read_bodies(scene(cv.UniformGravity(3.0, (0.1, 0.2, 0.3))), *starts(20), None, None)
    monkeypatch.setattr(shared_choice, "find_worst", lambda *_: (Estimate(1e-3, 0.0, rough=1.5), 0))
    with pytest.warns(cv.AccuracyNotReached, match=r"not smooth: near t = 1\.5 s") as caught:
        choice = shared_choice.choose_for_all(bodies, 1e-6, 2.0, SampleTimes(None, 1))
    assert not choice.reached
    assert (caught[0].message.estimate, caught[0].message.rough) == (1e-3, 1.5)


FIVE, TIMES = 5, 4
GRID = cv.Grid(0.5, TIMES - 1)
T = GRID.t


def samples():
    """Return random attitudes and rates, so that drifts are large; attitudes are not exactly orthonormal."""
    R, w = starts(FIVE * TIMES, seed=1)
    R += 1e-3 * np.random.default_rng(2).normal(size=R.shape)
    return R.reshape(FIVE, TIMES, 3, 3), w.reshape(FIVE, TIMES, 3)


def drifts_of(bodies, R_WB, w_WB_B):
    measured = measure_drifts(bodies, find_reference(bodies), GRID, T, R_WB, w_WB_B)
    return arrange_drifts(bodies, measured, R_WB, w_WB_B)


def require_drifts(bodies):
    """Compare with each body alone; return the names that were compared."""
    R, w = samples()
    values, compared = drifts_of(bodies, R, w), set()
    for i in range(FIVE):
        own = bodies.take(i)
        alone = cv.Scene("alone", own.body, own.R_WB0, own.w_WB_B0, 2.0, own.potential)
        if bodies.scene.extra_invariants:
            alone = alone.rename("alone", extra_invariants=bodies.scene.extra_invariants)
        trajectory = Trajectory(alone, T, R[i], w[i], "")
        kept = kept_sizes(alone, frozenset(each.name for each in alone.invariants))
        for column, name in enumerate(list_drifts(bodies)):
            invariant = next((each for each in alone.invariants if each.name == name), None)
            if invariant is None and column > 0:
                assert np.isnan(values[i, column])
                continue
            off = orthonormality(R[i]) if invariant is None else sizes(trajectory.drift(invariant))
            assert values[i, column] == pytest.approx(off.max(), rel=1e-13)  # 5e-15
            if invariant in kept:
                bounded = measure_drifts(bodies, find_reference(bodies, frozenset({name})), GRID, GRID.t, R, w)[i, 4]
                assert bounded == pytest.approx(off.max() * invariant.scale / kept[invariant], rel=1e-13)
            compared.add(name)
    return compared


@pytest.mark.parametrize("name", fields(1))
@pytest.mark.parametrize("own_inertia", [False, True])
def test_drifts_are_those_of_each_body_alone(name, own_inertia):
    potential, parameters = fields(FIVE)[name]
    if own_inertia and hasattr(getattr(potential, "potential", potential), "inertia") != ("inertia" in parameters):
        pytest.skip("a field with the inertia of the body")
    bodies = read_bodies(scene(potential), *starts(FIVE), tensors(FIVE) if own_inertia else None, parameters)
    assert len(require_drifts(bodies)) >= 2


def test_without_numbers_of_their_own_bodies_have_the_field_of_the_scene():
    for potential, _ in fields(FIVE).values():
        require_drifts(read_bodies(scene(potential), *starts(FIVE), None, None))


def test_bodies_at_rest_have_the_scale_of_their_field():
    R, w = starts(FIVE)
    require_drifts(read_bodies(scene(cv.UniformGravity(3.0, (0.1, 0.2, 0.3))), R, 0 * w, None, None))
    require_drifts(read_bodies(scene(), R, 0 * w, None, None))


def test_axial_momentum_is_that_of_the_bodies_that_have_one():
    symmetric = body_in_axes(TURN, 1.0, 1.0, 2.0)
    inertia = tensors(FIVE)
    inertia[2] = 3 * symmetric.inertia
    for own in (None, inertia):
        assert "axial momentum" in require_drifts(read_bodies(scene(body=symmetric), *starts(FIVE), own, None))


def test_a_body_with_its_own_field_is_symmetric_only_if_its_field_is():
    potential = cv.UniformGravity(3.0, (0, 0, 0.3))
    com_B = np.outer(np.arange(1, 6), (0, 0, 0.1))
    com_B[2, 0] = 0.1
    bodies = read_bodies(scene(potential, body=cv.RigidBody((1.0, 1.0, 2.0))), *starts(FIVE), None, {"com_B": com_B})
    assert np.isfinite(bodies.symmetry_axes_B).all(axis=1).tolist() == [True, True, False, True, True]


def test_invariants_of_the_scene_itself_count_where_all_have_its_body():
    extra = Invariant("first momentum", "kg m^2/s", 2.0, lambda R, w: momentum_W(BODY, R, w)[..., 0])
    with_extra = scene(extra_invariants=(extra,))
    assert "first momentum" in require_drifts(read_bodies(with_extra, *starts(FIVE), None, None))
    assert "first momentum" not in list_drifts(read_bodies(with_extra, *starts(FIVE), tensors(FIVE), None))


def test_a_sample_that_is_not_finite_has_no_drift():
    bodies, (R, w) = read_bodies(scene(), *starts(FIVE), None, None), samples()
    R[1, 2, 0, 0], w[3, 0, 2] = np.nan, np.inf
    found = drifts_of(bodies, R, w)
    assert np.isnan(found[[1, 3]]).all()
    assert np.isfinite(found[[0, 2, 4]]).all()


FEW = 9
INNER = cv.Reduced()
EVERY_OTHER = {"dt": 0.05, "t_end": 0.5, "sample_every": 2}


@dataclass(frozen=True)
class Damaged(Method):
    """The method `INNER` on lanes; `damage` changes their samples before they are checked."""

    damage: Any

    family: ClassVar[str] = "damaged"
    role: ClassVar[Role] = Role.OURS
    order = INNER.order
    conserves = INNER.conserves

    def bounds(self, scene, grid):
        return INNER.bounds(scene, grid)

    def prepare(self, scene, grid):
        return INNER.prepare(scene, grid)

    def prepare_many(self, bodies, grid):
        def run():
            found = [INNER.solve(bodies.take(i), grid) for i in range(len(bodies))]
            samples = np.stack([each.R_WB for each in found]), np.stack([each.w_WB_B for each in found])
            block = Block(*samples, np.ones(len(bodies), dtype=bool))
            self.damage(block)
            return block

        return run


def leave_unfinished(block):
    block.finished[3] = False
    block.R_WB[3] = 7.0


def break_sample(block):
    block.w_WB_B[3, 2, 1] = np.nan


def lose_energy(block):
    block.w_WB_B[3, -1] *= 1 + 1e-9


def shear(block):
    block.R_WB[3, 1, 0, 2] += 1e-9


class Careless(Damaged):
    """The same; it conserves nothing by construction."""

    conserves = frozenset()


def spin_up(block):
    block.w_WB_B[3, 1] *= 10


@pytest.mark.parametrize("damage", [leave_unfinished, break_sample, lose_energy, shear, spin_up])
@pytest.mark.parametrize("own_inertia", [False, True])
def test_lanes_that_are_not_right_are_run_alone(damage, own_inertia, monkeypatch):
    given = {"w_WB_B0": starts(FEW)[1], "inertia": tensors(FEW) if own_inertia else None}
    right, alone = cv.integrate_many(scene(), **given, method=Damaged(repr), **EVERY_OTHER), []  # which changes nothing
    monkeypatch.setattr(blocks, "run_alone", lambda *what: (alone.append(what[3]), run_alone(*what))[1])
    method = Careless(damage) if damage is spin_up else Damaged(damage)
    found = cv.integrate_many(scene(), **given, method=method, **EVERY_OTHER)
    assert alone == [3]
    np.testing.assert_array_equal(found.R_WB, right.R_WB)
    np.testing.assert_array_equal(found.w_WB_B, right.w_WB_B)
    np.testing.assert_array_equal(found.drifts["energy"], right.drifts["energy"])
    assert found.ok.all()


run_alone = blocks.run_alone


def test_a_body_that_fails_has_the_outcome_that_it_has_alone():
    R, w = starts(FEW)
    w[4] *= 1e5  # of which a step of this length keeps less than it should
    found = cv.integrate_many(scene(), R, w, method=cv.Reduced(), **EVERY_OTHER)
    others = np.delete(np.arange(FEW), 4)
    alone = cv.integrate(found.bodies.take(4), 0.05, cv.Reduced(), 0.5, 2, on_failure="return")
    assert not alone.ok
    assert list(found.failures) == [4]
    assert found.outcome(4) == alone.outcome == found[4].outcome
    assert list(found.ok) == [i != 4 for i in range(FEW)]
    np.testing.assert_array_equal(found[4].R_WB, alone.R_WB)
    assert np.isnan(found.R_WB[4, len(alone) :]).all()
    assert np.isnan(found.drifts["energy"][4])
    assert found[3:6].failures.keys() == {1}
    assert "8 ok, 1 not conserved (body 4)" in repr(found)
    assert found.to_pandas("bodies").loc[4, "outcome"] == str(alone.outcome)
    without = cv.integrate_many(scene(), R[others], w[others], method=cv.Reduced(), **EVERY_OTHER)
    np.testing.assert_array_equal(found.R_WB[others], without.R_WB)
    single = cv.integrate_many(scene(), R[4:5], w[4:5], method=cv.Reduced(), **EVERY_OTHER)
    assert single.outcome(0) == alone.outcome
    np.testing.assert_array_equal(single.R_WB[0], found.R_WB[4])


def test_a_body_that_the_method_does_not_take_is_not_run():
    inertia = np.array([[1.0, 1.0, 2.0]] * 3 + [[1.0, 1.4, 2.0]])
    given = {"inertia": inertia, "method": cv.Reduced(frame="non_spinning"), **EVERY_OTHER}
    found = cv.integrate_many(scene(body=cv.RigidBody([1, 1, 2])), **given)
    assert list(found.failures) == [3]
    assert isinstance(found.failures[3], cv.NotRun)
    assert found.outcome(3).kind == cv.OutcomeKind.UNSUPPORTED
    assert len(found[3]) == 0


FAILURES = [
    cv.NotConverged(3, 0.1, 0.2, "singular"),
    cv.WrongBranch(3, 0.1, 0.2),
    cv.Diverged(0.1),
    cv.NotConserved(0.1, "energy", 1e-3, 1e-9),
    cv.InvalidResult("mine", "nothing"),
    cv.NotRun("it is for others"),
]


@pytest.mark.parametrize("failure", FAILURES)
def test_failures_come_back_from_other_processes(failure):
    again = pickle.loads(pickle.dumps(failure))
    assert type(again) is type(failure)
    assert vars(again) == vars(failure)
    assert str(again) == str(failure)


WAITING = threading.Event()
"""Set when a block waits for ever."""


def wait_for_ever(block):
    """Run in pieces without end."""
    WAITING.set()
    while True:
        time.sleep(0.01)
        pause()


@pytest.mark.parametrize("threads", [1, 2])
def test_an_interrupt_ends_all_threads(threads, monkeypatch):
    monkeypatch.setattr(blocks, "MOST_BODIES", 2)
    begun, over = set(threading.enumerate()), threading.Event()
    WAITING.clear()

    def interrupt():
        WAITING.wait()
        if not over.is_set():
            os.kill(os.getpid(), signal.SIGINT)

    sender = threading.Thread(target=interrupt)
    sender.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            cv.integrate_many(scene(), *starts(FEW), method=Damaged(wait_for_ever), threads=threads, **EVERY_OTHER)
    finally:  # a run that ends otherwise leaves no thread that interrupts another test
        over.set()
        WAITING.set()
        sender.join()
    wait_until(lambda: set(threading.enumerate()) <= begun)  # a thread that is just starting is not joined


def test_a_failure_of_one_block_ends_the_others(monkeypatch):
    monkeypatch.setattr(blocks, "MOST_BODIES", 2)
    begun = set(threading.enumerate())

    def fail(block):
        if len(block.finished) < 2:  # the last one
            raise RuntimeError("broken")
        wait_for_ever(block)

    with pytest.raises(RuntimeError, match="broken"):
        cv.integrate_many(scene(), *starts(3), method=Damaged(fail), threads=2, **EVERY_OTHER)
    wait_until(lambda: set(threading.enumerate()) <= begun)


THOUSAND = 1000
GRAVITY = cv.UniformGravity(3.0, (0.1, 0.2, 0.3))


def changed(values, i, value):
    """Return a copy with another value at index i."""
    found = np.array(values, dtype=float)
    found[i] = value
    return found


R, W, J = *starts(THOUSAND), tensors(THOUSAND)


def bad_field(field, name, value):
    """Return arguments for a field with a bad value of the third body."""
    potential, parameters = fields(5)[field]
    return {"scene": scene(potential), "parameters": parameters | {name: changed(parameters[name], 2, value)}}


REFUSED = {
    "n differs": (
        {"R_WB0": R, "w_WB_B0": W[:7]},
        r"^w_WB_B0: got shape \(7, 3\); expected .* \(1000, 3\): 1000 bodies, as R_WB0 has",
    ),
    "n of a number": (
        {"w_WB_B0": W, "parameters": {"weight": [1.0, 2.0]}},
        r"^parameters\['weight'\]: got shape \(2,\); expected numbers of shape \(1000,\): 1000 bodies",
    ),
    "one start": ({"w_WB_B0": W[0]}, r"^w_WB_B0: got shape \(3,\); expected numbers of shape \(n, 3\)"),
    "no body": ({"w_WB_B0": np.empty((0, 3))}, r"^w_WB_B0: got shape \(0, 3\)"),
    "a text": ({"w_WB_B0": "fast"}, r"^w_WB_B0: got 'fast'"),
    "unknown number": ({"parameters": {"wieght": [1.0]}}, r"^parameters: got 'wieght'; expected 'weight' \(nearest\)"),
    "no mapping": ({"parameters": [1.0]}, r"^parameters: got \[1.0\]; expected a mapping"),
    "nan": ({"w_WB_B0": changed(W, 7, np.nan)}, r"^w_WB_B0\[7\]: got \[nan, nan, nan\], not finite"),
    "too fast": ({"w_WB_B0": changed(W, 5, (0, 1e101, 0))}, r"^w_WB_B0\[5\]: got .*1e\+101.* the largest 0 or of magnitude"),
    "too slow": ({"w_WB_B0": changed(W, 5, (0, 1e-101, 0))}, r"^w_WB_B0\[5\]: got .*1e-101.* the largest 0 or of magnitude"),
    "no rotation": ({"R_WB0": changed(R, 500, np.diag([1, 1, 1.1]))}, r"^R_WB0\[500\]: got a matrix with \|R'R - 1\| = 0.21"),
    "a reflection": ({"R_WB0": changed(R, 0, -np.eye(3))}, r"^R_WB0\[0\]: got a reflection"),
    "not positive": (
        {"inertia": changed(J, 4, np.diag([1.0, -1, 1]))},
        r"^inertia\[4\]: got principal moments .* not all positive",
    ),
    "not symmetric": (
        {"inertia": changed(J, 4, J[4] + [[0, 1e-3, 0]] * 3)},
        r"^inertia\[4\]: got a matrix that is not symmetric",
    ),
    "far apart": (
        {"inertia": changed(J, 4, BODY.R_BP @ np.diag([1e-14, 1, 1]) @ BODY.R_BP.T)},
        r"^inertia\[4\]: got principal moments .*(ratio up to 1e\+13|not all positive)",
    ),
    "nan weight": ({"parameters": {"weight": changed(np.ones(THOUSAND), 8, np.nan)}}, r"^parameters\['weight'\]\[8\]: got nan"),
    "huge lever": ({"parameters": {"com_B": changed(W, 8, 1e101)}}, r"^parameters\['com_B'\]\[8\]: got \[1e\+101"),
    "stiffness": (bad_field("spring", "stiffness", 0.0), r"^parameters\['stiffness'\]\[2\]: got 0.0"),
    "rest length": (bad_field("rest length", "rest_length", -1.0), r"^parameters\['rest_length'\]\[2\]: got -1.0"),
    "rate": (bad_field("gradient", "rate", -1.0), r"^parameters\['rate'\]\[2\]: got -1.0"),
    "inertia of a field": (
        bad_field("gradient", "inertia", -np.eye(3)),
        r"^parameters\['inertia'\]\[2\]: got principal moments",
    ),
    "direction": (bad_field("gradient", "direction_W", 0.0), r"^parameters\['direction_W'\]\[2\]: got \[0.0, 0.0, 0.0\]"),
    "inertia in an orbit": (
        bad_field("orbit", "inertia", -np.eye(3)),
        r"^parameters\['inertia'\]\[2\]: got principal moments",
    ),
    "threads": ({"threads": 0}, r"^threads: got 0"),
    "progress": ({"progress": 3}, r"^progress: got 3"),
    "error": ({"error": 0.0}, r"^error: got 0"),
    "no numbers": (
        {"scene": scene(), "parameters": {"weight": [1.0]}},
        r"^parameters: got 'weight'; expected none: .* no potential",
    ),
    "memory": ({"dt": 1e-6, "w_WB_B0": W}, r"^sample_every: got 2000001000 samples of 1000 bodies"),
    "two inertias": (
        {"scene": scene(cv.GravityGradient(0.7, BODY.inertia)), "inertia": BODY.inertia[None]},
        r"^parameters: got None; expected .* has an inertia",
    ),
    "cannot do": ({"method": cv.Projected(), "scene": scene(), "w_WB_B0": W}, r"^method: got projected"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_bad_arguments_and_bad_bodies_are_named(what):
    given, message = REFUSED[what]
    with pytest.raises(cv.BadInput, match=message):
        cv.integrate_many(**{"scene": scene(GRAVITY), "threads": 1} | given)


def test_directions_of_a_field_are_normalised():
    potential, parameters = fields(5)["gradient"]
    found = read_bodies(scene(potential), None, None, None, parameters)
    np.testing.assert_allclose(np.linalg.norm(found.parameters["direction_W"], axis=1), 1, rtol=1e-15)


def test_a_step_that_is_too_long_for_the_fastest_is_refused_before_any_work():
    with pytest.raises(cv.BadInput, match=r"^dt: got 0.05.*\(body 321\)"):
        cv.integrate_many(scene(), w_WB_B0=changed(W, 321, (300.0, 20, 10)), method="moser_veselov", dt=0.05, t_end=1.0)


@pytest.mark.parametrize("how", [{"dt": 0.01, "method": "moser_veselov"}, {"error": 1e-3}])
def test_an_ensemble_that_fills_the_memory_says_so_before_it_runs(how, monkeypatch):
    """Here it is more than 2 kB: 1 GB takes a second."""
    monkeypatch.setattr(memory, "LARGE", 2000)
    rates, done = np.eye(3), []
    with pytest.warns(cv.LargeEnsemble, match=r"by sample_every, or write them to a folder by path") as said:
        found = cv.integrate_many(cv.scenes.brick_flip(), w_WB_B0=rates, t_end=0.5, **how, progress=done.append)
    assert said[0].message.size == found.R_WB.nbytes + found.w_WB_B.nbytes > 2000
    assert said[0].filename == __file__
    cv.integrate_many(cv.scenes.brick_flip(), w_WB_B0=rates, t_end=0.5, **how, sample_every=10**6)
