"""The free body that Hairer & Vilmart (2006) tried their preprocessed discrete Moser-Veselov method on.

J = (0.6, 0.8, 1), L0 = (1.8, 0.4, -0.9).
"""

from __future__ import annotations

import numpy as np

from ..body import RigidBody
from ..scene import Scene

DEFAULT_INERTIA = (0.6, 0.8, 1.0)
DEFAULT_MOMENTUM = (1.8, 0.4, -0.9)
DEFAULT_T_END = 10.0
DEFAULT_DT = 0.02


def hairer_vilmart(t_end: float = DEFAULT_T_END) -> Scene:
    """Return the body of Hairer & Vilmart.

    Raises
    ------
    BadInput
        t_end, s, is not a finite number above 0.
    """
    return Scene(
        "hairer_vilmart",
        RigidBody(DEFAULT_INERTIA),
        np.eye(3),
        np.divide(DEFAULT_MOMENTUM, DEFAULT_INERTIA),
        t_end,
        dt=DEFAULT_DT,
        group="free body",
        source="Hairer & Vilmart 2006",
    )
