"""Engines in this process: conventions, orders, counters, limits of steps, and common functions.

All engines must find the same motion on scenes that expose a wrong convention. Tests that depend on the version of an engine
name the measured version.
"""

from importlib.metadata import version
from itertools import product
from types import SimpleNamespace

import mujoco
import mujoco.rollout
import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.attitude import angle_between, from_quaternion, rotation_about
from conservative.benchmarks.measures.timing import wall_time
from conservative.grid import Grid
from conservative.references import engine
from conservative.references.engine import principal_axes
from conservative.references.engines.shared import compile_models, sample
from conservative.references.environments.catalogue import MuJoCo, Pinocchio
from conservative.references.environments.plain_numbers import describe
from conservative.references.exact.method import Exact
from conservative.references.exact.start import _BLOCK
from conservative.references.precise import Precise
from conservative.references.samples import QUATERNION, States
from conservative.references.solvers import heyoka
from conservative.references.solvers.heyoka import Heyoka
from conservative.references.solvers.scipy import SciPy
from conservative.scenes.tops import cone
from conservative.trajectory import Counters

from ..bodies import impossible_body
from ..sampling import sampled

# Attitude and rates; measured beside: the largest over the four scenes.
TIGHT = [
    (SciPy(rtol=3e-14), 1e-12),  # measured 4e-13, its interpolant's
    (Heyoka(1e-16), 3e-14),  # measured 3e-15
    (Heyoka(1e-16, "non_spinning"), 3e-14),  # measured 2e-15
    (Heyoka(1e-16, "lean"), 3e-14),  # measured 3e-15
    (Heyoka(1e-16, "base_vectors"), 3e-14),  # measured 3e-15
    (MuJoCo("RK4"), 2e-8),  # measured 4e-9 at dt = 0.025
    (Pinocchio("RK4"), 2e-8),  # measured 7e-9
]


@pytest.mark.parametrize(("method", "bound"), TIGHT, ids=lambda value: getattr(value, "name", ""))
def test_an_engine_agrees_with_truth(method, bound, generic):
    if method.unsupported(generic):  # that it says so is tested elsewhere
        assert getattr(method, "frame", "") == "non_spinning"
        return
    truth = Precise(113).prepare(generic, Grid(0.025, 80))()
    trajectory = method.prepare(generic, Grid(0.025, 80))()
    assert trajectory.ok
    assert len(trajectory) == 81
    assert angle_between(truth.R_WB, trajectory.R_WB).max() < bound
    assert np.abs(truth.w_WB_B - trajectory.w_WB_B).max() < bound


@pytest.mark.parametrize(
    "method", [m for cls in (MuJoCo, Pinocchio, Heyoka, SciPy, Precise) for m in cls.settings_for("variants")]
)
def test_a_run_can_be_repeated_and_samples_do_not_change_it(method, top, heavy):
    run = method.prepare(top, Grid(0.05, 40))
    first = run()
    other = method.prepare(top.rename("other", w_WB_B0=(0.1, 0.2, 0.3)), Grid(0.05, 3))()
    second = run()
    np.testing.assert_array_equal(first.R_WB, second.R_WB)
    np.testing.assert_array_equal(first.w_WB_B, second.w_WB_B)
    assert len(other) == 4
    sparse = method.prepare(top, Grid(0.05, 40, 20))()
    assert sparse.t.tolist() == [0, 1, 2]
    # Adaptive ones cut steps at samples or do not: equal to their tolerance.
    bound = 0.0 if method.order else 1e-7 if "1e-06" in method.name else 1e-11  # measured 0, 8e-9, 9e-13
    assert angle_between(first.R_WB[::20], sparse.R_WB).max() <= bound
    np.testing.assert_allclose(first.R_WB[0], top.R_WB0, atol=1e-15)
    np.testing.assert_allclose(first.w_WB_B[0], top.w_WB_B0, atol=1e-15)


@pytest.mark.parametrize("method", [MuJoCo("RK4"), Pinocchio(), Heyoka(), Heyoka(frame="lean"), SciPy()], ids=lambda m: m.name)
def test_a_motion_does_not_depend_on_the_body_axes(method, free):
    """A body frame turned by B has inertia B'JB, attitude R B and rates B'w."""
    B = rotation_about((-1, 0.4, 2), 2.2)
    turned = cv.Scene("turned", cv.RigidBody(B.T @ free.body.inertia @ B), free.R_WB0 @ B, B.T @ free.w_WB_B0, free.t_end)
    a, b = (method.prepare(scene, Grid(0.05, 40))() for scene in (free, turned))
    assert angle_between(a.R_WB @ B, b.R_WB).max() < 3e-14  # measured 3e-15
    assert np.abs(a.w_WB_B @ B - b.w_WB_B).max() < 3e-14  # measured 2e-15


STEEP = [MuJoCo("Euler"), MuJoCo("RK4"), Pinocchio("Euler"), Pinocchio("RK4"), SciPy()]
STEEP += [Heyoka(frame=frame) for frame in ("body", "lean", "base_vectors")]


@pytest.mark.parametrize("every", [1, 100])
@pytest.mark.parametrize("method", STEEP, ids=lambda m: m.name)
def test_a_run_that_ends_early_is_reported_and_writes_no_file(method, every, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with np.errstate(over="ignore", invalid="ignore"):
        scene = cv.Scene("hopeless", cv.RigidBody((1, 2, 2.5)), np.eye(3), (1e30, 1e30, 1e30), 2.0, dt=0.1)
        trajectory = method.run(scene, 0.01, sample_every=every)
    assert str(trajectory.outcome).startswith("diverged after t = 0")
    assert len(trajectory) <= 3  # Euler's method overflows in the third step
    assert isinstance(trajectory.failure, cv.Diverged)
    assert not list(tmp_path.iterdir())


def test_explicit_steps_that_are_too_long_diverge():
    trajectory = MuJoCo("Euler").run(cv.scenes.brick_flip(), 1.0, t_end=2000, sample_every=1)
    assert "MuJoCo warned of" in str(trajectory.outcome)
    assert 0 < trajectory.t[-1] < 2000
    assert np.isfinite(trajectory.energy).all()


STEPS = (40, 80, 160, 320)

mujoco_4 = pytest.mark.skipif(version("mujoco") != "4.0.0", reason="measured with MuJoCo 4.0.0; it changes between versions")
METHODS = [
    *(pytest.param(method, marks=mujoco_4, id=method.name) for method in MuJoCo.settings_for("variants")),
    *(pytest.param(method, id=method.name) for method in Pinocchio.settings_for("variants")),
]


def errors(scene, method):
    """Return errors at the end for each number of steps: attitude, rates, energy, world momentum."""
    truth = Precise(113).prepare(scene, Grid(scene.t_end / 4, 4))()
    rows = []
    for n in STEPS:
        trajectory = method.prepare(scene, Grid(scene.t_end / n, n, n))()
        rows.append(
            [
                angle_between(truth.R_WB[-1], trajectory.R_WB[-1]),
                np.abs(truth.w_WB_B[-1] - trajectory.w_WB_B[-1]).max(),
                abs(trajectory.energy[-1] - truth.energy[0]),
                np.linalg.norm(trajectory.momentum_W[-1] - truth.momentum_W[-1]),
            ]
        )
    return np.array(rows)


def slopes(values):
    """Return orders from a log-log fit over all steps."""
    return -np.polyfit(np.log(STEPS), np.log(values), 1)[0]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["free", "heavy"])
def test_the_order_of_convergence(method, name, request):
    attitude, rates, energy, momentum = slopes(errors(request.getfixturevalue(name), method))
    # Measured over both scenes: 0.98 to 1.01 and 3.96 to 4.01.
    assert attitude == pytest.approx(method.order, abs=0.1)
    assert rates == pytest.approx(method.order, abs=0.1)
    assert momentum > method.order - 0.1
    assert energy > method.order - 0.1


@pytest.mark.parametrize(
    "method", [*MuJoCo.settings_for("variants"), *Pinocchio.settings_for("variants")], ids=lambda method: method.name
)
def test_each_stage_is_an_evaluation(method, free):
    counters = method.run(free, 0.1, t_end=0.7).counters
    assert (counters.steps, counters.evaluations) == (7, 7 * (4 if method.order == 4 else 1))


def test_an_adaptive_method_counts_all_its_evaluations(free):
    counters = SciPy("DOP853").run(free, 0.5).counters
    assert counters.evaluations >= 12 * counters.steps > 12  # twelve stages a step


def test_steps_from_sample_to_sample_are_all_counted(free):
    few, many = (Heyoka(1e-9).prepare(free, Grid(free.t_end / n, n))() for n in (4, 40))
    assert few.counters.steps >= many.counters.steps > 4  # steps that are cut at samples are not fewer


@pytest.mark.parametrize("bad", [1, 3])
def test_samples_before_the_first_that_is_not_finite_are_valid(bad, free):
    grid = Grid(0.1, 5)
    states = np.ones((1, 6, 7))
    states[0, bad, 5] = np.nan
    trajectory = principal_axes(free).trajectory(grid, "planted", States(QUATERNION, states), Counters(5))
    assert len(trajectory) == bad
    assert isinstance(trajectory.failure, cv.Diverged)
    assert trajectory.outcome.time == trajectory.t[-1] == grid.t[bad - 1]


def test_a_closed_form_has_every_sample_of_many(top):
    n = 2 * _BLOCK + 3
    many = Exact().prepare(top, Grid(2.0 / n, n))()
    for k in (_BLOCK - 1, _BLOCK, 2 * _BLOCK - 1, n):
        alone = Exact().prepare(top, Grid(float(many.t[k]), 1))()
        assert angle_between(alone.R_WB[-1], many.R_WB[k]) < 1e-13, k  # measured 1e-16
        np.testing.assert_allclose(alone.w_WB_B[-1], many.w_WB_B[k], atol=1e-13)


@pytest.mark.parametrize(("every", "stepped", "stored"), [(20, [20, 20, 20], []), (2, [], [60])])
def test_mujoco_makes_many_steps_in_one_call(free, monkeypatch, every, stepped, stored):
    """One call per sample, or a single one if samples are close. A loop in Python has the same states but takes far longer."""
    step, rollout, steps, rollouts = mujoco.mj_step, mujoco.rollout.rollout, [], []
    monkeypatch.setattr(mujoco, "mj_step", lambda model, data, count: steps.append(count) or step(model, data, count))
    monkeypatch.setattr(
        mujoco.rollout, "rollout", lambda *args, **options: rollouts.append(options["nstep"]) or rollout(*args, **options)
    )
    assert MuJoCo().prepare(free, Grid(0.01, 60, every))().ok
    assert (steps, rollouts) == (stepped, stored)


def test_samples_of_an_engine_are_copies_of_its_state():
    state, given = np.zeros(1), SimpleNamespace(steps=np.array([0, 2, 5]))
    samples = sample(given, lambda: np.add(state, 1, out=state), lambda: {"w": state})
    assert samples["w"].tolist() == [[0], [2], [5]]


def test_mjcf_models_have_the_mass_distribution_of_the_scene(heavy):
    given = SimpleNamespace(integrator="RK4", **describe(principal_axes(heavy), Grid(0.01, 1)))
    (model,), gravity, arrays = compile_models([given])
    np.testing.assert_allclose(gravity, [[0, 0, -given.gravity]], rtol=1e-15)
    np.testing.assert_allclose(arrays["body_mass"], [[0, given.mass]], rtol=1e-15)
    np.testing.assert_allclose(arrays["body_ipos"][0, 1], given.com, rtol=1e-15)
    R = from_quaternion(model.body_iquat[1])
    np.testing.assert_allclose(R @ np.diag(model.body_inertia[1]) @ R.T, given.inertia_com, atol=1e-14)  # measured 1.8e-15
    assert (model.opt.timestep, model.nq, model.nv) == (0.01, 4, 3)


BRICK = cv.scenes.brick_flip(t_end=1.0)


FASTEST = {
    "scipy": 1e30,
    "scipy:LSODA": 1e30,
    "scipy:Radau": 1e30,
    "scipy:loop=compiled": 1e30,
    "scipy:LSODA,loop=compiled": 1e30,
    "precise:64": 1e30,
    "heyoka:1e-9": 1e20,
}
"""A rate, rad/s, at which each engine needs too many steps."""


@pytest.mark.parametrize(("name", "n_steps"), sampled(product(FASTEST, [2, 20]), len(FASTEST)))
def test_a_run_that_needs_too_many_steps_ends_at_once(name, n_steps):
    rate = FASTEST[name]
    scene = BRICK.rename("fast", w_WB_B0=(0.0, rate, rate / 10))
    run = cv.integrate(scene, 1 / n_steps, registry.method(name), on_failure="return")
    assert run.outcome.kind is cv.OutcomeKind.DIVERGED
    assert "step limit of 10000000 out of reach" in run.outcome.reason
    np.testing.assert_array_equal(run.w_WB_B, [scene.w_WB_B0])


@pytest.mark.parametrize(("method", "n_steps"), [(Heyoka(1e-12), 2), (Heyoka(1e-12), 20), (SciPy(), 10)])
def test_an_adaptive_engine_stops_at_the_limit_of_steps(monkeypatch, method, n_steps):
    for module in (engine, heyoka):
        monkeypatch.setattr(module, "STEP_LIMIT", 5)
    run = cv.integrate(BRICK, 1 / n_steps, method, on_failure="return")
    assert run.outcome.reason == "step limit of 5 reached"
    assert 1 <= len(run) <= n_steps
    assert run.counters.steps == 5


@pytest.mark.parametrize("name", ["scipy", *(f"scipy:{name},loop=compiled" for name in ("DOP853", "RK45", "LSODA", "Adams"))])
def test_an_exception_of_a_potential_is_reported(name):
    hook, calls = np.array([0.0, 0.1, 0.4]), []

    def gradient(R):
        calls.append(R)
        if len(calls) > 50:
            raise ZeroDivisionError("gone")
        return np.outer([0, 0, 1], 4 * (R[2] @ hook) ** 3 * hook)

    field = cv.FunctionPotential(lambda R: (R[2] @ hook) ** 4, gradient)
    scene = cv.Scene("s", BRICK.body, np.eye(3), (0.1, 0.2, 3.0), 1.0, field)
    with pytest.raises(cv.PotentialFailed) as caught:
        cv.integrate(scene, 0.1, registry.method(name))
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


def test_the_pace_is_checked_once(monkeypatch):
    asked = []
    monkeypatch.setattr(heyoka, "pace_reason", lambda *given: asked.append(given) or "")
    run = Heyoka(1e-6).prepare(registry.scene("brick_flip"), cv.Grid(0.1, 10))
    for _ in range(3):
        assert run().outcome.ok
    assert len(asked) == 1


@pytest.fixture(autouse=True)
def nothing_kept():
    yield
    engine.version.cache_clear()


def test_the_error_of_a_missing_engine_has_the_command_that_installs_it():
    with pytest.raises(cv.MissingEngine, match="pip install no-such-engine"):
        engine.version("no-such-engine", "NoSuch")
    with pytest.raises(cv.MissingEngine, match="pip install no-such-engine"):
        engine.load("no_such_engine", "no-such-engine", "NoSuch")


@pytest.mark.parametrize("name", ["mujoco:RK4", "pinocchio:RK4", "heyoka:1e-9", "precise:128"])
def test_methods_of_a_missing_engine_are_refused(name, monkeypatch):
    def missing(package):
        raise engine.metadata.PackageNotFoundError(package)

    engine.version.cache_clear()
    monkeypatch.setattr(engine.metadata, "version", missing)
    with pytest.raises(cv.MissingEngine, match=r"pip install (mujoco|pin|heyoka)$"):
        registry.method(name)


def test_a_mass_model_has_the_inertia_and_the_weight(heavy, top):
    for scene in (heavy, top, cv.scenes.lagrange_top(), cv.scenes.lie_group_top()):
        axes = engine.principal_axes(scene)
        mass = engine.mass_model(axes)
        c = mass.com
        about_pivot = mass.body.inertia + mass.mass * (c @ c * np.eye(3) - np.outer(c, c))
        np.testing.assert_allclose(about_pivot, np.diag(axes.J), atol=1e-15 * axes.J.max())  # measured 0
        np.testing.assert_allclose(mass.mass * mass.gravity * c, axes.moment, atol=1e-13)  # measured 2e-16
        a, b, largest = np.sort(mass.body.moments)
        assert a + b >= largest


def test_the_mass_model_of_the_paper_s_top_is_its_cone():
    """The mass matters to engines whose joints are constraints between free bodies."""
    mass, lever, J1, _ = cone(0.1, 2700.0)
    for scene in (cv.scenes.lagrange_top(), cv.scenes.lagrange_top(slow=4)):
        model = engine.mass_model(engine.principal_axes(scene))
        assert np.isclose(model.mass, mass, rtol=1e-12)
        ball = (J1 - mass * lever**2) * np.eye(3)
        np.testing.assert_allclose(model.body.inertia, ball, rtol=1e-12, atol=1e-12 * J1)


def test_bodies_without_a_mass_distribution_have_no_mass_model():
    gravity = cv.UniformGravity(2, (0, 0, 1))
    for inertia, potential in (((1, 1, 3), None), ((1, 2, 3), gravity)):  # the second: planar, weight out of its plane
        scene = cv.Scene("odd", impossible_body(inertia), np.eye(3), (1, 2, 3), 1.0, potential)
        assert "no mass distribution" in engine.unsupported_reason(scene)
        with pytest.raises(cv.Unsupported, match="no mass distribution"):
            cv.integrate(scene, 0.1, registry.method("mujoco:RK4"))


def test_a_planar_body_with_its_weight_in_its_plane_has_a_mass_model():
    B = rotation_about((1, 2, -1), 2.0)
    scene = cv.Scene(
        "plate", cv.RigidBody(B @ np.diag((1, 2, 3)) @ B.T), B, (1, 2, 3), 1.0, cv.UniformGravity(2, B @ (0.3, 0.4, 0))
    )
    assert engine.unsupported_reason(scene) is None


LOOPS = product(
    ["asymmetric_top", "attracted_body", "thrown_box"],
    ["mujoco:RK4", "mujoco:Euler", "pinocchio:RK4", "pinocchio:Euler"],
    [1, 9, 40],  # by rollout, and by `mj_step`
)


@pytest.mark.parametrize(("scene", "name", "n"), sampled(LOOPS, 12))
def test_the_timed_loop_ends_in_the_state_of_the_run(scene, name, n):
    """It starts from the initial state at each call, and installs the callback of a field by itself."""
    scene = registry.scene(scene)
    run = registry.method(name).prepare(scene, Grid(0.005, n, n))
    before = run()
    for _ in range(2):
        _, rates = run.own_loop()
        np.testing.assert_allclose(rates[-3:] @ scene.body.R_BP.T, before.w_WB_B[-1], rtol=1e-15, atol=1e-15)
    assert wall_time(run.own_loop, 3) > 0
    assert np.array_equal(run().R_WB, before.R_WB)
