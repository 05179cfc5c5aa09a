"""Directions that potentials are given: vectors of any length, made unit vectors. Source: definitions."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import Array
from ..check import finite_array, read_only
from ..errors import BadInput

_UNIT = 4 * np.finfo(float).eps
"""A direction whose length is 1 to this stays as it is, so that dividing by the length once more changes nothing."""
_ALLOWED = "three finite numbers (3,), not all 0"


def unit_vector(argument: str, value: ArrayLike) -> Array:
    """Return the unit vector (3,) along a vector (3,) of any length but 0, dimensionless.

    Raises
    ------
    BadInput
        It is not finite, of another shape, or 0.
    """
    direction = finite_array(argument, value, ((3,),), _ALLOWED)
    size = float(np.linalg.norm(direction))
    if size == 0:
        raise BadInput(argument, direction.tolist(), _ALLOWED)
    return read_only(direction / size) if abs(size - 1) > _UNIT else direction
