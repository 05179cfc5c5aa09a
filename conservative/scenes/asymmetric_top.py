"""The asymmetric heavy top of Hairer, Lubich & Wanner, Geometric Numerical Integration, VII.5: not integrable, no closed form.

J = (0.5, 0.85, 1), weight and lever arm 1, q0 = (0.4, 0.2, 0.4, 0.8) scalar first, L0 = (0.2, 1, 0.4).
"""

from __future__ import annotations

import numpy as np

from ..attitude import from_quaternion
from ..body import RigidBody
from ..potentials.uniform_gravity import UniformGravity
from ..scene import Scene

DEFAULT_INERTIA = (0.5, 0.85, 1.0)
DEFAULT_ATTITUDE = (0.4, 0.2, 0.4, 0.8)
DEFAULT_MOMENTUM = (0.2, 1.0, 0.4)
DEFAULT_T_END = 30.0
DEFAULT_DT = 0.05


def asymmetric_top(t_end: float = DEFAULT_T_END) -> Scene:
    """Return the top of Hairer, Lubich & Wanner.

    Raises
    ------
    BadInput
        t_end, s, is not a finite number above 0.
    """
    return Scene(
        "asymmetric_top",
        RigidBody(DEFAULT_INERTIA),
        from_quaternion(DEFAULT_ATTITUDE),
        np.divide(DEFAULT_MOMENTUM, DEFAULT_INERTIA),
        t_end,
        UniformGravity(1.0, (0, 0, 1)),
        dt=DEFAULT_DT,
        group="top",
        source="Hairer, Lubich & Wanner, VII.5",
    )
