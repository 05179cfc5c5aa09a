"""Many bodies for tests: random starts, inertia that is not diagonal, and fields with numbers of their own."""

from __future__ import annotations

import numpy as np

import conservative as cv
from conservative.attitude import from_quaternion, rotation_about

TURN = rotation_about((3, -1, 2), 1.3)
BODY = cv.RigidBody(TURN @ np.diag([1.0, 1.4, 2.0]) @ TURN.T)


def starts(n, seed=14):
    """Attitudes (n, 3, 3) and rates (n, 3), rad/s."""
    rng = np.random.default_rng(seed)
    q = rng.normal(size=(n, 4))
    return from_quaternion(q / np.linalg.norm(q, axis=1)[:, None]), rng.normal(size=(n, 3))


def tensors(n, seed=14):
    """Inertia (n, 3, 3), kg m^2, with moments that are well apart."""
    rng = np.random.default_rng(seed)
    axes = from_quaternion(rng.normal(size=(n, 4)))
    axes /= np.cbrt(np.linalg.det(axes))[:, None, None]
    moments = np.array([1.0, 1.4, 2.0]) * rng.uniform(0.9, 1.1, (n, 3))
    found = axes @ (moments[:, :, None] * np.swapaxes(axes, 1, 2))
    return (found + np.swapaxes(found, 1, 2)) / 2


def scene(potential=None, body=BODY, **more):
    """A scene of 2 s."""
    return cv.Scene("generic", body, rotation_about((1, 0.2, -1), 0.7), (0.3, -2.0, 1.0), 2.0, potential, **more)


def fields(n, seed=14):
    """Potentials by a name, and numbers of them that differ from body to body."""
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
