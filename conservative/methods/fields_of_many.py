"""Parameters of the fields of many bodies, for the named tuples of `conservative.kernels.fields`.

`find_fields` computes for n bodies what `kernel_field` of a potential computes for one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import singledispatch
from typing import Any

import numpy as np

from ..attitude import Array
from ..batch import Batch
from ..deferred_imports import kernels
from ..potentials.gravity_gradient import GravityGradient
from ..potentials.point_to_point import LinearSpring, PointAttraction
from ..potentials.uniform_gravity import UniformGravity

_NONE = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Fields:
    """The field of each body.

    Attributes
    ----------
    like
        An instance of the kernel's field type; its numbers are not used.
    numbers
        Numbers of the fields (n, k), a row for each body; lengths in units of the longest.
    energies
        Columns of `numbers` that are proportional to energy, J.
    axis_W
        Axes of the fields (n, 3), world axes, of any length; 0 for free bodies.
    scale
        Magnitudes (n,) of the potentials, J.
    """

    like: Any
    numbers: Array
    energies: slice
    axis_W: Array
    scale: Array


@singledispatch
def find_fields(potential: Any, bodies: Batch, R_BP: Array) -> Fields | None:
    """Return the fields of n bodies in axes R_BP (n, 3, 3), energies in J; None for other kinds of potentials."""
    return None


@find_fields.register
def _find_none(potential: None, bodies: Batch, R_BP: Array) -> Fields:
    n = len(bodies)
    return Fields(None, np.zeros((n, 0)), slice(0), np.zeros((n, 3)), np.zeros(n))


@find_fields.register
def _find_gravity(potential: UniformGravity, bodies: Batch, R_BP: Array) -> Fields:
    moments = into_axes(read_parameter(bodies, "weight")[:, None] * read_parameter(bodies, "com_B"), R_BP)
    up = np.broadcast_to(potential.axis_W, moments.shape)
    return Fields(kernels("fields").Uniform(*_NONE), moments, slice(3), up, np.linalg.norm(moments, axis=1))


@find_fields.register
def _find_springs(potential: LinearSpring, bodies: Batch, R_BP: Array) -> Fields:
    rest, stiffness = read_parameter(bodies, "rest_length"), read_parameter(bodies, "stiffness")
    b, A = into_axes(read_parameter(bodies, "point_B"), R_BP), read_parameter(bodies, "anchor_W")
    farthest = np.maximum(np.linalg.norm(b, axis=1) + np.linalg.norm(A, axis=1), rest)
    like = kernels("point_fields").Spring(_NONE, _NONE, 0.0, 0.0)
    return Fields(like, np.column_stack([b, A, stiffness, rest]), slice(6, 7), A, stiffness / 2 * farthest**2)


@find_fields.register
def _find_attractions(potential: PointAttraction, bodies: Batch, R_BP: Array) -> Fields:
    b, A = into_axes(read_parameter(bodies, "point_B"), R_BP), read_parameter(bodies, "anchor_W")
    strength = read_parameter(bodies, "strength")
    scale = np.abs(strength) / np.hypot(np.linalg.norm(b, axis=1), np.linalg.norm(A, axis=1))
    like = kernels("point_fields").Attraction(_NONE, _NONE, 0.0)
    return Fields(like, np.column_stack([b, A, strength]), slice(6, 7), A, scale)


@find_fields.register
def _find_gradients(potential: GravityGradient, bodies: Batch, R_BP: Array) -> Fields:
    factor = 3 * read_parameter(bodies, "rate")[:, None, None] ** 2
    rows = factor * (np.swapaxes(R_BP, 1, 2) @ read_parameter(bodies, "inertia") @ R_BP)
    e = read_parameter(bodies, "direction_W")
    like = kernels("gradient_field").Gradient(_NONE, _NONE, _NONE, _NONE)
    return Fields(like, np.column_stack([rows.reshape(-1, 9), e]), slice(9), e, np.linalg.eigvalsh(rows)[:, -1] / 2)


def read_parameter(bodies: Batch, name: str) -> Array:
    """Return the parameter `name` of each body's potential, (n,), (n, 3) or (n, 3, 3), in SI units."""
    if name in bodies.parameters:
        return np.asarray(bodies.parameters[name], dtype=float)
    value = np.asarray(getattr(bodies.scene.potential, name), dtype=float)
    return np.broadcast_to(value, (len(bodies), *value.shape))


def into_axes(v: Array, R_BP: Array) -> Array:
    """Convert vectors (n, 3) from body axes to the axes R_BP (n, 3, 3)."""
    return np.asarray((v[:, None, :] @ R_BP)[:, 0, :])
