"""An asymmetric body in fields that are not linear in the base vectors: a spring, an attraction by 1/r, gravity's gradient.

All three are symmetric about one world axis, so that energy and the momentum along it are conserved. The inertia has
off-diagonal terms and no point lies on a coordinate axis.
"""

from __future__ import annotations

import math

import numpy as np

from ..attitude import rotation_about
from ..body import RigidBody
from ..potentials.gravity_gradient import GravityGradient
from ..potentials.point_to_point import LinearSpring, PointAttraction
from ..potentials.potential import Potential
from ..scene import Scene

DEFAULT_INERTIA = ((1.2, -0.1, 0.05), (-0.1, 0.9, 0.15), (0.05, 0.15, 0.7))
DEFAULT_START = rotation_about((1.0, -2.0, 0.5), 0.9)
DEFAULT_RATES = (0.5, 1.1, -0.8)
DEFAULT_POINT = (0.3, -0.2, 0.4)
DEFAULT_ANCHOR = (0.4, 0.5, -0.6)
DEFAULT_STIFFNESS = 8.0
DEFAULT_REST_LENGTH = 0.3
DEFAULT_STRENGTH = 1.5
DEFAULT_RATE = 1.7 / math.sqrt(3)
DEFAULT_CENTRE = (0.2, -0.3, -1.0)
DEFAULT_T_END = 10.0
DEFAULT_DT = 0.02
SOURCE = "ours"


def sprung_body(
    stiffness: float = DEFAULT_STIFFNESS, rest_length: float = DEFAULT_REST_LENGTH, t_end: float = DEFAULT_T_END
) -> Scene:
    """Return the body held by a spring of that stiffness, N/m, and rest length, m.

    Raises
    ------
    BadInput
        stiffness is not above 0, rest_length is below 0, or t_end, s, is not above 0.
    """
    return _in_field("sprung_body", LinearSpring(stiffness, DEFAULT_POINT, DEFAULT_ANCHOR, rest_length), t_end)


def attracted_body(strength: float = DEFAULT_STRENGTH, t_end: float = DEFAULT_T_END) -> Scene:
    """Return the body with one point attracted to a world point: V = -strength / distance, J m.

    Raises
    ------
    BadInput
        strength is 0 or not finite, or t_end, s, is not above 0.
    """
    return _in_field("attracted_body", PointAttraction(strength, DEFAULT_POINT, DEFAULT_ANCHOR), t_end)


def gravity_gradient_body(rate: float = DEFAULT_RATE, t_end: float = DEFAULT_T_END) -> Scene:
    """Return the body librating in the gradient of a far centre's gravity, rate = sqrt(G M / r^3), rad/s.

    Raises
    ------
    BadInput
        rate is not above 0, or t_end, s, is not above 0.
    """
    return _in_field("gravity_gradient_body", GravityGradient(rate, DEFAULT_INERTIA, DEFAULT_CENTRE), t_end)


def _in_field(name: str, field: Potential, t_end: float) -> Scene:
    body = RigidBody(np.array(DEFAULT_INERTIA))
    return Scene(name, body, DEFAULT_START, DEFAULT_RATES, t_end, field, dt=DEFAULT_DT, group="other field", source=SOURCE)
