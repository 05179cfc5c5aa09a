"""An asymmetric body in fields that are not linear in the base vectors.

All are symmetric about one world axis, so energy and the momentum about that axis are conserved. The inertia has off-diagonal
terms, and no point lies on a coordinate axis. Builders raise `BadInput` for arguments that are not finite or out of range.
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

_INERTIA = ((1.2, -0.1, 0.05), (-0.1, 0.9, 0.15), (0.05, 0.15, 0.7))
_POINT_B, _ANCHOR_W = (0.3, -0.2, 0.4), (0.4, 0.5, -0.6)


def sprung_body(stiffness: float = 8.0, rest_length: float = 0.3, t_end: float = 10.0) -> Scene:
    """Return a body held by a spring: stiffness in N/m, rest length in m, duration in s."""
    return _in_field("sprung_body", LinearSpring(stiffness, _POINT_B, _ANCHOR_W, rest_length), t_end)


def attracted_body(strength: float = 1.5, t_end: float = 10.0) -> Scene:
    """Return a body with one point attracted to a world point, V = -strength / distance: strength in J m, duration in s."""
    return _in_field("attracted_body", PointAttraction(strength, _POINT_B, _ANCHOR_W), t_end)


def gravity_gradient_body(rate: float = 1.7 / math.sqrt(3), t_end: float = 10.0) -> Scene:
    """Return a body in the gravity gradient of a distant centre: rate = sqrt(G M / r^3) in rad/s, duration in s."""
    return _in_field("gravity_gradient_body", GravityGradient(rate, _INERTIA, (0.2, -0.3, -1.0)), t_end)


def _in_field(name: str, field: Potential, t_end: float) -> Scene:
    body, R_WB0 = RigidBody(np.array(_INERTIA)), rotation_about((1.0, -2.0, 0.5), 0.9)
    return Scene(name, body, R_WB0, (0.5, 1.1, -0.8), t_end, field, dt=0.02, group="other field", source="ours")
