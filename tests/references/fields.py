"""Bodies in every kind of field, where no wrong convention can hide: axes are turned, inertias not diagonal, sizes not 1."""

import numpy as np

import conservative as cv
from conservative.attitude import rotation_about

TURN = rotation_about((1, -2, 0.5), 1.1)
R_WB0 = rotation_about((0.3, -0.5, 0.8), 0.7)
INERTIA = TURN @ np.diag((0.9, 1.7, 1.2)) @ TURN.T
OTHER = rotation_about((-1, 0.3, 0.7), 0.6)
POINT, ANCHOR, CENTRE = (0.3, -0.2, 0.4), (1.0, 0.5, 2.0), (0.2, -0.3, -1.0)


def make_fields(strength=1.0):
    """Return fields by name, with energies so many times as large."""
    rate = 1.7 * strength**0.5
    return {
        "gravity": cv.UniformGravity(3.1 * strength, POINT),
        "spring": cv.LinearSpring(3.0 * strength, POINT, ANCHOR, 0.4),
        "spring of no length": cv.LinearSpring(3.0 * strength, POINT, ANCHOR),
        "spring on an axis": cv.LinearSpring(3.0 * strength, TURN[:, 0] * 0.5, ANCHOR, 0.4),
        "spring at the pivot": cv.LinearSpring(3.0 * strength, POINT, (0, 0, 0), 0.4),
        "attraction": cv.PointAttraction(2.3 * strength, POINT, ANCHOR),
        "repulsion of the pivot": cv.PointAttraction(-2.3 * strength, (0, 0, 0), ANCHOR),
        "gradient": cv.GravityGradient(rate, INERTIA, CENTRE),
        "gradient on another inertia": cv.GravityGradient(rate, OTHER @ np.diag((0.7, 1.1, 1.3)) @ OTHER.T, CENTRE),
    }


FIELDS = make_fields()


def scene_in(field, name="in a field"):
    """Return the body in a field."""
    return cv.Scene(name, cv.RigidBody(INERTIA), R_WB0, (1.2, -2, 0.7), 1.0, field)
