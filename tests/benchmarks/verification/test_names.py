"""Mistakes of recorders, sensors and filters are named with their numbers, and not where another mistake is planted."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation, Slerp

import conservative as cv
from conservative.benchmarks.verification.mistakes import BY_KEY
from conservative.benchmarks.verification.recordings.table import Recording
from conservative.benchmarks.verification.recordings.verdict import verify_recording

from ...sampling import sampled
from .made import FREE, HEAVY, START, T, exact

FINE = np.linspace(0, 6, 301)
RATE, TURN = np.array([0.02, -0.05, 0.03]), Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()


def turns(t, rate):
    return Rotation.from_rotvec(t[:, None] * rate).as_matrix()


def scattered(motion, size, seed=3):
    """Rows with noise, rad and rad/s."""
    (R, w), random = motion, np.random.default_rng(seed)
    return R @ Rotation.from_rotvec(size * random.normal(size=w.shape)).as_matrix(), w + size * random.normal(size=w.shape)


def scattered_rows(rows, size):
    return *scattered(rows[:2], size), rows[2]


def integral(scene, bias):
    """The attitudes that SciPy integrates from the rates of a free body, which Euler's equations give, and a bias."""
    J = scene.body.inertia

    def slope(t, y):
        x, w = y[:9].reshape(3, 3), y[9:]
        a, b, c = w + bias
        return np.append(x @ [[0, -c, b], [c, 0, -a], [-b, a, 0]], np.linalg.solve(J, np.cross(J @ w, w)))

    y = solve_ivp(slope, (0, 6), np.append(scene.R_WB0, scene.w_WB_B0), "DOP853", T, rtol=1e-13, atol=1e-14).y.T
    return y[:, :9].reshape(-1, 3, 3), y[:, 9:]


def between(scene, spacing, first, law, attitudes=True, rates=True):
    """Rows between samples, from the first one on, by SciPy's slerp or by lines between components of quaternions."""
    times = first + spacing * np.arange(int((6.0 - first) / spacing) + 2)
    R, w = exact(scene, times if first == 0 else np.append(0.0, times))
    R, w = R[-len(times) :], w[-len(times) :]
    t = FINE[first <= FINE]
    q = Rotation.from_matrix(R).as_quat()
    q[1:] *= np.cumprod(np.sign((q[1:] * q[:-1]).sum(axis=1)))[:, None]
    on_line = Rotation.from_quat(np.transpose([np.interp(t, times, x) for x in q.T])).as_matrix()
    made = Slerp(times, Rotation.from_matrix(R))(t).as_matrix() if law == "slerp" else on_line
    right = exact(scene, FINE)
    return (
        made if attitudes else right[0][first <= FINE],
        np.transpose([np.interp(t, times, x) for x in w.T]) if rates else right[1][first <= FINE],
        t,
    )


def held(scene, spacing, attitudes=True, rates=True):
    """Rows that repeat samples."""
    k = np.floor(FINE / spacing + 1e-9).astype(int)
    (R, w), right = exact(scene, spacing * np.arange(k[-1] + 1)), exact(scene, FINE)
    return R[k] if attitudes else right[0], w[k] if rates else right[1], FINE


def stopped(scene, attitudes=True, rates=True, rest=1.0):
    """Rows whose attitudes or rates stay as they are at 3.593 s."""
    R, w = exact(scene, FINE)
    last = exact(scene, np.append(FINE[:180], 3.593))
    R[180:], w[180:] = last[0][-1] if attitudes else R[180:], rest * last[1][-1] if rates else w[180:]
    return R, w, FINE


def in_steps(scene, name, parts):
    """The motion of a free body by a structured method, with `parts` steps between two rows, from its equations."""
    J, R, L, h = scene.body.inertia, scene.R_WB0, scene.body.inertia @ scene.w_WB_B0, T[1] / parts

    def hat(v):
        return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])

    def cayley(v):
        return np.linalg.solve(np.eye(3) - hat(v) / 2, np.eye(3) + hat(v) / 2)

    def expm(v):
        return Rotation.from_rotvec(v).as_matrix()

    kept = [(R, L)]
    for _ in range((len(T) - 1) * parts):
        turn, w = np.eye(3), np.linalg.solve(J, L)
        for _ in range(60):
            if name == CAYLEY:  # R1 - R0 = h (R0 + R1)/2 [mean rates], and the momentum in world axes stays
                turn = cayley(h * np.linalg.solve(J, L + turn.T @ L) / 2)
            elif name == MIDDLE:  # the momentum at half a turn
                w = np.linalg.solve(J, expm(-h * w / 2) @ L)
                turn = expm(h * w)
            else:  # turn Jd - Jd turn' = h [L] with Jd = tr(J)/2 - J
                c = h * w / 2
                w = np.linalg.solve(J, (1 + c @ c) * L - 2 / h * np.cross(c, J @ c))
                turn = cayley(h * w)
        R, L = R @ turn, turn.T @ L
        kept.append((R, L))
    kept = kept[::parts]
    return np.array([R for R, _ in kept]), np.linalg.solve(J, np.array([L for _, L in kept]).T).T


def spoiled(scene, flips):
    """Rates of differences of quaternions, wrong where the quaternion changes its sign."""
    R, w = exact(scene)
    w[flips] += 50.0
    return R, w, T, np.isin(np.arange(len(T)), flips)


CAYLEY = "the energy-momentum method (Krenk & Nielsen; Simo & Wong with Cayley's map)"
MIDDLE, DISCRETE = "the midpoint rule on the rotation group", "the discrete Moser-Veselov map"
MOMENTUM = np.array([0.51234, -0.31234, 1.21234])
WHEEL = cv.Scene("wheel", cv.RigidBody(FREE.body.inertia, MOMENTUM), *START, 6.0)
ROUNDED = cv.Scene("before", cv.RigidBody(FREE.body.inertia, MOMENTUM + np.array([4e-6, -3e-6, 2e-6])), *START, 6.0)
OTHER = cv.Scene("other", cv.RigidBody(FREE.body.inertia, MOMENTUM + np.array([4e-5, -3e-6, 2e-6])), *START, 6.0)
R, W = exact(FREE)
HR, HW = exact(HEAVY)
UP = np.array([0.0, 0.0, 1.0])
DRIFT = {"drift_1": 0.02, "drift_2": -0.05, "drift_3": 0.03}
TURNED = {"turn_1": 0.3, "turn_2": -0.8, "turn_3": 0.5}
PLANTED = {
    "drift in body axes": (FREE, lambda: (R @ turns(T, RATE), W), DRIFT),
    "drift in body axes, noise": (HEAVY, lambda: scattered((HR @ turns(T, RATE), HW), 1e-3), DRIFT),
    "drift in world axes": (HEAVY, lambda: (turns(T, RATE) @ HR, HW), DRIFT),
    "heading drift": (HEAVY, lambda: (turns(T, 0.1 * UP) @ HR, HW), {"drift": 0.1}),
    "drift of a bias": (FREE, lambda: integral(FREE, RATE), DRIFT),
    "drift of a bias, noise": (FREE, lambda: scattered(integral(FREE, RATE), 1e-3), DRIFT),
    "turned attitudes": (FREE, lambda: (R @ TURN, W), TURNED),
    "rates in turned axes, noise": (HEAVY, lambda: scattered((HR, HW @ TURN), 1e-3), TURNED),
    "size of the rates": (HEAVY, lambda: (HR, 1.03 * HW), {"factor": 1.03}),
    "interpolated quaternions and interpolated rates": (FREE, lambda: between(FREE, 0.1, 0.0, "line"), {"spacing": 0.1}),
    "attitudes by slerp": (HEAVY, lambda: between(HEAVY, 0.137, 0.061, "slerp", rates=False), {"spacing": 0.137}),
    "interpolated rates": (FREE, lambda: between(FREE, 0.137, 0.061, "line", attitudes=False), {"spacing": 0.137}),
    "held samples": (FREE, lambda: held(FREE, 1 / 12), {"spacing": 1 / 12}),
    "held rates": (HEAVY, lambda: held(HEAVY, 0.1, attitudes=False), {"spacing": 0.1}),
    "frozen attitudes": (FREE, lambda: stopped(FREE, rates=False), {"time": 3.593}),
    "frozen rates": (HEAVY, lambda: stopped(HEAVY, attitudes=False), {"time": 3.593}),
    "rates of 0": (FREE, lambda: stopped(FREE, attitudes=False, rest=0.0), {"time": 3.6}),
    "halt, noise": (FREE, lambda: scattered_rows(stopped(FREE), 1e-3), {"time": 3.593}),
    CAYLEY: (FREE, lambda: in_steps(FREE, CAYLEY, 2), {"step": 0.025}),
    MIDDLE: (FREE, lambda: in_steps(FREE, MIDDLE, 2), {"step": 0.025}),
    DISCRETE: (FREE, lambda: in_steps(FREE, DISCRETE, 1), {"step": 0.05}),
    "digits of the scene": (WHEEL, lambda: exact(ROUNDED), {"the wheel's momentum 1": MOMENTUM[0] + 4e-6}),
    "rates at sign changes": (FREE, lambda: spoiled(FREE, [17, 34, 51, 68]), {"rows": 4, "first": 18}),
}  # fmt: skip


def verified(scene, R, w, t=T, flipped=None):
    return verify_recording(scene, Recording(t, (R, w), rows=len(t), flipped=flipped))


KEEP = [
    "drift in body axes, noise",
    "drift of a bias",
    "turned attitudes",
    "attitudes by slerp",
    "held rates",
    "rates at sign changes",
]


@pytest.mark.parametrize("name", sampled(PLANTED, 7, KEEP))
def test_a_planted_mistake_is_named_with_its_number(name):
    scene, plant, values = PLANTED[name]
    found = verified(scene, *plant())
    key, noisy = name.removesuffix(", noise"), name.endswith("noise")
    assert (found.verdict, found.findings[0].mistake) == ("wrong", key)
    values_found = found.details.explaining[0].values
    for number, value in values.items():
        if noisy:  # the interval has two deviations
            assert 0 < values_found[number].interval < 2e-3
            assert abs(values_found[number] - value) < 2 * values_found[number].interval
        else:
            assert values_found[number] == pytest.approx(value, rel=1e-9, abs=1e-10)
    assert max(found.details.explaining[0].left) < (1e-2 if noisy else 2e-11)  # measured: 5e-12 without noise


def quadratic():
    """Attitudes that turn away faster and faster, as no drift at a constant rate does."""
    return R @ Rotation.from_rotvec(T[:, None] ** 2 * RATE).as_matrix(), W


def of_a_damped_body():
    """Rows between samples of a motion that is not right: the samples are wrong, too."""
    a, b, t = between(FREE, 0.1, 0.0, "line")
    return a, b * np.exp(-0.05 * t)[:, None], t


def jumped():
    """Attitudes that are turned from a row on."""
    return np.concatenate([R[:60], R[60:] @ TURN]), W


BESIDE = {
    "a drift that grows": (FREE, quadratic),
    "samples of a wrong motion": (FREE, of_a_damped_body),
    "a mount that moves once": (FREE, jumped),
    "a wheel that differs by four units of its last digit": (WHEEL, lambda: exact(OTHER)),
}


@pytest.mark.parametrize("name", sampled(BESIDE, 1))
def test_a_motion_beside_the_mistakes_is_not_given_their_names(name):
    scene, plant = BESIDE[name]
    found = verified(scene, *plant())
    assert (found.verdict, found.findings[0].causes) == ("wrong", ())


def test_all_names_are_in_the_catalogue():
    assert {name.removesuffix(", noise") for name in PLANTED} <= set(BY_KEY)


def test_a_method_with_a_motor_takes_its_torque_at_the_start_of_a_step():
    """The momentum of the motor has a corner within a step."""
    times, values = [0.0, 2.51, 6.0], np.array([[0.3, -0.2, 0.4], [-0.5, 0.6, 0.1], [0.2, 0.1, -0.3]])
    J, (R, w), rows, step = FREE.body.inertia, (FREE.R_WB0, FREE.w_WB_B0), [(FREE.R_WB0, FREE.w_WB_B0)], T[1] / 2
    for number in range(2 * (len(T) - 1)):
        t = number * step
        k = int(t >= times[1])
        change = (values[k + 1] - values[k]) / (times[k + 1] - times[k])
        h = values[k] + change * (t - times[k])
        w = w + step * np.linalg.solve(J, np.cross(J @ w + h, w) - change)  # rates first, then the attitude
        R = R @ Rotation.from_rotvec(step * w).as_matrix()
        rows += [(R, w)] * (number % 2)
    scene = cv.Scene("wheel", cv.RigidBody(J, rotor_momentum=(times, values)), *START, 6.0)
    found = verify_recording(scene, Recording(T, (np.array([R for R, _ in rows]), np.array([w for _, w in rows])), rows=len(T)))
    expected = "semi-implicit Euler with an explicit gyroscopic term and the exponential map"
    assert [each.keys for each in found.details.explaining] == [(expected,)]
    assert found.details.explaining[0].values["step"] == pytest.approx(step)
    assert max(found.details.explaining[0].left) < 1e-11
