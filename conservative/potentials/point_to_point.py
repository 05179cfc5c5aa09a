"""Potentials between a point of the body and a point of the world: a spring, and an attraction by 1/r.

V = F(s) with s = |R b - A|^2, b in body and A in world axes. s is quadratic in the base vectors, so that

    V* = (F(s1) - F(s0)) / (s1 - s0) 2 (Rbar b - A) b'        Rbar the mean of both attitudes

is an exact finite derivative once the divided difference is written without cancellation, in the sense of the paper's (21). The
torque is like uniform gravity's, with A for the vertical and 2 F' b for the moment.
"""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..arithmetic import choose, cross, divide, dot, fuse, halfway, in_body, in_long_body, root, scale, subtract, swing
from ..attitude import Array
from ..check import finite_array, finite_number, positive_number, replace_unchecked, set_fields
from ..errors import BadInput
from ..features import Feature, Features
from .field import FieldPotential, into_axes, lengths, turned_moment

_POINT = "three finite numbers (3,), m"
_LENGTH = "a finite length of 0 or more, m"
_STRENGTH = "a finite number other than 0, J m"


class PointField:
    """The law of both fields (`conservative.potentials.field`): V = F(s), J, of a point b of the body and A of the world."""

    b: Any
    A: Any
    value: Any
    derivative: Any
    divided: Any
    torque_factor: Any
    start_power: Any

    def energy(self, q: Any) -> Any:
        """Return V in J."""
        x = subtract(self.b, in_body(q, self.A))
        return self.value(dot(x, x))

    def body_torque(self, q: Any) -> Any:
        """Return the torque in N m."""
        A = in_body(q, self.A)
        x = subtract(self.b, A)
        return scale(2.0 * self.derivative(dot(x, x)), cross(self.b, A))

    def finite_torque(self, q: Any, a: Any) -> Any:
        """Return T = -2 slope A x m, m = M b, and its derivative: the slope changes with s1, and ds1 = 4 x1.dm."""
        n, r = in_long_body(q, self.A)
        A = scale(n, r)
        m, dm = halfway(a, self.b)
        s, v = swing(a, self.b)
        # Sums of the constant b with rounded numbers would always lose the same digits of b: an error whose mean is not 0.
        x0 = tuple(fuse(-n, y, x) for x, y in zip(self.b, r, strict=True))
        x1 = tuple(fuse(2.0 * s, y, x) for x, y in zip(x0, v, strict=True))
        slope, change = self.divided(dot(x0, x0), dot(x1, x1))
        Am, f = cross(A, m), -2.0 * slope

        def change_along(column: Any) -> Any:
            d, e = cross(A, column), -8.0 * change * dot(x1, column)
            return tuple(fuse(f, x, e * y) for x, y in zip(d, Am, strict=True))

        return scale(f, Am), tuple(map(change_along, dm))

    def _find_ends(self, q0: Any, q1: Any) -> Any:
        """Return R b - A at both attitudes, in world axes."""
        return tuple(tuple(dot(self.b, (q[0][i], q[1][i], q[2][i])) - self.A[i] for i in range(3)) for q in (q0, q1))

    def finite_derivative(self, q0: Any, q1: Any) -> Any:
        """Return 2 slope (Rbar b - A) and b."""
        x0, x1 = self._find_ends(q0, q1)
        slope = self.divided(dot(x0, x0), dot(x1, x1))[0]
        return tuple(slope * (x + y) for x, y in zip(x0, x1, strict=True)), self.b

    def finite_slope(self, q0: Any, q1: Any) -> Any:
        """Return b b' and the derivative of 2 slope (Rbar b - A) by R1 b."""
        x0, x1 = self._find_ends(q0, q1)
        slope, change = self.divided(dot(x0, x0), dot(x1, x1))
        rows = [[2.0 * change * (x0[i] + x1[i]) * x1[k] + (slope if i == k else 0.0) for k in range(3)] for i in range(3)]
        return tuple(scale(x, self.b) for x in self.b), tuple(map(tuple, rows))

    def find_constants(self, J_inverse: Any) -> Any:
        """Return the distance |A|, and its product with b and a factor of the torque, turned as for `turned_moment`."""
        A = root(dot(self.A, self.A))
        return A, *turned_moment(J_inverse, scale(-self.torque_factor() * A, self.b))

    def slope(self, constants: Any, g: Any) -> Any:
        """Return V and dV/dg in J."""
        x = subtract(scale(constants[0], g), self.b)
        s = dot(x, x)
        return self.value(s), scale(2.0 * self.derivative(s) * constants[0], x)

    def series(self, constants: Any, g: Any, series: Any) -> Any:
        """Return the recurrence of J^-1 T of T = (base + y) g x m, where y is a multiple of s^alpha.

        The squared distance s is linear in g. S holds S2, S3, S1 of s/s[0] = 1 + S.(g - g[0]). With s[k] in units of
        s[0], s y' = alpha s' y gives

            y[n] = alpha y[0] s[n] + (alpha + 1)/n sum of k s[k] y[n-k] - sum of s[k] y[n-k]        k = 1 ... n-1
        """
        A, *moments = constants
        x = subtract(scale(A, g), self.b)
        over, y0, alpha, base = self.start_power(dot(x, x))
        S = scale(-2.0 * A * over * over, self.b)
        S = series.vector(S[1], S[2], S[0])
        M1, M2 = (series.vector(*moment) for moment in moments)
        y, torque, *s = (series.history() for _ in range(3 if series.one_body else 4))
        y0, steep = series.broadcast(y0), series.broadcast(alpha * y0)

        def accelerate(c: Any, n: Any) -> Any:
            torque.push(fuse(-M1, c[n, 1], M2 * c[n, 0]))
            distance = series.add_up(S * c[n, 0])
            for history, value in zip(s, series.pair(distance, 1.0, float(n)), strict=True):
                history.push(value)
            if n > 1:
                sums = series.convolve(n, 1, n - 1, *(((history, y),) for history in s))
                y.push(fuse(distance, steep, series.add_pair(sums, -1.0, (alpha + 1) / n)))
            else:
                y.push(distance * steep if n else y0)
            before = series.convolve(n, 0, max(n - 1, 0), ((y, torque),), start=torque[n] if base else None)[0]
            return fuse(y[n], torque[0], before) if n else before

        return accelerate

    def energies(self, R_WB: Any) -> Any:
        """Return V, (...), in J."""
        b, A = self.b, self.A
        x = R_WB[..., 0] * b[..., :1] + R_WB[..., 1] * b[..., 1:2] + R_WB[..., 2] * b[..., 2:] - A
        return self.value(np.sum(x * x, axis=-1))

    def axis_W(self) -> Any:
        """Return the direction of the world point; 0 if it is the pivot, and the field does nothing."""
        return self.A


class SpringField(namedtuple("SpringNumbers", "b A stiffness rest"), PointField):
    """F = stiffness/2 (sqrt(s) - rest)^2, stiffness in N/m, rest in m, b in body and A in world axes, m."""

    def value(self, s: Any) -> Any:
        """Return F in J."""
        stretch = root(s) - self.rest
        return 0.5 * self.stiffness * stretch * stretch

    def derivative(self, s: Any) -> Any:
        """Return dF/ds in N/m; without a rest length it does not depend on the distance, which may be 0."""
        return 0.5 * self.stiffness * (1.0 - divide(self.rest, root(s)))

    def divided(self, s0: Any, s1: Any) -> Any:
        """Return (F(s1) - F(s0)) / (s1 - s0), N/m, and its derivative by s1, N/m^3."""
        half, r1 = 0.5 * self.stiffness, root(s1)
        both = root(s0) + r1
        return half * (1.0 - divide(2.0 * self.rest, both)), divide(half * self.rest, r1 * both * both)

    def torque_factor(self) -> Any:
        """Return the factor of the torque with which `series` starts, N/m."""
        return self.stiffness

    def in_units(self, energy: Any) -> Any:
        """Return the field with energies in units of `energy`, J."""
        return self._replace(stiffness=self.stiffness / energy)

    def start_power(self, s: Any) -> Any:
        """Return one over the distance, y at the start, alpha and base of `series`: 0 twice without a rest length."""
        over = divide(choose(self.rest > 0.0, 1.0, 0.0), root(s))
        return over, -self.rest * over, -0.5, 1

    def scale(self) -> Any:
        """Return the largest possible V, J: at the largest distance, or at 0 if that is farther from the rest length."""
        return self.stiffness / 2 * np.maximum(lengths(self.b) + lengths(self.A), self.rest) ** 2


class AttractionField(namedtuple("AttractionNumbers", "b A strength"), PointField):
    """F = -strength / sqrt(s), strength in J m, b in body and A in world axes, m."""

    def value(self, s: Any) -> Any:
        """Return F in J."""
        return -self.strength * (1.0 / root(s))  # the quotient of `derivative`, which compiled code computes once

    def derivative(self, s: Any) -> Any:
        """Return dF/ds in N/m."""
        over = 1.0 / root(s)
        return 0.5 * self.strength * over * over * over

    def divided(self, s0: Any, s1: Any) -> Any:
        """Return (F(s1) - F(s0)) / (s1 - s0), N/m, and its derivative by s1, N/m^3."""
        r0, r1 = root(s0), root(s1)
        value = self.strength / ((r0 + r1) * r0 * r1)
        return value, -0.5 * value * (r0 + 2.0 * r1) / (s1 * (r0 + r1))

    def torque_factor(self) -> Any:
        """Return the factor of the torque with which `series` starts, J m."""
        return self.strength

    def in_units(self, energy: Any) -> Any:
        """Return the field with energies in units of `energy`, J."""
        return self._replace(strength=self.strength / energy)

    def start_power(self, s: Any) -> Any:
        """Return one over the distance, y at the start, alpha and base of `series`."""
        over = 1.0 / root(s)
        return over, over * over * over, -1.5, 0

    def scale(self) -> Any:
        """Return the size of V where the points' directions from the pivot are at right angles, J."""
        return abs(self.strength) / np.hypot(lengths(self.b), lengths(self.A))


class PointPotential(FieldPotential):
    """Base of the potentials between two points.

    Attributes
    ----------
    point_B
        Point of the body (3,), m, body axes, from the fixed point.
    anchor_W
        Point of the world (3,), m, world axes, from the fixed point.
    """

    point_B: Array
    anchor_W: Array

    def energy_of(self, distance: Array) -> Array:
        """Return V, (...), in J at distances (...) in m."""
        return np.asarray(self._field().value(np.asarray(distance) ** 2))


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

    features: ClassVar[Features] = frozenset({Feature.SPRING})
    NUMBERS: ClassVar[tuple[str, ...]] = ("point_B", "anchor_W", "stiffness", "rest_length")

    @staticmethod
    def build_field(R_BP: Array | None, point_B: Any, anchor_W: Any, stiffness: Any, rest_length: Any) -> SpringField:
        """Return the field in axes R_BP."""
        return SpringField(into_axes(point_B, R_BP), anchor_W, stiffness, rest_length)

    @staticmethod
    def suspects(parameters: Mapping[str, Array]) -> Any:
        """Return which of n bodies' numbers (n, ...), N/m and m, might not be taken as they are."""
        return (parameters.get("stiffness", np.ones(1)) <= 0) | (parameters.get("rest_length", np.ones(1)) < 0)

    def in_units(self, energy: float) -> LinearSpring:
        """Return the field with energies in units of `energy`, a power of two, J."""
        return replace_unchecked(self, stiffness=self.stiffness / energy)


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

    features: ClassVar[Features] = frozenset({Feature.ATTRACTION})
    NUMBERS: ClassVar[tuple[str, ...]] = ("point_B", "anchor_W", "strength")

    @staticmethod
    def build_field(R_BP: Array | None, point_B: Any, anchor_W: Any, strength: Any) -> AttractionField:
        """Return the field in axes R_BP."""
        return AttractionField(into_axes(point_B, R_BP), anchor_W, strength)

    @staticmethod
    def suspects(parameters: Mapping[str, Array]) -> Any:
        """Return which of n bodies' numbers (n, ...), J m and m, might not be taken as they are."""
        zero = [~parameters[name].any(axis=1) for name in ("point_B", "anchor_W") if name in parameters]
        return np.logical_or.reduce([parameters.get("strength", np.ones(1)) == 0, *zero])

    def steepest(self) -> float:
        """Return the largest change of V by a relative change of positions, J: at the smallest distance; inf if it is 0."""
        a, b = float(np.linalg.norm(self.anchor_W)), float(np.linalg.norm(self.point_B))
        return abs(self.strength) * (a + b) / (a - b) ** 2 if a != b else math.inf

    def in_units(self, energy: float) -> PointAttraction:
        """Return the field with energies in units of `energy`, a power of two, J."""
        return replace_unchecked(self, strength=self.strength / energy)
