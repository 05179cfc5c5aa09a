"""Each part of a scene is judged: its right motion is right, the one without it is WRONG, and the part is named.

Right motions come from an integration of its own: J w' = (J w + h) x w - h' + T with SciPy, which starts again at each jump or
corner, and evaluates loads inside of the pieces only.
"""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative import registry
from conservative.benchmarks.verification import explain
from conservative.benchmarks.verification.recordings import table as table_of_file
from conservative.benchmarks.verification.recordings.formats import table as formats
from conservative.benchmarks.verification.recordings.table import Recording
from conservative.benchmarks.verification.recordings.verdict import verify_recording
from conservative.benchmarks.verification.trials import remark_on_damping
from conservative.errors import BadInput
from conservative.grid import Grid
from conservative.potentials.turning import Orbit
from conservative.references import truth

from ...sampling import sampled
from .made import exact, stepped, without

J = np.array([[3.0, 0.4, -0.2], [0.4, 2.0, 0.3], [-0.2, 0.3, 4.0]])
R0, W0 = Rotation.from_rotvec([0.4, -0.7, 0.3]).as_matrix(), np.array([0.7, -1.1, 1.6])
H, D = np.array([0.5, -0.3, 1.2]), np.array([[0.3, 0.1, 0.0], [-0.1, 0.2, 0.0], [0.0, 0.0, 0.1]])
COM, UP = np.array([0.1, -0.3, 0.6]), np.array([0.0, 0.0, 1.0])
TIMES, VALUES = [0.0, 2.0, 2.0, 3.5, 6.0], np.array([[0, 0, 0], [0, 0, 0], [1.5, 0.4, 0], [1.5, 0.4, 0], [0, -1.0, 0.3]])
T = np.linspace(0, 6, 121)
NORMAL, PLANET, RATE = np.array([0.3, -0.5, 0.8]), np.array([0.5, 0.3, 0.0]), 0.9


def nothing(t, R=None, w=None):
    return np.zeros(3)


def integrate(t, torque=nothing, h=nothing, slope=nothing, breaks=()):
    """The motion at times t, s, with a torque (N m, body axes) of time, attitude and rates, and a rotor of momentum h(t)."""

    def f(t, y):
        R, w = y[:9].reshape(3, 3), y[9:]
        turn = R @ np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        rates = np.linalg.solve(J, np.cross(J @ w + h(t), w) - slope(t) + torque(t, R, w))
        return np.concatenate([turn.ravel(), rates])

    y, rows, stops = np.concatenate([R0.ravel(), W0]), [], [0.0, *breaks, t[-1]]
    for a, b in pairwise(stops):
        inside = [np.nextafter(a, b), np.nextafter(b, a)]
        at = np.append(t[(t >= a) & (t < b)], b)
        y = solve_ivp(lambda t, y: f(np.clip(t, *inside), y), (a, b), y, "DOP853", at, rtol=1e-13, atol=1e-13).y.T  # noqa: B023
        rows, y = [*rows, *(y if b == t[-1] else y[:-1])], y[-1]
    rows = np.array(rows)
    return Rotation.from_matrix(rows[:, :9].reshape(-1, 3, 3)).as_matrix(), rows[:, 9:]


@cache
def without_parts():
    return integrate(T)


def table(t):
    i = np.searchsorted(TIMES, t, "right") - 1
    a, b = TIMES[i : i + 2]
    return VALUES[i] + (t - a) / (b - a) * (VALUES[i + 1] - VALUES[i])


def attitude_torque(t, R):
    return np.cos(2 * t) * np.cross(R.T @ UP, [0.3, 0.0, 0.8])


def attitude_damping(t, R):
    b = R.T @ np.array([np.sin(t), 0.0, np.cos(t)])
    return 0.4 * (np.eye(3) - np.outer(b, b))


def gradient(e, R):
    u = R.T @ e
    return 3 * RATE**2 * np.cross(u, J @ u)


def turning(t, R, w):
    orbit = Rotation.from_rotvec(RATE * t * NORMAL / np.linalg.norm(NORMAL)).as_matrix()
    across = PLANET - PLANET @ NORMAL / (NORMAL @ NORMAL) * NORMAL
    return gradient(orbit @ across / np.linalg.norm(across), R)


def satellite():
    across = PLANET - PLANET @ NORMAL / (NORMAL @ NORMAL) * NORMAL
    return Orbit(RATE, NORMAL).gravity_gradient(J, across)


def of_time():
    """Gravity along z whose size depends on the time, as two Python functions."""
    size = lambda t: 4 * (1 + 0.5 * np.sin(t))  # noqa: E731
    energy = lambda R, t: size(t) * (R[2] @ COM)  # noqa: E731
    return cv.FunctionPotential(energy, lambda R, t: size(t) * np.outer(UP, COM), scale=4.0, time_dependent=True)


def gravity(t, R, w):
    return np.cross(COM, R.T @ (-4 * (1 + 0.5 * np.sin(t)) * UP))


def scene(rotor=None, **parts):
    return cv.Scene("part", cv.RigidBody(J, rotor), R0, W0, 6.0, **parts)


BREAKS = {"breaks": [2.0, 3.5]}
SPUN = lambda t: np.array([0.2, 0.1 * t, 0.3 * np.sin(t)])  # noqa: E731
PARTS = {
    "rotor": (lambda: scene(H), {"h": lambda t: H}, "without the rotor"),
    "motor": (lambda: scene(SPUN), {"h": SPUN, "slope": lambda t: np.array([0, 0.1, 0.3 * np.cos(t)])}, "without the rotor"),
    "torque, body": (lambda: scene(torque=cv.Torque(H)), {"torque": lambda t, R, w: H}, "without the torque"),
    "torque, world": (
        lambda: scene(torque=cv.Torque(H, "world")),
        {"torque": lambda t, R, w: R.T @ H},
        "without the torque",
    ),
    "torque, table with a jump": (
        lambda: scene(torque=cv.Torque((TIMES, VALUES))),
        {"torque": lambda t, R, w: table(t)} | BREAKS,
        "without the torque",
    ),
    "torque, function with a jump": (
        lambda: scene(torque=cv.Torque(lambda t: [0.0, 2.0 * (2 <= t < 3.5), 0.1], breaks=(2.0, 3.5))),
        {"torque": lambda t, R, w: np.array([0.0, 2.0 * (2 <= t < 3.5), 0.1])} | BREAKS,
        "without the torque",
    ),
    "torque of attitude": (
        lambda: scene(torque=cv.Torque(attitude_torque)),
        {"torque": lambda t, R, w: attitude_torque(t, R)},
        "without the torque",
    ),
    "damping": (lambda: scene(damping=cv.Damping(D)), {"torque": lambda t, R, w: -D @ w}, "without the damping"),
    "damping, table": (
        lambda: scene(damping=cv.Damping(D, ([0, 2, 3.5, 6], [0, 0, 2, 2]))),
        {"torque": lambda t, R, w: -np.interp(t, [0, 2, 3.5, 6], [0, 0, 2, 2]) * D @ w} | BREAKS,
        "without the damping",
    ),
    "damping, jumps": (
        lambda: scene(damping=cv.Damping(D, ([0, 2, 2, 3.5, 3.5, 6], [0.3, 0.3, 2, 2, 0, 0]))),
        {"torque": lambda t, R, w: -(0.3 if t < 2 else 2 if t < 3.5 else 0) * D @ w} | BREAKS,
        "without the damping",
    ),
    "damping, function with jumps": (
        lambda: scene(damping=cv.Damping(D, lambda t: 0.3 + 2.0 * (2 <= t < 3.5), breaks=(2.0, 3.5))),
        {"torque": lambda t, R, w: -(0.3 + 2.0 * (2 <= t < 3.5)) * D @ w} | BREAKS,
        "without the damping",
    ),
    "damping of attitude": (
        lambda: scene(damping=cv.Damping(attitude_damping)),
        {"torque": lambda t, R, w: -attitude_damping(t, R) @ w},
        "without the damping",
    ),
    "turning field": (lambda: scene(potential=satellite()), {"torque": turning}, "without the field"),
    "field of time": (lambda: scene(potential=of_time()), {"torque": gravity}, "without the field"),
}


def judged(scene, t, R, w, from_row=True, allowed=1e-9):
    found = verify_recording(scene, Recording(t, (R, w), rows=len(t)), from_row, allowed)
    assert {row["quantity"] for row in found.details.rows()} == {quantity.name for quantity in found.details.quantities}
    return found


@pytest.mark.parametrize(("name", "first"), [("rotor", 0.0), ("rotor", 3.7), ("rotor", 1e5), ("damping, jumps", 1.0)])
def test_a_file_in_several_chunks_whose_first_time_is_not_0(name, first, tmp_path, monkeypatch):
    """Rows between those that are kept for fits are compared in a second pass, at the times of the file."""
    monkeypatch.setattr(table_of_file, "ROWS", 10)
    monkeypatch.setattr(formats, "CHUNK", 17)
    build, part, _ = PARTS[name]
    timed = name != "rotor"
    start = first if timed else 0.0  # of the motion; a scene without loads has any time
    (R, w), t = integrate(T, **part), T[start <= T]
    R, w = R[-len(t) :], w[-len(t) :]
    for at in (None, 50):
        rates = w.copy()
        if at is not None:
            rates[at, 0] += 0.01
        path = tmp_path / "run.csv"
        rows = np.column_stack([t if timed else t + first, R.reshape(-1, 9), rates]).tolist()
        header = ",".join(["t", *(f"R_{i}{j}" for i in "123" for j in "123"), "w_x (rad/s)", "w_y (rad/s)", "w_z (rad/s)"])
        path.write_text(header + "\n" + "\n".join(",".join(map(repr, row)) for row in rows))
        recording = table_of_file.read(path, table_of_file.Options())
        assert len(recording.t) < recording.rows == len(t)
        found = verify_recording(build(), recording, True, 1e-6 if first < 1e4 else 1e-4)
        assert (found.verdict == "right") == (at is None)
        if at is not None:
            assert found.details.error[1] == pytest.approx(0.01 / np.linalg.norm(rates, axis=1).max(), rel=0.01)


LONG = ("torque of attitude", "damping of attitude", "field of time", "torque, function with a jump")
"""Parts that are Python functions, which each trial motion calls."""


@pytest.mark.parametrize(
    "name",
    sampled(
        PARTS, 5, keep=("motor", "damping, jumps", "turning field", "torque, world", "torque, table with a jump"), leave=LONG
    ),
)
def test_the_right_motion_is_right_from_any_row_and_without_the_part_it_is_wrong(name, monkeypatch):
    build, part, missing = PARTS[name]
    R, w = integrate(T, **part)
    assert np.max(judged(build(), T, R, w).details.error) < 2e-11  # measured: at most 4e-12
    late = judged(build(), T[50:], R[50:], w[50:])  # a scene that depends on time is integrated from the time of the row
    assert np.max(late.details.error) < 2e-11
    assert np.max(judged(build(), T[50:], R[50:], w[50:], from_row=False).details.error) < 2e-11
    assert all(
        quantity.largest < 1e-10 for quantity in late.details.quantities
    )  # no balance without the work, no energy with a motor
    # The tests below search for everything.
    monkeypatch.setattr(explain, "SEARCHES", {"other equations": explain.SEARCHES["other equations"]})
    found = judged(build(), T, *without_parts())
    assert max(found.details.error) > 0.1
    assert found.details.explaining[0].name == missing
    assert max(found.details.explaining[0].left) < 2e-11


OTHERS = {
    "sign of the rotor": ("rotor", {"h": lambda t: -H}),
    "sign of the torque": ("torque, body", {"torque": lambda t, R, w: -H}),
    "axes of the torque": ("torque, world", {"torque": lambda t, R, w: H}),
    "turning of the field": ("turning field", {"torque": lambda t, R, w: turning(0.0, R, w)}),
}


@pytest.mark.parametrize("name", sampled(OTHERS, 3, leave=["sign of the rotor"]))
def test_the_other_sign_and_the_other_axes_are_named(name):
    part, made = OTHERS[name]
    found = judged(PARTS[part][0](), T, *integrate(T, **made))
    assert (found.details.explaining[0].name, max(found.details.explaining[0].left) < 2e-11) == (name, True)


def test_missing_parts_are_named_together():
    both = scene(H, torque=cv.Torque(0.3 * H), damping=cv.Damping(D))
    part = {"h": lambda t: H}
    assert judged(both, T, *integrate(T, **part)).details.explaining[0].name == "without the torque + without the damping"


@pytest.mark.parametrize("name", sampled(registry.list_scenes(), 4, keep=["separatrix", "asymmetric_top", "stable_satellite"]))
def test_the_right_motion_of_every_scene_is_right(name):
    scene = registry.scene(name).rotation_only
    grid = Grid(min(scene.t_end, 40 / (np.linalg.norm(scene.w_WB_B0) or 1.0)) / 60, 60)
    right = truth.solve(scene, grid)
    # From the start of the scene: separatrices amplify the round-off of the first row to 1 rad.
    found = judged(scene, grid.t, right.R_WB, right.w_WB_B, from_row=False, allowed=1e-8)
    # Measured: 1.3e-11 rad for pendulum_over_top, 4e-12 for others.
    assert (np.max(found.details.error) < 5e-11, found.details.explaining == ()) == (True, True)


TEXTBOOK = ["Heun's method", "semi-implicit Euler with an explicit gyroscopic term"]


@pytest.mark.parametrize("name", sampled(TEXTBOOK, leave=TEXTBOOK[:1]))
def test_a_textbook_method_is_named_in_a_torque_that_depends_on_time(name, monkeypatch):
    monkeypatch.setattr(explain, "SEARCHES", {"integrators": explain.SEARCHES["integrators"]})
    monkeypatch.setattr(explain, "EFFORT", 4 * explain.EFFORT)  # the other parts of the search leave their work to this one
    driven = scene(H, torque=cv.Torque(lambda t: [0.3 * np.sin(t), 0.2 * np.cos(t), 0.1 * t]))
    found = judged(driven, T, *stepped(driven, name, 4)).details.explaining[0]
    assert (found.name, found.values["step"]) == (name, pytest.approx(0.0125))
    assert max(found.left) < 1e-10


@pytest.mark.slow
def test_another_body_is_one_that_can_exist():
    """A wheel whose motor does not act on the body: moments of 3, 6 and 218 kg m^2 would leave a tenth of the error."""
    J, t = (10.0, 8.0, 6.0), np.linspace(0, 60, 301)
    driven = cv.Scene("wheel", cv.RigidBody(J, lambda t: [0, 0, 0.05 * t]), np.eye(3), (0.02, 0.01, 0), 60.0)
    wheel = cv.Scene("wheel", driven.body, np.eye(3), (0.02, 0.01, 0), 60.0, torque=cv.Torque([0, 0, 0.05]))
    found = judged(driven, t, *exact(wheel, t))
    assert max(found.details.error) > 1
    assert found.details.explaining == () or found.details.explaining[0].name != "another body"


@pytest.mark.slow
def test_a_table_with_many_corners_is_judged_without_fits(monkeypatch):
    monkeypatch.setattr(explain, "MOST_BREAKS", 5)  # of 50: each corner divides each trial motion
    monkeypatch.setattr(explain, "EFFORT", 100)  # of 6,000: no mistake explains the second recording
    times = T[::12]
    values = np.random.default_rng(1).normal(size=(11, 3))
    driven = scene(torque=cv.Torque((times, values)))
    R, w = exact(driven, times)
    assert np.max(judged(driven, times, R, w).details.error) < 1e-13  # measured: 5e-15
    found = judged(driven, times, R, w + 0.01 * np.sin(times)[:, None])
    assert not {each.name for each in found.details.tried} & {"damping", "another body", "body axes"}
    assert "10 jumps and corners" in found.notes[-1]
    weaker = judged(driven, times, *exact(scene(torque=cv.Torque((times, 0.1 * values))), times))
    shares = {each.name: each.share for each in weaker.details.tried}
    assert 1e-3 < shares["without the torque"] < 0.5  # measured: 0.23, which is not called missing
    assert weaker.details.explaining == ()


def test_damping_in_addition_to_that_of_the_scene_is_named_as_such():
    damped = scene(H, damping=cv.Damping(D))
    found = judged(damped, T, *without(damped, 0.05, True)).details.explaining[0]
    assert found.values == pytest.approx({"damping": 0.05})
    assert "in addition to the damping of the scene" in found.sentence
    assert remark_on_damping(scene(H)) == ""


@pytest.mark.slow
def test_another_satellite_has_another_field():
    other = scene(potential=satellite()).rename("other", body=cv.RigidBody(1.02 * J), potential=None)
    stretched = cv.RigidBody(J + np.diag([0.05, -0.02, 0.03]))
    across = PLANET - PLANET @ NORMAL / (NORMAL @ NORMAL) * NORMAL
    other = other.rename("other", body=stretched, potential=Orbit(RATE, NORMAL).gravity_gradient(stretched.inertia, across))
    found = judged(scene(potential=satellite()), T, *exact(other)).details.explaining[0]
    assert (found.name, max(found.left) < 1e-8) == ("another body", True)


def test_an_error_below_that_of_the_solution_and_times_outside_of_the_scene_are_refused():
    build, part, _ = PARTS["torque, table with a jump"]
    R, w = integrate(T, **part)
    with pytest.raises(BadInput, match="error: got 1e-17"):
        judged(build(), T, R, w, allowed=1e-17)
    with pytest.raises(BadInput, match="torque: a table from 0 to 6 s"):
        judged(build(), T + 1, R, w)
    with pytest.raises(BadInput, match="run: got a first row at -1 s"):
        judged(build(), T - 1, R, w)
