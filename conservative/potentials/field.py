"""Potentials whose law is a field: a named tuple of numbers with functions in `conservative.arithmetic`.

The same functions serve Python, batches of bodies and compiled kernels. `UniformField` is the simplest example. With u the
direction of the field's axis in the axes of the kernel (principal axes), g a direction of length one up to the error of a step,
and quaternions q of any length, a field has the functions

    energy(q)                    V, J
    body_torque(q)               torque, N m
    finite_torque(q, a)          torque of a step and its derivative by a (`kernels.fields`)
    finite_derivative(q0, q1)    (c, d), with the finite derivative V* = c d' of base vectors q0, q1 (three columns each)
    finite_slope(q0, q1)         (D, B), with dV*[j] / dq1[k] = D[j][k] B, for base vectors j and k
    find_constants(J_inverse)    arguments of the next two: all that depends on field and body only
    slope(constants, g)          V and dV/dg, J
    series(constants, g, series) a function that returns coefficient n of J^-1 T (`kernels.compiler.series`)

and for arrays, where numbers are (...) and vectors (..., 3)

    energies(R_WB)               V (...), J
    scale()                      size of the field (...), J
    axis_W()                     vectors (..., 3) along the axis of symmetry; 0 without one
    in_units(energy)             the field with energies in units of `energy` (...), J
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from ..arithmetic import times
from ..attitude import Array
from ..features import Feature, Features
from .varied import Varied


class FieldPotential(ABC):
    """Base of potentials that are defined by numbers. A subclass names them and builds its field from them."""

    NUMBERS: ClassVar[tuple[str, ...]]
    """Names of the attributes that `build_field` takes."""
    features: ClassVar[Features] = frozenset({Feature.FIELD})
    """Members of `Feature` for scenes with it."""

    @staticmethod
    @abstractmethod
    def build_field(R_BP: Array | None, *numbers: Any) -> Any:
        """Return the field in axes P, with R_BP (..., 3, 3) from P to body axes; None: in body axes.

        Numbers, in SI units, and the numbers of the field are arrays with any leading axes.
        """

    def fields(self, parameters: Mapping[str, Array], R_BP: Array) -> Any:
        """Return the field of n bodies in axes R_BP (n, 3, 3), with numbers (n, ...) of `parameters` in place of its own."""
        return self.build_field(R_BP, *self._fill(parameters, len(R_BP)))

    def vary(self, parameters: Mapping[str, Array]) -> Varied:
        """Return the energies and sizes of n bodies, with numbers (n, ...) of `parameters` in place of its own."""
        numbers = self._fill(parameters, len(next(iter(parameters.values()))))
        return Varied(self.build_field(None, *(number[:, None] for number in numbers)))

    def _fill(self, parameters: Mapping[str, Array], n: int) -> list[Array]:
        own = ((name, np.asarray(getattr(self, name), dtype=float)) for name in self.NUMBERS)
        values = (parameters.get(name, np.broadcast_to(value, (n, *value.shape))) for name, value in own)
        return [np.asarray(value, dtype=float) for value in values]

    def _field(self, R_BP: Array | None = None) -> Any:
        return self.build_field(R_BP, *(getattr(self, name) for name in self.NUMBERS))

    def kernel_field(self, R_BP: Array) -> Any:
        """Return the field for kernels, in principal axes: tuples of floats."""
        return to_tuples(self._field(R_BP))

    def energy(self, R_WB: Array) -> Array:
        """Return V, (...), in J at attitudes (..., 3, 3)."""
        return np.asarray(self._field().energies(R_WB))[()]

    def gradient(self, R_WB: Array) -> Array:
        """Return dV/dR, (..., 3, 3), in J at matrices (..., 3, 3)."""
        return self.finite_derivative(R_WB, R_WB)

    def finite_derivative(self, R_0: Array, R_1: Array) -> Array:
        """Return V*, (..., 3, 3), in J, exact for attitudes (..., 3, 3) at any distance."""
        columns = [[[R[..., i, j] for i in range(3)] for j in range(3)] for R in (np.asarray(R_0), np.asarray(R_1))]
        c, d = self.kernel_field(np.eye(3)).finite_derivative(*columns)
        V_star = np.empty(np.shape(R_0))
        for i in range(3):
            for j in range(3):
                V_star[..., i, j] = c[i] * d[j]
        return V_star

    def scale(self) -> float:
        """Return the size of the field, J."""
        return float(self._field().scale())

    @property
    def axis_W(self) -> Array | None:
        """Return the unit vector (3,) of the field's axis of symmetry, world axes; None without one."""
        axis = self._field().axis_W()
        size = np.linalg.norm(axis)
        return axis / size if size > 0 else None


def to_tuples(value: Any) -> Any:
    """Return numbers and arrays, or named tuples of them, as the tuples of floats that kernels accept."""
    if isinstance(value, tuple):
        return type(value)(*map(to_tuples, value))
    nested = np.asarray(value).tolist()
    return tuple(tuple(x) if isinstance(x, list) else x for x in nested) if isinstance(nested, list) else nested


def into_axes(v: Array, R_BP: Array | None) -> Array:
    """Return vectors (..., 3), body axes, in axes P with R_BP (..., 3, 3) from P to body axes; None: body axes."""
    return v if R_BP is None else np.asarray((v[..., None, :] @ R_BP)[..., 0, :])


def lengths(v: Array) -> Any:
    """Return |v|, (...), of vectors (..., 3); squares neither vanish nor overflow."""
    return np.hypot(np.hypot(v[..., 0], v[..., 1]), v[..., 2])


def turned_moment(J_inverse: Any, m: Any) -> Any:
    """Return J^-1 (m2, m3, m1) and J^-1 (m3, m1, m2)."""
    return times(J_inverse, (m[1], m[2], m[0])), times(J_inverse, (m[2], m[0], m[1]))
