"""Mistakes of programs, planted into equations that SciPy integrates, are named on short motions, and again on others."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.attitude import from_quaternion, to_quaternion
from conservative.benchmarks.verification.compare import Compared, compare_answers
from conservative.benchmarks.verification.explain import PROGRAM_KINDS, diagnose
from conservative.benchmarks.verification.explanation import attempt
from conservative.benchmarks.verification.mistakes import BY_KEY, habits, table_of
from conservative.benchmarks.verification.mistakes.readings import READINGS, Reading
from conservative.benchmarks.verification.motions.motion import load
from conservative.benchmarks.verification.motions.signatures import remedies
from conservative.benchmarks.verification.trials import compose
from conservative.references.exact.method import free_body

from ...sampling import sampled

MOTIONS = {each.name: each for each in load()}
NAMES = ("golden_9", "golden_4", "products")
ALLOWED = np.array([1e-3, 1e-4])
Y_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


def product(p, q):
    return np.array([p[0] * q[0] - p[1:] @ q[1:], *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))])


def slope(J, G, arm, turn=1.0, left=False, gyroscopic=1.0, damping=0.0, fixed=None, **_):
    def f(t, y):
        q, w = y[:4] / np.linalg.norm(y[:4]), y[4:]
        R, rate = from_quaternion(q), np.array([0.0, *(turn * w)])
        K, H = (J, G) if fixed is None else (R.T @ fixed @ R,) * 2
        torque = gyroscopic * np.cross(H @ w, w) + np.cross(R[2], arm)
        return np.concatenate([(product(rate, q) if left else product(q, rate)) / 2, np.linalg.solve(K, torque) - damping * w])

    return f


def integrate(motion, t, after=None, shift=(0.0, 0.0), start=None, moments=lambda J: J, arm=1.0, inertia=None, **terms):
    """Samples at t, s: the state after each step is changed, or it is sampled at other times."""
    J = moments(np.array(motion.inertia_B))
    G = np.diag(np.diag(J)) if terms.get("diagonal") else J
    if inertia is not None:
        terms["fixed"] = inertia(J, motion.scene.R_WB0)
    f = slope(J, G, arm * np.array(motion.arm), **terms)
    y = np.concatenate([to_quaternion(motion.scene.R_WB0), motion.scene.w_WB_B0])
    if start is not None:
        y = np.concatenate([to_quaternion(start(motion.scene.R_WB0)), y[4:]])
    size = {"rtol": 1e-11, "atol": 1e-12 * max(1.0, np.abs(y[4:]).max())}
    if after is None:
        at = [solve_ivp(f, (0, each.max()), y, "DOP853", each, **size).y.T for each in (t + shift[0], t + shift[1])]
        rows = np.hstack([at[0][:, :4], at[1][:, 4:]])
    else:
        h, rows = motion.step, []
        for _ in range(1, round(t[-1] / h) + 1):
            y = solve_ivp(f, (0, h), y, "DOP853", **size).y[:, -1]
            y[4:] = after(y[4:])
            rows.append(y)
        rows = np.array(rows)[np.rint(t / h).astype(int) - 1]
    return from_quaternion(rows[:, :4] / np.linalg.norm(rows[:, :4], axis=1, keepdims=True)), rows[:, 4:]


def limited(speed, most):
    return lambda w: w * min(1.0, most * speed / np.linalg.norm(w))


def world(R, w):
    return R, (R @ w[:, :, None])[:, :, 0]


def rolled(R, w):
    return from_quaternion(np.roll(to_quaternion(R), -1, axis=1)), w


PLANTED = {
    "wrong side": {"left": True},
    "factor one half": {"turn": 2.0},
    "speed of attitudes": {"turn": 0.5},
    "no gyroscopic term": {"gyroscopic": 0.0},
    "sign of the gyroscopic term": {"gyroscopic": -1.0},
    "damping": {"damping": 0.1},
    "no gyroscopic term + damping": {"gyroscopic": 0.0, "damping": 0.1},
    "inverted inertia": {"moments": np.linalg.inv},
    "inertia in world axes": {"inertia": lambda J, R: J},
    "inertia of the start": {"inertia": lambda J, R: R @ J @ R.T},
    "half a step late": {"shift": (-0.5, -0.5)},
    "rates half a step late": {"shift": (0.0, -0.5)},
    "rate limit": {"limit": 0.97},
    "frozen motion": {"read": lambda R, w: (0 * R + START[0], 0 * w + START[1])},
    "transposed": {"read": lambda R, w: (R.swapaxes(1, 2), w)},
    "order xyzw": {"read": rolled},
    "world rates": {"read": world},
    "rates in degrees": {"read": lambda R, w: (R, np.degrees(w))},
    "axes y up": {"read": lambda R, w: (Y_UP @ R @ Y_UP.T, w @ Y_UP.T)},
    "world y up": {"read": lambda R, w: (Y_UP @ R, w)},
    "no gyroscopic term + world rates": {"gyroscopic": 0.0, "read": world},
    "start transposed": {"start": lambda R: R.T},
    "without the field": {"arm": 0.0},
    "sign of the field": {"arm": -1.0},
    "no products of inertia": {"moments": lambda J: np.diag(np.diag(J))},
    "diagonal gyroscopic term": {"diagonal": True},
}
ONLY = {
    "golden_4": ("without the field", "sign of the field"),
    "products": ("no products of inertia", "diagonal gyroscopic term"),
}
START = [np.eye(3), np.zeros(3)]


def answers(motion, n=24, read=lambda R, w: (R, w), limit=None, shift=(0.0, 0.0), **terms):
    """The case of a program with a mistake."""
    START[:] = motion.scene.R_WB0, motion.scene.w_WB_B0
    every = max(1, round(motion.t[-1] / motion.step / n))
    t = motion.step * every * np.arange(1, n + 1)
    after = None if limit is None else limited(np.linalg.norm(motion.scene.w_WB_B0), limit)
    data = read(*integrate(motion, t, after, (shift[0] * motion.step, shift[1] * motion.step), **terms))
    scene = motion.scene.rename(motion.name, t_end=max(motion.scene.t_end, float(t[-1])))
    return compare_answers(scene, t, data, ALLOWED, motion.step)


ONE_STEP = ("products", "rate limit")
"""The rates fall below the limit after the first step: one row shows no limit."""
CASES = [
    (name, key)
    for name in NAMES
    for key in PLANTED
    if all(key not in keys or name == one for one, keys in ONLY.items()) and (name, key) != ONE_STEP
]


SEARCHED_LONG = [("golden_4", "no gyroscopic term + world rates"), ("products", "no gyroscopic term + world rates")]
ELSEWHERE = (
    "no gyroscopic term + damping", "no gyroscopic term + world rates", "transposed", "order xyzw", "rates in degrees",
    "axes y up",
)  # fmt: skip
"""Mistakes that are named in `test_diagnose.py` or on another motion, and readings, which are written and read back below."""
FREE = [("golden_9", key) for key in PLANTED if ("golden_9", key) in CASES and key not in ELSEWHERE]
HEAVY = [("golden_4", key) for key in (*ONLY["golden_4"], "inertia of the start")]
TENSOR = [("products", key) for key in (*ONLY["products"], "inverted inertia", "inertia in world axes", "axes y up")]


@pytest.mark.parametrize(("name", "key"), sampled(CASES, 0, keep=[*FREE, *HEAVY, *TENSOR], leave=SEARCHED_LONG))
def test_a_planted_mistake_of_a_program_is_named(name, key):
    case = answers(MOTIONS[name], **PLANTED[key])
    found = diagnose(case, kinds=PROGRAM_KINDS)
    explaining = [each for each in found.named if each.explains]
    if (case.error.max(axis=1) <= case.allowed).all():
        pytest.skip("the mistake cannot be seen here")
    assert [each.name for each in explaining] == [key]


def central(J, motion):
    """The inertia about the centre of mass."""
    c, mass = np.array(motion.com_B), motion.weight / 9.81
    return J - mass * (c @ c * np.eye(3) - np.outer(c, c))


APPLIED = {
    ("golden_4", "inertia about the centre of mass"): {"moments": lambda J: central(J, MOTIONS["golden_4"])},
    ("products", "sign of the products of inertia"): {"moments": lambda J: 2 * np.diag(np.diag(J)) - J},
    ("golden_9", "start in order xyzw"): {"start": lambda R: from_quaternion(np.roll(to_quaternion(R), 1))},
}
"""Further mistakes of scenes, which are applied without a search."""


@pytest.mark.parametrize(("name", "key"), APPLIED)
def test_a_mistake_that_is_applied_leaves_nothing(name, key):
    found = attempt(answers(MOTIONS[name], **APPLIED[name, key]), compose(BY_KEY[key]))
    assert found.explains
    assert max(found.left) < 1e-8 < 1e-3 < max(found.plain)


def test_a_key_is_there_once():
    with pytest.raises(ValueError, match="'transposed' twice"):
        table_of([*BY_KEY.values(), BY_KEY["transposed"]])


def test_each_mistake_that_a_program_shows_has_a_remedy():
    assert [name for name, remedy in remedies().items() if not remedy] == []


def test_a_named_mistake_explains_another_motion_with_the_same_number():
    first = diagnose(answers(MOTIONS["golden_9"], damping=0.1), kinds=PROGRAM_KINDS).named[0]
    again = first.again(answers(MOTIONS["golden_4"], damping=0.1))
    assert (again.cause.key, again.explains, again.values) == ("damping", True, first.values)
    assert max(again.left) < 1e-9 < 1e-3 < max(again.plain)  # measured: 2e-11 of 0.009
    other = first.again(answers(MOTIONS["golden_4"], turn=2.0))
    assert not other.explains
    missing = replace(first, trial=compose(BY_KEY["without the field"]), values={})
    assert missing.again(answers(MOTIONS["golden_9"])) is None  # a free body has no field


T = np.linspace(0, 8, 401)
BODY = cv.RigidBody([[3.0, 0.4, -0.2], [0.4, 2.0, 0.3], [-0.2, 0.3, 4.0]])
SCENE = cv.Scene("recorded", BODY, Rotation.from_rotvec([0.4, -0.7, 0.3]), [0.7, -1.1, 1.6], 8.0)
R, W = free_body(BODY, SCENE.R_WB0, SCENE.w_WB_B0, T)
TURN = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()
STOP = 30
EVEN = (np.arange(len(T)) % 2 == 1)[:, None]


def still():
    k = np.minimum(np.arange(len(T)), STOP)
    return R[k], np.where(np.arange(len(T))[:, None] < STOP, W, 0.0)


RECORDED = {
    "sleep": (still, {"time": T[STOP]}),
    "held rows": (lambda: (R[2 * (np.arange(len(T)) // 2)], W[2 * (np.arange(len(T)) // 2)]), {"first": 2, "period": 2}),
    "one component in some rows": (lambda: (R, np.where(EVEN, W[:, :1], W)), {"first": 2, "period": 2}),
    "order xyzw in some rows": (lambda: (np.where(EVEN[:, None], rolled(R, W)[0], R), W), {"first": 2, "period": 2}),
    "rates in turned axes": (lambda: (R, W @ TURN), dict(zip(("turn_1", "turn_2", "turn_3"), (0.3, -0.8, 0.5), strict=True))),
    "rates in mirrored axes": (lambda: (R, W * (1, 1, -1)), {"turn_1": 0.0, "turn_2": 0.0, "turn_3": np.pi}),
    "bias of the rates": (lambda: (R, W + np.array([0.01, 0.02, -0.03])), {"bias_1": 0.01, "bias_2": 0.02, "bias_3": -0.03}),
    "frozen motion": (lambda: (0 * R + R[0], 0 * W + W[0]), {}),
    "no gyroscopic term": (lambda: (None, 0 * W + W[0]), {}),
}


ALL_ROWS, SOME = slice(None), slice(0, 301)
QUICK = ["no gyroscopic term", "held rows", "one component in some rows", "order xyzw in some rows", "frozen motion"]
BOTH = [*((key, SOME) for key in QUICK), ("sleep", ALL_ROWS)]


@pytest.mark.parametrize(("key", "rows"), sampled([(key, rows) for key in RECORDED for rows in (ALL_ROWS, SOME)], 0, BOTH))
def test_a_mistake_of_a_recording_is_named_on_all_rows_and_on_some(key, rows):
    make, values = RECORDED[key]
    data, allowed = make(), np.full(2, 1e-9)
    scale = float(np.linalg.norm(W, axis=1).max())
    case = Compared(SCENE, T, data, 0.0, scale, allowed, np.full(2, 1e-13)).read(*data)
    found = diagnose(case.take(rows)).named
    assert [each.name for each in found if each.explains] == [key]
    assert {name: abs(x) for name, x in found[0].values.items()} == pytest.approx(
        {name: abs(x) for name, x in values.items()}, rel=1e-6, abs=1e-9
    )


@pytest.mark.parametrize(("unit", "size"), [("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("min", 60.0)])
def test_times_in_another_unit_are_times_in_seconds_of_its_size(unit, size):
    mistake = BY_KEY[f"time in {unit}"]
    assert mistake.unit == size
    assert [t.tolist() for t in mistake.at(np.array([0.0, 2.0]), 0.1)] == [[0.0, 2 * size]] * 2


@pytest.mark.parametrize("key", [each.key for each in READINGS])
def test_what_a_reading_writes_it_reads_back(key):
    reading = BY_KEY[key]
    numbers = np.array([0.3, -0.8, 0.5])[: len(reading.numbers)]
    written = reading.write(R[:20], W[:20], *numbers)
    assert any(np.abs(a - b).max() > 0.1 for a, b in zip(written, (R[:20], W[:20]), strict=True))
    for found, right in zip(reading.read(*written, *numbers), (R[:20], W[:20]), strict=True):
        np.testing.assert_allclose(found, right, rtol=0, atol=1e-14)


@pytest.mark.parametrize("key", [key for key in RECORDED if isinstance(BY_KEY[key], Reading)])
def test_a_reading_writes_the_rows_that_are_written_by_hand(key):
    make, values = RECORDED[key]
    for found, expected in zip(BY_KEY[key].write(R, W, *values.values()), make(), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


def test_a_band_is_not_larger_than_what_it_removed_shows():
    assert [habits.roundest(*each) for each in ((0.0499, 10), (0.0512, 0.0525), (0.97, 1.2), (0.05, 0.06))] == [
        0.05,
        0.052,
        1,
        0.06,
    ]
