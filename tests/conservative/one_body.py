"""Bodies and scenes that many tests use, the torque of a potential, and the largest drift of a run."""

import numpy as np

import conservative as cv
from conservative.attitude import rotation_about

TURN = rotation_about((3, -1, 2), 1.3)


def body_in_axes(turn, *moments):
    """Return a body with principal moments, kg m^2, about the columns of a matrix: its tensor is full."""
    return cv.RigidBody(turn @ np.diag(moments) @ turn.T)


BODY = body_in_axes(TURN, 1.0, 1.4, 2.0)
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
    return cv.Scene(f"{moments}, {w}", body_in_axes(turn, *moments), START, turn @ np.array(w), 1.0)


def top(moments=(1.0, 1.0, 0.3), w=(0.4, -0.7, 9.0), weight=5.0, turn=TURN):
    field = cv.UniformGravity(weight, turn[:, 2])
    name = f"top {moments}, {w}, {weight}, {turn[0, 0]:.2f}"
    return cv.Scene(name, body_in_axes(turn, *moments), START, turn @ np.array(w), 1.0, field)


def torque(scene, R):
    """Return the torque of a potential in body axes, N m: minus the derivative of the energy for turns about each axis."""
    if scene.potential is None:
        return np.zeros(3)
    across = R.T @ np.asarray(scene.potential.gradient(R))
    return -np.array([across[2, 1] - across[1, 2], across[0, 2] - across[2, 0], across[1, 0] - across[0, 1]])


def drift(trajectory):
    """Return the largest drift of any invariant, relative to its scale."""
    return max(float(np.abs(trajectory.drift(invariant)).max()) for invariant in trajectory.scene.invariants)
