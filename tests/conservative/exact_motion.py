"""Motions of scenes by SciPy's DOP853 from the textbook's equations, as truth for runs of a few steps."""

import numpy as np
from scipy.integrate import solve_ivp

import conservative as cv
from conservative.attitude import rotation_about

TURN = rotation_about((3, -1, 2), 1.3)
BODY = cv.RigidBody(TURN @ np.diag([1.0, 1.4, 2.0]) @ TURN.T)
START = rotation_about((1, 0.2, -1), 0.7)
HOOK = (0.2, 0.1, 0.4)
FIELDS = {
    "gravity": cv.UniformGravity(2.0, HOOK),
    "spring": cv.LinearSpring(3.0, HOOK, (0.5, 0.2, 0.3), 0.1),
    "attraction": cv.PointAttraction(2.0, HOOK, (1.5, -0.4, 0.3)),
    "gradient": cv.GravityGradient(0.7, BODY.inertia, (1, 0.5, 1)),
    "function": cv.FunctionPotential(
        lambda R: (R[2] @ HOOK) ** 4, lambda R: np.outer([0, 0, 1], 4 * (R[2] @ np.array(HOOK)) ** 3 * np.array(HOOK))
    ),
}


def in_field(name, body=BODY, w=(0.3, -2.0, 1.0)):
    return cv.Scene(name, body, START, w, 1.0, FIELDS[name])


def free(moments, w, turn=TURN):
    return cv.Scene(f"{moments}, {w}", cv.RigidBody(turn @ np.diag(moments) @ turn.T), START, turn @ np.array(w), 1.0)


def top(moments=(1.0, 1.0, 0.3), w=(0.4, -0.7, 9.0), weight=5.0, turn=TURN):
    body = cv.RigidBody(turn @ np.diag(moments) @ turn.T)
    return cv.Scene(
        f"top {moments}, {w}, {weight}, {turn[0, 0]:.2f}",
        body,
        START,
        turn @ np.array(w),
        1.0,
        cv.UniformGravity(weight, turn[:, 2]),
    )


def hat(w):
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def torque(scene, R):
    """Torque in body axes of the potential of a scene, N m: minus the derivative along turns about each axis."""
    if scene.potential is None:
        return np.zeros(3)
    across = R.T @ np.asarray(scene.potential.gradient(R))
    return -np.array([across[2, 1] - across[1, 2], across[0, 2] - across[2, 0], across[1, 0] - across[0, 1]])


def move(scene, t):
    """Attitudes (n, 3, 3) and rates (n, 3), rad/s, at the times t (n,), s."""
    J = scene.body.inertia
    inverse = np.linalg.inv(J)

    def rates(_, y):
        R, w = y[:9].reshape(3, 3), y[9:]
        return np.concatenate([(R @ hat(w)).ravel(), inverse @ (torque(scene, R) - np.cross(w, J @ w))])

    start = np.concatenate([scene.R_WB0.ravel(), scene.w_WB_B0])
    y = solve_ivp(rates, (0, t[-1]), start, method="DOP853", rtol=1e-13, atol=1e-14, t_eval=t).y.T
    return y[:, :9].reshape(-1, 3, 3), y[:, 9:]


def drift(trajectory):
    """The largest drift of any invariant of the scene, relative to its scale."""
    return max(float(np.abs(trajectory.drift(invariant)).max()) for invariant in trajectory.scene.invariants)


MOVES = {}


def distance(scene, method, dt, n):
    """Return how far a run is from the truth after each of n steps: of the attitude, and relative of the rates."""
    run = method.prepare(scene, cv.Grid(dt, n, 1))()
    key = (scene.name, dt, n)
    if key not in MOVES:
        MOVES[key] = move(scene, run.t)
    R, w = MOVES[key]
    return max(abs(run.R_WB - R).max(), abs(run.w_WB_B - w).max() / max(abs(w).max(), 1.0))
