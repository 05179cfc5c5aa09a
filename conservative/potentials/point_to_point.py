"""Potentials between a point of the body and a point of the world: a spring, and an attraction by 1/r.

V = F(s) with s = |R b - A|^2, b in body and A in world axes. s is quadratic in the base vectors, so that

    V* = (F(s1) - F(s0)) / (s1 - s0) 2 (Rbar b - A) b'        Rbar the mean of both attitudes

is an exact finite derivative once the divided difference is written without cancellation. Source: our own, in the sense of the
paper's (21).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import Array, Triple, triple
from ..check import build_unchecked, finite_array, finite_number, positive_number, set_fields
from ..errors import BadInput
from .varied import VariedPoints, fill, lengths

_POINT = "three finite numbers (3,), m"
_LENGTH = "a finite length of 0 or more, m"
_STRENGTH = "a finite number other than 0, J m"


class PointPotential(ABC):
    """What both kinds share: everything that follows from their points, `energy_of` and `slope`.

    Attributes
    ----------
    point_B
        Point of the body (3,), m, body axes, from the fixed point.
    anchor_W
        Point of the world (3,), m, world axes, from the fixed point.
    """

    point_B: Array
    anchor_W: Array

    @abstractmethod
    def energy_of(self, distance: Array) -> Array:
        """Return V, (...), in J at distances (...) in m."""

    @abstractmethod
    def slope(self, distance_0: Array, distance_1: Array) -> Array:
        """Return the divided difference of V by the squared distance, (...), N/m, between distances (...), m."""

    def _from_anchor(self, R_WB: Array) -> Array:
        # One product of a tall matrix: NumPy takes ten times as long over a stack of small ones.
        return (R_WB.reshape(-1, 3) @ self.point_B).reshape(R_WB.shape[:-1]) - self.anchor_W

    def distance(self, R_WB: Array) -> Array:
        """Return how far apart the points are, (...), m, at attitudes (..., 3, 3)."""
        return np.linalg.norm(self._from_anchor(R_WB), axis=-1)

    def energy(self, R_WB: Array) -> Array:
        """Return V, (...), in J, at attitudes (..., 3, 3)."""
        return self.energy_of(self.distance(R_WB))

    def gradient(self, R_WB: Array) -> Array:
        """Return dV/dR, (..., 3, 3), in J, at matrices (..., 3, 3)."""
        return self.finite_derivative(R_WB, R_WB)

    def finite_derivative(self, R_0: Array, R_1: Array) -> Array:
        """Return V*, (..., 3, 3), in J: exact for attitudes (..., 3, 3) at any distance."""
        slope = self.slope(self.distance(R_0), self.distance(R_1))
        mean = self._from_anchor((R_0 + R_1) / 2)
        return 2 * slope[..., None, None] * mean[..., :, None] * self.point_B

    @property
    def axis_W(self) -> Array | None:
        """Return the direction (3,) of the world point; None where it is the pivot, and the field does nothing."""
        size = np.linalg.norm(self.anchor_W)
        return self.anchor_W / size if size > 0 else None

    def _points(self, R_BP: Array) -> tuple[Triple, Triple]:
        return triple(self.point_B @ R_BP), triple(self.anchor_W)


@dataclass(frozen=True, eq=False, init=False)
class LinearSpring(PointPotential):
    """A spring between a body point and a world point: V = stiffness/2 (distance - rest_length)^2.

    Parameters
    ----------
    stiffness
        N/m, above 0.
    point_B
        Attachment point on the body (3,), m, body axes, from the fixed point.
    anchor_W
        Attachment point in the world (3,), m, world axes, from the fixed point.
    rest_length
        m, 0 or more. With 0 the potential is quadratic in the base vectors.

    Raises
    ------
    BadInput
        A parameter is not finite, out of range, or has the wrong shape.
    """

    stiffness: float
    point_B: Array
    anchor_W: Array
    rest_length: float

    def __init__(self, stiffness: float, point_B: ArrayLike, anchor_W: ArrayLike, rest_length: float = 0.0) -> None:
        set_fields(
            self,
            stiffness=positive_number("stiffness", stiffness, "a finite number above 0, N/m"),
            point_B=finite_array("point_B", point_B, ((3,),), _POINT),
            anchor_W=finite_array("anchor_W", anchor_W, ((3,),), _POINT),
            rest_length=finite_number("rest_length", rest_length, _LENGTH),
        )
        if self.rest_length < 0:
            raise BadInput("rest_length", rest_length, _LENGTH)

    def energy_of(self, distance: Array) -> Array:
        """Return V, (...), in J at distances (...) in m."""
        return self.stiffness / 2 * (distance - self.rest_length) ** 2

    def slope(self, distance_0: Array, distance_1: Array) -> Array:
        """Return the divided difference of V by the squared distance, (...), N/m."""
        if self.rest_length == 0:
            return np.full(np.shape(distance_0), self.stiffness / 2)
        return self.stiffness / 2 * (1 - 2 * self.rest_length / (distance_0 + distance_1))

    def scale(self) -> float:
        """Return the largest V there can be, J: at the largest distance, or at none if that is farther from rest."""
        farthest = float(np.linalg.norm(self.point_B) + np.linalg.norm(self.anchor_W))
        return self.stiffness / 2 * max(farthest, self.rest_length) ** 2

    def vary(self, parameters: Mapping[str, Array]) -> VariedPoints:
        """Return the fields of n bodies with these numbers (n, ...), N/m and m, in place of its own."""
        stiffness, point_B, anchor_W, rest = fill(self, parameters, "stiffness", "point_B", "anchor_W", "rest_length")
        farthest = np.maximum(lengths(point_B) + lengths(anchor_W), rest)

        def energy_of(distances: Array) -> Array:
            return stiffness[:, None] / 2 * (distances - rest[:, None]) ** 2

        return VariedPoints(point_B, anchor_W, energy_of, stiffness / 2 * farthest**2)

    @staticmethod
    def suspects(parameters: Mapping[str, Array]) -> Any:
        """Return which of n bodies' numbers (n, ...), N/m and m, might not be taken as they are."""
        return (parameters.get("stiffness", np.ones(1)) <= 0) | (parameters.get("rest_length", np.ones(1)) < 0)

    def in_units(self, energy: float) -> LinearSpring:
        """Return the field with energies in units of `energy`, a power of two, J."""
        points = {"point_B": self.point_B, "anchor_W": self.anchor_W}
        return build_unchecked(LinearSpring, stiffness=self.stiffness / energy, rest_length=self.rest_length, **points)

    def kernel_field(self, R_BP: Array) -> Any:
        """Return points, stiffness and rest length as the kernels want them."""
        from ..kernels.point_fields import Spring

        return Spring(*self._points(R_BP), self.stiffness, self.rest_length)


@dataclass(frozen=True, eq=False, init=False)
class PointAttraction(PointPotential):
    """Gravitational or electrostatic attraction of a body point to a world point: V = -strength / distance.

    Parameters
    ----------
    strength
        G m M of two masses, or -q Q / (4 pi epsilon0) of two charges, J m; negative for repulsion, not 0.
    point_B
        Body point (3,), m, body axes, from the fixed point.
    anchor_W
        World point (3,), m, world axes, from the fixed point.

    Raises
    ------
    BadInput
        A parameter is not finite, 0, or has the wrong shape; or both points are the fixed point.
    """

    strength: float
    point_B: Array
    anchor_W: Array

    def __init__(self, strength: float, point_B: ArrayLike, anchor_W: ArrayLike) -> None:
        set_fields(
            self,
            strength=finite_number("strength", strength, _STRENGTH),
            point_B=finite_array("point_B", point_B, ((3,),), _POINT),
            anchor_W=finite_array("anchor_W", anchor_W, ((3,),), _POINT),
        )
        if self.strength == 0:
            raise BadInput("strength", strength, _STRENGTH)
        if not np.any(self.point_B) and not np.any(self.anchor_W):
            raise BadInput("anchor_W", "the fixed point, as point_B is", "a point that the body's does not always lie on")

    def energy_of(self, distance: Array) -> Array:
        """Return V, (...), in J at distances (...) in m."""
        return -self.strength / distance

    def slope(self, distance_0: Array, distance_1: Array) -> Array:
        """Return the divided difference of V by the squared distance, (...), N/m."""
        return self.strength / ((distance_0 + distance_1) * distance_0 * distance_1)

    def scale(self) -> float:
        """Return the size of V where the points' directions from the pivot are at right angles, J."""
        return abs(self.strength) / float(np.hypot(np.linalg.norm(self.point_B), np.linalg.norm(self.anchor_W)))

    def vary(self, parameters: Mapping[str, Array]) -> VariedPoints:
        """Return the fields of n bodies with these numbers (n, ...), J m and m, in place of its own."""
        strengths, point_B, anchor_W = fill(self, parameters, "strength", "point_B", "anchor_W")
        sizes = np.abs(strengths) / np.hypot(lengths(point_B), lengths(anchor_W))
        return VariedPoints(point_B, anchor_W, lambda distances: -strengths[:, None] / distances, sizes)

    @staticmethod
    def suspects(parameters: Mapping[str, Array]) -> Any:
        """Return which of n bodies' numbers (n, ...), J m and m, might not be taken as they are."""
        zero = [~parameters[name].any(axis=1) for name in ("point_B", "anchor_W") if name in parameters]
        return np.logical_or.reduce([parameters.get("strength", np.ones(1)) == 0, *zero])

    def in_units(self, energy: float) -> PointAttraction:
        """Return the field with energies in units of `energy`, a power of two, J."""
        strength = self.strength / energy
        return build_unchecked(PointAttraction, strength=strength, point_B=self.point_B, anchor_W=self.anchor_W)

    def kernel_field(self, R_BP: Array) -> Any:
        """Return points and strength as the kernels want them."""
        from ..kernels.point_fields import Attraction

        return Attraction(*self._points(R_BP), self.strength)
