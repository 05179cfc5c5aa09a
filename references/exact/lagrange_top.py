"""The Lagrange top in closed form (Klein & Sommerfeld, Theorie des Kreisels, VI; Whittaker, Analytical Dynamics, 72).

Axis 3 points from the fixed point to the centre of mass; R = Rz(phi) Rx(theta) Rz(psi), u = cos theta. With k = m g l/J1,
b_z = L_z/J1, b3 = L3/J1, w = w1 + i w2, u_E = u + |w|^2/(2 k) (constant)

    u'^2 = 2 k (u_E - u)(1 - u^2) - (b_z - b3 u)^2 = 2 k (u - u1)(u2 - u)(u3 - u)
    u = u1 + (u2 - u1) sn^2 v,     v = v0 + Omega t,     Omega^2 = k (u3 - u1)/2

Euler angles are singular at the poles u = -1 and 1. The Cayley-Klein parameters and the transverse rate are not. Each of

    alpha = cos(theta/2) exp(i (phi + psi)/2)     alpha'/alpha = ( u' + i (b_z + b3)) / (2 (u + 1)) + i (w3 - b3)/2
    beta  = sin(theta/2) exp(i (phi - psi)/2)     beta'/beta   = (-u' + i (b_z - b3)) / (2 (1 - u)) - i (w3 - b3)/2
    w                                             w'/w         = (-u' - i (b_z - b3 u_E)) / (2 (u_E - u)) - i (w3 - b3/2)

is a constant times exp(i mu t) theta_j(v - i y)/theta_4(v), with j = 1 for alpha and 2 for the others, and vanishes where u
as a function of complex time is -1, 1 or u_E. A passage close to a pole, or through it, is a theta function near its zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from conservative.attitude import Array

from .digits import (
    ComplexArray,
    Matrix,
    Number,
    Phase,
    as_array,
    cayley_klein,
    cayley_klein_in_double,
    clamp_to_unit,
    cross,
    from_cayley_klein,
    mp,
    multiply,
    root,
    rotation_phase,
)
from .start import SYMMETRIC, InitialState, Solution
from .theta import Lattice, Points, Quotient, jacobi, quotient

_SAME = mp.mpf(10) ** -60
"""Difference of roots of the cubic that are equal: double roots have half of the 150 digits."""

_UPRIGHT = mp.mpf(10) ** -24
"""Tilt or swing, rad, below which the axis stays vertical: the round-off of the cubic is as large."""


@dataclass(frozen=True, eq=False)
class Top:
    """The initial state of a top; symbols as above, `spin` is w3, the columns of `R_BP` are the axes of the top."""

    k: Number
    b3: Number
    spin: Number
    w: Number
    alpha: Number
    beta: Number
    R_BP: Matrix

    @cached_property
    def across(self) -> Number:
        """gamma1 + i gamma2 of the vertical gamma = R' e_z."""
        return mp.mpc(0, 2) * mp.conj(self.alpha) * self.beta

    @cached_property
    def u(self) -> Number:
        """gamma3."""
        return abs(self.alpha) ** 2 - abs(self.beta) ** 2

    @cached_property
    def b_z(self) -> Number:
        """Vertical momentum over J1."""
        return (mp.conj(self.across) * self.w).real + self.b3 * self.u

    @property
    def u_E(self) -> Number:
        """The value of u at which the transverse rate vanishes."""
        return self.u + abs(self.w) ** 2 / (2 * self.k)

    @property
    def upright(self) -> bool:
        """True if the axis stands or hangs at rest."""
        return bool(abs(self.across) < _UPRIGHT and abs(self.w) < _UPRIGHT * mp.sqrt(self.k))


def top(start: InitialState, moment_B: Array, axis_B: Array) -> Top:
    """Return the top of a body symmetric about `axis_B`, which is parallel to the moment m g c."""
    moments, axes = start.principal
    moment = mp.matrix([mp.mpf(float(x)) for x in moment_B])
    third = max(range(3), key=lambda i: abs(sum(axes[row, i] * float(axis_B[row]) for row in range(3))))
    J3, J1 = moments[third], (moments[third - 1] + moments[third - 2]) / 2
    axis = axes[:, third]
    if max(moments) - min(moments) <= SYMMETRIC * max(moments):  # a sphere: the axis through the centre of mass
        J1 = J3 = sum(moments) / 3
        axis = moment / mp.norm(moment)
    lever = (axis.T * moment)[0]
    R_BP = frame(axis * mp.sign(lever), axes[:, third - 2])
    w1, w2, w3 = start.rates(R_BP)
    alpha, beta = cayley_klein(start.attitude * R_BP)
    return Top(abs(lever) / J1, J3 * w3 / J1, w3, mp.mpc(w1, w2), alpha, beta, R_BP)


def frame(axis: Matrix, near: Matrix) -> Matrix:
    """Return the rotation whose third column is the unit vector `axis` and whose first is as close as possible to `near`."""
    helpers = [near, *(mp.eye(3)[:, i] for i in range(3))]
    first = next(rest for rest in (x - axis * (axis.T * x)[0] for x in helpers) if mp.norm(rest) > 0.5)
    first = first / mp.norm(first)
    second = mp.matrix(cross(list(axis), list(first)))
    return mp.matrix([list(first), list(second), list(axis)]).T


@dataclass(frozen=True, eq=False)
class Nutation:
    """The roots u1 <= u2 <= 1 <= u3, and the arguments of the theta functions."""

    u1: Number
    u2: Number
    u3: Number
    lattice: Lattice

    def below(self, a: Number) -> tuple[Number, Number]:
        """Return (y, K' - y) with u = a <= u1 at v = i y."""
        rest = mp.sqrt(self.u3 - self.u1) * mp.elliprf(self.u1 - a, self.u2 - a, self.u3 - a)
        return self.lattice.K_prime - rest, rest

    def above(self, a: Number) -> tuple[Number, Number]:
        """Return (y, K' - y) with u = a, u2 <= a <= u3, at v = K + i y."""
        if self.u3 == self.u2:
            return mp.mpf(0), self.lattice.K_prime
        rest = root((self.u3 - a) / (self.u3 - self.u2)) * mp.elliprf(
            (a - self.u2) / (self.u3 - self.u2), (a - self.u1) / (self.u3 - self.u1), 1
        )
        return self.lattice.K_prime - rest, rest


def nutation(start: Top) -> Nutation:
    """Return the roots of the cubic, by Viete's formula, and the periods."""
    u_E, b3, b_z, k = start.u_E, start.b3, start.b_z, start.k
    square, linear, constant = -(u_E + b3**2 / (2 * k)), b_z * b3 / k - 1, u_E - b_z**2 / (2 * k)
    p = square**2 / 9 - linear / 3
    q = (linear * square - 3 * constant) / 6 - square**3 / 27
    angle = mp.acos(max(min(q / mp.sqrt(p) ** 3, mp.mpf(1)), mp.mpf(-1))) / 3 if p > 0 else mp.mpf(0)
    u3, u2, u1 = (2 * root(p) * mp.cos(angle + turn * 2 * mp.pi / 3) - square / 3 for turn in (0, -1, 1))
    marks = start.u, mp.mpf(1), mp.mpf(-1)  # a root that equals one of them up to round-off is that number
    u1, u2, u3 = (next((mark for mark in marks if abs(u - mark) < _SAME), u) for u in (u1, u2, u3))
    u1, u2, u3 = max(min(u1, start.u), mp.mpf(-1)), min(max(u2, start.u), mp.mpf(1)), max(u3, mp.mpf(1))
    return Nutation(u1, u2, u3, Lattice.of((u2 - u1) / (u3 - u1), (u3 - u2) / (u3 - u1)))


Factor = Callable[[Array, Points], ComplexArray]
"""exp(i mu t) times a quotient of theta functions: maps times (n,) and arguments to values (n,)."""


def factor(shape: Quotient, omega: Number, v0: Number, v: Number, rate: Number, start: Number, slope: Number) -> Factor:
    """Return the factor with the phase rate `rate` at v and with the initial value `start` and slope at v0.

    The larger of the two determines the constant, because the initial value can be near a zero.
    """
    value, derivative = shape.value_and_slope(v)
    mu = rate - omega * (derivative / value).imag
    value, derivative = shape.value_and_slope(v0)
    scale = start / value if abs(omega * start) > abs(slope) else slope / (omega * derivative + mp.mpc(0, mu) * value)
    clock, scaled = rotation_phase(mp.mpf(0), mu), shape.times(scale)
    return lambda t, points: clock.phasor(t) * points.quotient(scaled)


def nutation_phase(start: Top, roots: Nutation) -> Phase:
    """Return v as a function of time."""
    u, u1, u2, u3, v = start.u, roots.u1, roots.u2, roots.u3, mp.mpf(0)
    if u1 != u2:
        sn = root(clamp_to_unit((u - u1) / (u2 - u1)))
        v = sn * mp.elliprf(clamp_to_unit((u2 - u) / (u2 - u1)), clamp_to_unit((u3 - u) / (u3 - u1)), 1)
    rising = (mp.conj(start.across) * start.w).imag >= 0  # u' >= 0
    return Phase(v if rising else -v, mp.sqrt(start.k * (u3 - u1) / 2), 2 * roots.lattice.K)


def top_motion(start: Top) -> Solution:
    """Return the motion of an initial state that is not upright."""
    roots = nutation(start)
    lattice, u_E = roots.lattice, max(min(start.u_E, roots.u3), roots.u2)
    argument = nutation_phase(start, roots)
    v0, omega = argument.start, argument.rate
    v = mp.mpf(1)  # any |v| < K at which no factor vanishes
    u = roots.u1 + (roots.u2 - roots.u1) * jacobi(lattice)[0].value_and_slope(v)[0].real ** 2
    plus, minus, across = start.b_z + start.b3, start.b_z - start.b3, start.b3 * u_E - start.b_z
    slip = (start.spin - start.b3) / 2
    rates = (plus / (2 * (1 + u)) + slip, minus / (2 * (1 - u)) - slip, across / (2 * (u_E - u)) - start.spin + start.b3 / 2)
    shapes = (
        quotient(lattice, 1, *roots.below(mp.mpf(-1)), mirrored=bool(plus < 0)),
        quotient(lattice, 2, *roots.above(mp.mpf(1)), mirrored=bool(minus < 0)),
        quotient(lattice, 2, *roots.above(u_E), mirrored=bool(across < 0)),
    )
    w_scale = mp.sqrt(2 * start.k * (u_E - roots.u1))
    values, i = (start.alpha, start.beta, start.w / w_scale), mp.mpc(0, 1)
    slopes = (
        (i * start.spin * start.alpha - start.beta * mp.conj(start.w)) / 2,
        (start.alpha * start.w - i * start.spin * start.beta) / 2,
        (-i * (start.spin - start.b3) * start.w - i * start.k * start.across) / w_scale,
    )
    parts = zip(shapes, rates, values, slopes, strict=True)
    alpha, beta, w = (factor(shape, omega, v0, v, *rest) for shape, *rest in parts)
    R_BP, q_PB = as_array(start.R_BP), cayley_klein_in_double(start.R_BP.T)

    def at(t: Array) -> tuple[Array, Array]:
        v, odd = argument.reduce(t)
        points = Points(lattice, v)
        R_WB = from_cayley_klein(*multiply((alpha(t, points), beta(t, points)), q_PB))
        across = float(w_scale) * (1 - 2 * odd) * w(t, points)
        w_P = np.stack([across.real, across.imag, np.full_like(across.real, float(start.spin))], axis=-1)
        return R_WB, w_P @ R_BP.T

    return at
