"""Each planted fault is named with its size, and a right file or a noisy one is not accused."""

import warnings

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.benchmarks.verification import explain as diagnose
from conservative.benchmarks.verification.mistakes import BY_KEY
from conservative.benchmarks.verification.mistakes.scenes import with_inertia
from conservative.benchmarks.verification.recordings.comparison import prepare
from conservative.benchmarks.verification.recordings.table import Recording
from conservative.benchmarks.verification.recordings.verdict import verify_recording
from conservative.benchmarks.verification.trials import compose

from ...sampling import sampled
from .made import FREE, HEAVY, START, T, exact, late, noisy, reordered, stepped, turned, without

AB2, HEUN, RK4 = "Adams-Bashforth 2 (first step Euler)", "Heun's method", "RK4"
IMPLICIT = "semi-implicit Euler with an implicit gyroscopic term"


def diagnosed(scene, R, w, t=T):
    """The only mistake that explains a file; None without one, or if several do."""
    explaining = verify_recording(scene, Recording(t, (R, w), rows=len(t))).details.explaining
    return explaining[0] if len(explaining) == 1 else None


FAULTS = {
    "time shift": (lambda scene: late(scene, 0.02), {"shift": 0.02}),
    "phase drift": (lambda scene: late(scene, 0.02 + 1e-4 * T), {"shift": 0.02, "rate": 1e-4}),
    "no gyroscopic term": (without, {}),
    "damping": (lambda scene: without(scene, 0.05, True), {"damping": 0.05}),
    "no gyroscopic term + damping": (lambda scene: without(scene, 0.05), {"damping": 0.05}),
    "order xyzw": (reordered, {}),
    "transposed": (lambda scene: (np.swapaxes(exact(scene)[0], 1, 2), exact(scene)[1]), {}),
    "world rates": (lambda scene: (exact(scene)[0], (exact(scene)[0] @ exact(scene)[1][..., None])[..., 0]), {}),
    "body axes": (lambda scene: turned(scene, 0.3, 0.5, -0.4), {"turn_1": 0.3, "turn_2": 0.5, "turn_3": -0.4}),
    AB2: (lambda scene: stepped(scene, AB2, 5), {"step": 0.01}),
    HEUN: (lambda scene: stepped(scene, HEUN, 4), {"step": 0.0125}),
    RK4: (lambda scene: stepped(scene, RK4, 2), {"step": 0.025}),
}


@pytest.mark.parametrize("name", sampled(FAULTS, 4, keep=["phase drift", "no gyroscopic term + damping", "world rates", HEUN]))
def test_a_planted_fault_is_named(name):
    plant, values = FAULTS[name]
    found = diagnosed(FREE, *plant(FREE))
    assert found.name == name
    assert found.values == pytest.approx(values, rel=1e-6, abs=1e-9)  # measured: 2e-10 of the shift
    assert max(found.left) < 1e-10 < 3e-8 < max(found.plain)  # measured: at most 3e-12


def test_two_mistakes_with_the_same_rows_are_both_named():
    """Without a torque, implicit Euler and this step of game engines differ in the norm of the quaternion only."""
    found = verify_recording(FREE, Recording(T, stepped(FREE, IMPLICIT, 3), rows=len(T)))
    assert found.findings[0].mistake == ""
    assert {each.name for each in found.details.explaining} == {IMPLICIT, "implicit Euler"}


def test_a_clock_and_a_factor_of_the_rates_are_both_named_for_a_free_body():
    """Its motion at scaled times is the motion with scaled rates. Gravity separates them."""
    named = {
        scene: {each.name for each in verify_recording(scene, Recording(T, rows, rows=len(T))).details.explaining}
        for scene, rows in ((scene, exact(scene, T * (1 + 1e-4))) for scene in (FREE, HEAVY))
    }
    assert named == {FREE: {"time scale", "size of the rates"}, HEAVY: {"time scale"}}


@pytest.mark.parametrize("name", sampled(["time shift", "damping", "transposed", "body axes"], 1))
def test_a_planted_fault_in_gravity_is_named(name):
    plant, values = FAULTS[name]
    found = diagnosed(HEAVY, *plant(HEAVY))
    assert (found.name, found.values) == (name, pytest.approx(values, rel=1e-6, abs=1e-9))


@pytest.mark.slow
def test_turned_body_axes_are_found_from_rates_alone_and_at_any_angle():
    _, w = turned(FREE, 1.3, -1.5, 0.9)
    found = diagnosed(FREE, None, w)
    assert found.name == "body axes"
    assert found.left[1] < 1e-10


@pytest.mark.slow
def test_another_body_and_another_first_row_are_named():
    other = cv.Scene("other", cv.RigidBody([[3.0, 0.4, -0.2], [0.4, 2.5, 0.3], [-0.2, 0.3, 4.2]]), *START, 6.0)
    found = diagnosed(FREE, *exact(other))
    of_same_size = other.body.inertia * FREE.body.moments.sum() / other.body.moments.sum()
    assert found.name == "another body"
    assert list(found.values.values()) == pytest.approx(of_same_size[np.triu_indices(3)], rel=1e-9)  # measured: 3e-15
    faster = FREE.rename("faster", w_WB_B0=[0.701, -1.1, 1.6])
    R, w = exact(faster)
    w[0] = FREE.w_WB_B0
    found = diagnosed(FREE, R, w)
    assert found.name == "first row"
    assert found.values["start_rate_1"] == pytest.approx(1e-3 / np.linalg.norm(w, axis=1).max(), rel=1e-6)


@pytest.mark.parametrize(
    ("name", "size"), sampled([(name, size) for size in (0.0, 1e-6) for name in ("free", "heavy")], leave=[("free", 1e-6)])
)
def test_a_right_file_is_not_accused(name, size):
    scene = {"free": FREE, "heavy": HEAVY}[name]
    assert diagnosed(scene, *noisy(scene, size)) is None


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_noise_of_other_bodies_is_not_accused(seed):
    scene = cv.scenes.random_body(seed=seed)
    scene = scene.rename("random", t_end=6.0, potential=None)
    assert diagnosed(scene, *noisy(scene, 1e-6, seed)) is None


@pytest.mark.slow
@pytest.mark.parametrize("name", ["spherical_body", "needle"])
def test_random_rows_have_no_diagnosis(name):
    scene = registry.scene(name)
    random = np.random.default_rng(1)
    assert diagnosed(scene, None, np.linalg.norm(scene.w_WB_B0) * random.normal(size=(len(T), 3)), scene.t_end / 6 * T) is None


def test_bodies_that_the_search_tries_give_no_warning():
    """A fit passes bodies that cannot exist. It names none of them."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", cv.ImpossibleInertia)
        other = with_inertia(HEAVY, np.diag([1.0, 1.0, 5.0]))
    assert other.body.moments.tolist() == [1.0, 1.0, 5.0]
    assert np.array_equal(other.body.inertia, other.rename("again").body.inertia)


def test_a_mistake_that_cannot_explain_the_first_rows_is_not_fitted():
    case = prepare(HEAVY, Recording(T, late(HEAVY, 0.02), rows=len(T)), True, None).case
    decided = {}
    for key in ("time shift", "damping", "size of the field"):
        trial = compose(BY_KEY[key])
        numbers = np.array([number.start for number in trial.numbers])
        decided[key] = case.may_explain(trial.build(case), numbers, np.full(len(numbers), 1e-6))
    assert decided == {"time shift": True, "damping": False, "size of the field": False}


def test_the_search_ends_after_a_number_of_trial_motions(monkeypatch):
    """It is counted: a limit of the clock gave other answers on a busy machine."""
    monkeypatch.setattr(diagnose, "EFFORT", 30)
    R, w = exact(FREE)
    found = verify_recording(FREE, Recording(T, (R, w + np.sin(5 * T)[:, None] * [0.1, 0.2, 0.0]), rows=len(T)))
    assert any("before everything was tried" in note for note in found.notes)


@pytest.fixture
def only_integrators(monkeypatch):
    """Only integrators are searched for, with the work of all. The other parts of the search run in tests of `FAULTS`."""
    monkeypatch.setattr(diagnose, "SEARCHES", {"integrators": diagnose.SEARCHES["integrators"]})
    monkeypatch.setattr(diagnose, "EFFORT", 4 * diagnose.EFFORT)


def test_a_method_is_named_up_to_where_it_diverges(only_integrators):
    """The first rows tell the method, and their errors are small beside the last rates."""
    name = "semi-implicit Euler with an explicit gyroscopic term"
    scene = FREE.rename("fast", w_WB_B0=[14.0, -22.0, 32.0])
    R, w = stepped(scene, name, 1, np.arange(40) * 0.02)
    assert np.linalg.norm(w, axis=1).max() > 3 * np.linalg.norm(w[0])
    assert diagnosed(scene, R, w, np.arange(40) * 0.02).name.startswith(name)


@pytest.mark.parametrize(
    ("engine", "expected"),
    sampled(
        [
            ("mujoco:Euler", "semi-implicit Euler with an explicit gyroscopic term and the exponential map"),
            ("mujoco:RK4", "RK4 on rotation vectors (Munthe-Kaas)"),
        ],
        1,
    ),
)
def test_the_integrators_of_mujoco_are_named(engine, expected, only_integrators):
    trajectory = registry.method(engine).solve(HEAVY, cv.Grid(0.05, 120))
    assert diagnosed(HEAVY, trajectory.R_WB, trajectory.w_WB_B, trajectory.t).name == expected
