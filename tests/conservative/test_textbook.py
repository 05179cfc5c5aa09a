"""Textbook baselines against the formulas of their papers in plain NumPy, and their orders against a method of order 8."""

from itertools import product

import numpy as np
import pytest
from scipy.linalg import expm, solve
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative import registry
from conservative.attitude import angle_between, hat
from conservative.methods.textbook import SCHEMES

from ..sampling import sampled
from .one_body import BODY, START, free, in_field, torque

LEVER = np.array((0.2, -0.1, 0.3))
HEAVY = cv.Scene("heavy", BODY, START, (0.3, -2.0, 1.0), 1.0, cv.UniformGravity(2.5 * 1.6, LEVER))
SCENES = {"free": free((1, 1.4, 2), (0.3, -2.0, 1.0)), "gravity": HEAVY, "spring": in_field("spring")}
scenes = pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
schemes = pytest.mark.parametrize("scheme", SCHEMES)


def acceleration(scene, R, w):
    """Return w' in body axes, with the torque from the gradient of the energy."""
    J = scene.body.inertia
    return solve(J, np.cross(J @ w, w) + torque(scene, R))


def rkmk(scene, h, R, w):
    """Return attitude and rates after a step, with u' = (B0 + B1 ad + B2 ad^2/2) w, ad = -hat(u) for turns in body axes."""
    slopes = []
    for a in ([], [0.5], [0, 0.5], [0, 0, 1], [1 / 6, 1 / 3, 1 / 3, 1 / 6]):
        u, L = (sum((h * c * k[i] for c, k in zip(a, slopes, strict=True)), np.zeros(3)) for i in (0, 1))
        Q, rate = R @ expm(hat(u)), w + solve(scene.body.inertia, L)
        ad = -hat(u)
        turning = (np.eye(3) - ad / 2 + ad @ ad / 12) @ rate
        slopes.append((turning, scene.body.inertia @ acceleration(scene, Q, rate)))
    return Q, rate


def crouch_grossman(scene, h, R, w):
    rows = [
        [],
        [0.8177227988124852],
        [0.3199876375476427, 0.0659864263556022],
        [0.9214417194464946, 0.4997857776773573, -1.0969984448371582],
        [0.3552358559023322, 0.2390958372307326, 1.3918565724203246, -1.1092979392113465],
        [0.1370831520630755, -0.0183698531564020, 0.7397813985370780, -0.1907142565505889, 0.3322195591068374],
    ]
    rates, accelerations = [], []
    for row in rows:
        Q, rate = R, w
        for c, turning, change in zip(row, rates, accelerations, strict=True):
            Q, rate = Q @ expm(h * c * hat(turning)), rate + h * c * change
        rates.append(rate)
        accelerations.append(acceleration(scene, Q, rate))
    return Q, rate


def generalized_alpha(scene, h, R, w, rho=0.9):
    """Return the first step, where a is w'. The four equations are solved together, with a solver of SciPy."""
    alpha_m, alpha_f = (2 * rho - 1) / (1 + rho), rho / (1 + rho)
    gamma = 0.5 + alpha_f - alpha_m
    beta = (gamma + 0.5) ** 2 / 4
    start = acceleration(scene, R, w)

    def state(x):
        w_1, a_1 = x[3:6], x[6:]
        return R @ expm(hat(h * w + h * h * ((0.5 - beta) * start + beta * a_1))), w_1

    def residual(x):
        return np.concatenate(
            [
                x[:3] - acceleration(scene, *state(x)),
                x[3:6] - w - h * ((1 - gamma) * start + gamma * x[6:]),
                (1 - alpha_m) * x[6:] + alpha_m * start - (1 - alpha_f) * x[:3] - alpha_f * start,
            ]
        )

    return state(fsolve(residual, np.concatenate([start, w, start]), xtol=1e-12))


def buss(scene, h, R, w):
    """Return attitude and rates, computed in world axes: the rotation is applied from the left, and w x w' changes its sign."""
    J, s = R @ scene.body.inertia @ R.T, 2 * h / 3
    o, change = R @ w, R @ acceleration(scene, R, w)
    ahead = expm(hat(s * o + s * s / 2 * change)) @ R
    torques = [Q @ torque(scene, Q) for Q in (R, ahead)]
    tau_rate = R @ (torque(scene, ahead) - torque(scene, R)) / s + np.cross(o, torques[0])
    # l' = tau and l'' = tau' with l = J o and J' = hat(o) J - J hat(o)
    momentum, momentum_rate = J @ o, torques[0]
    turning = hat(o) @ J - J @ hat(o)
    second = hat(change) @ J - J @ hat(change) + hat(o) @ turning - turning @ hat(o)
    assert np.allclose(solve(J, momentum_rate - turning @ o), change)
    jerk = solve(J, tau_rate - second @ o - 2 * turning @ change)
    v = h * o + h**2 / 2 * change + h**3 * (jerk / 6 - np.cross(o, change) / 12)
    R_1 = expm(hat(v)) @ R
    return R_1, solve(scene.body.inertia, R_1.T @ (momentum + h / 4 * (torques[0] + 3 * torques[1])))


def gyroscopic(scene, h, R, w):
    w_1 = w + h * acceleration(scene, R, w)
    return R @ expm(h * hat(w_1)), w_1


def spiers(scene, h, R, w, rates_first=False):
    """Return attitude and rates by the formulas of *A better way to spin*, "My recommendation", in world axes.

    There, J is the inverse of the inertia, and Q(v) the rotation by v. The kick is that of its torque.
    """
    J = R @ np.linalg.inv(scene.body.inertia) @ R.T
    L = solve(J, R @ w) + h * R @ torque(scene, R)
    w = J @ L
    k = np.cross(w, L)
    share = k @ J @ k / (k @ k)
    if rates_first:  # "Modified Jolt Method"
        w = J @ expm(-h * hat(w - share * L)) @ L
        return expm(h * hat(w)) @ R, R.T @ w
    R_1 = expm(h * share * hat(L)) @ expm(h * hat(w - share * L)) @ R
    return R_1, R_1.T @ R_1 @ np.linalg.inv(scene.body.inertia) @ R_1.T @ L


def spiers_rates(scene, h, R, w):
    return spiers(scene, h, R, w, rates_first=True)


@scenes
@schemes
def test_a_step_is_that_of_the_formulas(scheme, scene):
    h = 0.15
    R, w = globals()[scheme](scene, h, scene.R_WB0, scene.w_WB_B0)
    step = cv.Textbook(scheme).solve(scene, cv.Grid(h, 1, 1))
    assert np.abs(step.R_WB[-1] - R).max() < 1e-14  # measured 8e-16
    assert np.abs(step.w_WB_B[-1] - w).max() < 1e-14  # measured 1.4e-15


@scenes
@schemes
def test_order(scheme, scene):
    truth = cv.integrate(scene, 0.01, cv.Reduced(order=8))
    coarse, fine = (cv.integrate(scene, 1 / n, cv.Textbook(scheme)) for n in (80, 160))
    errors = [angle_between(truth.R_WB[-1], each.R_WB[-1]) for each in (coarse, fine)]
    assert abs(np.log2(errors[0] / errors[1]) - cv.Textbook(scheme).order) < 0.03  # measured 0.010


@schemes
def test_fields_that_depend_on_time(scheme):
    turning = cv.Turning(cv.UniformGravity(3.0, LEVER), cv.Orbit(1.3, (0.3, -0.5, 0.8)))
    scene = HEAVY.rename("turning", potential=turning)
    truth = cv.integrate(scene, 0.005, cv.Projected()).R_WB[-1]
    errors = [angle_between(truth, cv.integrate(scene, 1 / n, cv.Textbook(scheme)).R_WB[-1]) for n in (80, 160)]
    assert abs(np.log2(errors[0] / errors[1]) - cv.Textbook(scheme).order) < 0.03  # measured 0.009


def test_the_auxiliary_acceleration_of_generalised_alpha():
    # Later steps differ from the first: without damping a is w' forever, and the step is the trapezoidal rule.
    scene, damped = SCENES["gravity"], []
    for rho in (0.0, 0.6, 1.0):
        run = cv.integrate(scene, 0.02, cv.Textbook("generalized_alpha", rho))
        damped.append(angle_between(run.R_WB[-1], cv.integrate(scene, 0.01, cv.Reduced(order=8)).R_WB[-1]))
    assert damped[0] > damped[1] > damped[2]
    symmetric = cv.integrate(scene, 0.1, cv.Textbook("generalized_alpha", 1.0), t_end=0.5)
    R, w, a = scene.R_WB0, scene.w_WB_B0, acceleration(scene, scene.R_WB0, scene.w_WB_B0)
    for R_1, w_1 in zip(symmetric.R_WB[1:], symmetric.w_WB_B[1:], strict=True):
        a_1 = acceleration(scene, R_1, w_1)
        assert np.abs(R @ expm(hat(0.05 * (w + w_1))) - R_1).max() < 1e-14  # measured 8e-16
        assert np.abs(w + 0.05 * (a + a_1) - w_1).max() < 1e-14  # measured 8e-16
        R, w, a = R_1, w_1, a_1


def thin(seed, condition):
    """Return a random thin body, with a full tensor, in gravity or free."""
    draw = np.random.default_rng(seed)
    R = Rotation.random(rng=draw).as_matrix()
    tensor = R @ np.diag((1 / condition, 1.0, 1.0 + 0.7 / condition)) @ R.T
    field = cv.UniformGravity(1.0, (0.3, 0.2, 0.1)) if seed % 2 else None
    return cv.Scene("thin", cv.RigidBody((tensor + tensor.T) / 2), np.eye(3), draw.normal(size=3), 10.0, field)


UNEVEN = [
    *(cv.scenes.random_body(field, seed=3, index=index) for field, index in (("attraction", 19), ("fixed_gradient", 36))),
    *(thin(seed, condition) for condition in (30, 1e3, 1e4) for seed in (0, 1, 4, 5)),
]


@pytest.mark.filterwarnings("ignore:Steps of 0.005 s do not resolve")  # of the truncation error, which is not tested here
@pytest.mark.parametrize(("index", "rho"), sampled(product(range(len(UNEVEN)), (0.9, 1.0)), 5))
def test_round_off_of_uneven_moments_does_not_prevent_convergence(index, rho):
    scene = UNEVEN[index]
    # Corrections stop shrinking at 1e-15 to 2e-13 of the accelerations, although the step is solved.
    h, J = 0.005, scene.body.inertia
    run = cv.integrate(scene, h, cv.Textbook("generalized_alpha", rho), t_end=5.0, on_failure="return")
    assert run.ok
    if rho == 1.0:  # the trapezoidal rule, so the equations of each step can be evaluated
        rates = [np.cross(J @ w, w) + torque(scene, R) for R, w in zip(run.R_WB, run.w_WB_B, strict=True)]
        defect = np.diff(run.w_WB_B @ J, axis=0) / h - (np.array(rates[1:]) + rates[:-1]) / 2
        assert np.abs(defect).max() * h / np.abs(run.w_WB_B @ J).max() < 5e-14  # measured 1.2e-14


def test_steps_that_are_too_long_fail_as_such():
    with pytest.raises(cv.NotConverged):
        cv.integrate(in_field("spring", w=(0, 0, 0)), 8.0, cv.Textbook("generalized_alpha"), t_end=16.0)


@pytest.mark.parametrize("scheme", ["spiers", "spiers_rates"])
def test_energy_of_a_free_body_in_spiers_step(scheme):
    free_body = SCENES["free"]
    one_step = [abs(cv.Textbook(scheme).solve(free_body, cv.Grid(h, 1, 1)).energy @ (-1, 1)) for h in (0.02, 0.01)]
    assert abs(np.log2(one_step[0] / one_step[1]) - 3) < 0.05  # measured 0.012; "we're now third-order"
    runs = [cv.integrate(free_body, h, cv.Textbook(scheme), t_end=500.0, sample_every=100) for h in (0.02, 0.01)]
    late = [abs(np.polyfit(run.t, run.energy, 1)[0]) for run in runs]
    assert 7 < late[0] / late[1] < 10  # measured 7.9: the drift is secular, and of order 3
    symmetric = cv.integrate(free((1, 1, 2), (0.3, -2.0, 1.0)), 0.1, cv.Textbook(scheme), t_end=100.0)
    assert np.abs(symmetric.drift("energy")).max() < 1e-13  # measured 2.2e-15


def test_spiers_step_is_the_motion_of_a_free_symmetric_body():
    for scene in (free((1, 1, 2), (0.3, -2.0, 1.0)), free((2, 2, 2), (0.3, -2.0, 1.0)), free((1, 1.4, 2), (0, 0, 3.0))):
        exact = registry.method("exact").solve(scene, cv.Grid(0.5, 20, 1))
        run = cv.Textbook("spiers").solve(scene, cv.Grid(0.5, 20, 1))
        assert angle_between(run.R_WB, exact.R_WB).max() < 1e-13  # measured 9e-15
    tumbling, grid = SCENES["free"], cv.Grid(0.5, 20, 1)
    off = angle_between(cv.Textbook("spiers").solve(tumbling, grid).R_WB, registry.method("exact").solve(tumbling, grid).R_WB)
    assert off.max() > 0.1


def test_a_body_at_rest_in_equilibrium_stays():
    for scheme in SCHEMES:
        trajectory = cv.integrate(cv.scenes.hanging_rest(), 0.1, cv.Textbook(scheme))
        assert angle_between(trajectory.R_WB[0], trajectory.R_WB[-1]) < 1e-15  # measured 0


@pytest.mark.parametrize(
    ("settings", "argument"), [({"scheme": "rk4"}, "scheme"), ({"rho": 1.1}, "rho"), ({"rho": "a"}, "rho")]
)
def test_wrong_settings_are_refused(settings, argument):
    with pytest.raises(cv.BadInput) as raised:
        cv.Textbook(**settings)
    assert raised.value.argument == argument
