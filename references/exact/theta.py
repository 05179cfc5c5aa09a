"""Quotients of theta functions, prepared in 500 bits and evaluated in double precision.

Exact motions consist of constants times `exp(i mu t) theta_j(v - i y) / theta_4(v)`, v linear in time. The series of a theta
function (DLMF 20.2) converges fast for a small nome. For a large one, Jacobi's imaginary transformation (DLMF 20.7(viii))
replaces the nome by the complementary one, and circular by hyperbolic functions. The smaller of the two never exceeds
exp(-pi) = 0.043, so five terms give double precision for every modulus from 0 to 1 inclusive.

Double precision forms no difference of nearly equal numbers: whatever could cancel is prepared in 500 bits, once per motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from conservative.attitude import Array

from .digits import ComplexArray, Number, mp

_BITS_KEPT = 600
"""Terms of a series are kept down to this many bits below the first one: more than `mp` has."""


@dataclass(frozen=True, eq=False)
class Lattice:
    """Quarter periods K (real) and K' (imaginary) of an elliptic function. Either can be infinite.

    The series are in powers of exp(2 w), w = s v. If `hyperbolic`, K' < K, s = pi/(2 K') is real and the nome is the
    complementary one; otherwise s = i pi/(2 K).
    """

    K: Number
    K_prime: Number

    @classmethod
    def of(cls, m: Number, m_complement: Number) -> Lattice:
        """Return the lattice of the parameter m and 1 - m; both are arguments because a subtraction would lose digits."""
        return cls(_quarter_period(m_complement), _quarter_period(m))

    @cached_property
    def hyperbolic(self) -> bool:
        """True if the complementary nome is the smaller one."""
        return bool(self.K_prime < self.K)

    @cached_property
    def short(self) -> Number:
        """The smaller quarter period."""
        return min(self.K, self.K_prime)

    @cached_property
    def nome(self) -> Number:
        """The smaller nome, at most exp(-pi)."""
        return mp.exp(-mp.pi * max(self.K, self.K_prime) / self.short)

    @cached_property
    def terms(self) -> int:
        """Number of terms of a series that matter: their size decreases like nome^(n (n - 1))."""
        bits = -mp.log(self.nome, 2) if self.nome > 0 else mp.inf
        return 2 + int(mp.ceil(mp.sqrt(_BITS_KEPT / bits)))

    @cached_property
    def theta_4(self) -> Theta:
        """theta_4(v), the denominator of every quotient."""
        return theta(self, 4, mp.mpf(0), self.K_prime)

    @cached_property
    def s(self) -> Number:
        """d w / d v."""
        rate = mp.pi / (2 * self.short)
        return rate if self.hyperbolic else mp.mpc(0, rate)

    def exponentials(self, v: Number) -> tuple[Number, Number, Number]:
        """Return exp(2 w), exp(-2 w) and the lift (see `Theta`) at a number v; hyperbolic: 0 <= v, the first times the nome."""
        grown = mp.exp(2 * self.s * (v - self.K if self.hyperbolic else v))
        return grown, mp.exp(-2 * self.s * v), mp.exp(-self.s * v if self.hyperbolic else self.s * v)

    def exponential_arrays(self, v: Array) -> tuple[Any, Any, Any]:
        """Return the same at v (n,) in double precision."""
        rate = float(abs(self.s))
        if self.hyperbolic:
            lift = np.exp(-rate * v)
            return np.exp((2 * rate) * (v - float(self.K))), lift * lift, lift
        lift = np.exp(1j * rate * v)
        grown = lift * lift
        return grown, np.conj(grown), lift


def _quarter_period(m_complement: Number) -> Number:
    return mp.inf if m_complement == 0 else mp.pi / (2 * mp.agm(1, mp.sqrt(m_complement)))


@dataclass(frozen=True, eq=False)
class Theta:
    """A multiple of exp(i kappa v) theta_j(v - i y), as the series sum rising[n] exp(2 n w) + sum falling[n] exp(-2 n w).

    If `half`, the series has odd exponents, (2 n + 1) w, and exp(w) is divided out. `odd` is the sign c in
    f(-v - i y) = c conj(f(v - i y)) for real v. It lets hyperbolic series be summed for v >= 0 only.
    """

    lattice: Lattice
    rising: tuple[Number, ...]
    falling: tuple[Number, ...]
    kappa: Number
    half: bool
    odd: int

    def value_and_slope(self, v: Number) -> tuple[Number, Number]:
        """Return the function and its derivative at a number v."""
        if self.lattice.hyperbolic and v < 0:
            value, slope = self.value_and_slope(-v)
            return self.odd * mp.conj(value), -self.odd * mp.conj(slope)
        grown, fallen, _ = self.lattice.exponentials(v)
        value, slope = mp.mpc(0), mp.mpc(0)
        a_power, b_power = mp.mpf(1), mp.mpf(1)
        for n, (up, down) in enumerate(zip(self.rising, self.falling, strict=True)):
            a, b = up * a_power, down * b_power
            value, slope = value + a + b, slope + n * (a - b)
            a_power, b_power = a_power * grown, b_power * fallen
        turn = mp.expj(self.kappa * v)
        return turn * value, turn * (2 * self.lattice.s * slope + mp.mpc(0, self.kappa) * value)

    def arrays(self, grown: Any, fallen: Any) -> Any:
        """Return the series at exp(2 w) and exp(-2 w), each (n,), in double precision and without exp(i kappa v)."""
        return _polynomial(self.rising, grown) + fallen * _polynomial(self.falling[1:], fallen)


def theta(lattice: Lattice, number: int, y: Number, y_rest: Number) -> Theta:
    """Return a multiple of theta_j(v - i y), j = `number`, for 0 <= y <= K' and y_rest = K' - y.

    Formula: DLMF 20.2.1 to 20.2.4, transformed by 20.7.30 to 20.7.33 if the lattice is hyperbolic. There theta_2 and
    theta_4 change places, and the factor exp(-pi v^2 / (4 K K')), relative to the factor of theta_4(v), gives kappa.
    """
    hyperbolic = lattice.hyperbolic
    series = {2: 4, 4: 2}.get(number, number) if hyperbolic else number
    half, sign = series in (1, 2), (-1 if series in (1, 4) else 1)
    if hyperbolic:
        step = mp.expj(-mp.pi * y / lattice.K_prime)
        back, lead = mp.conj(step), mp.expj(-mp.pi * y / (2 * lattice.K_prime)) if half else mp.mpf(1)
        kappa = mp.pi * y / (2 * lattice.K * lattice.K_prime)
    else:
        step, back, lead = mp.exp(-mp.pi * y_rest / lattice.K), mp.exp(-mp.pi * y / lattice.K), mp.mpf(1)
        kappa = mp.mpf(0)
    nome, first, second = lattice.nome, (0 if half else -1), (-1 if half else 0)
    rising = [lead * sign**n * nome ** (n * (n + first)) * step**n for n in range(lattice.terms)]
    falling = [mp.mpf(0), *(lead * sign**n * nome ** (n * (n + second)) * back**n for n in range(1, lattice.terms))]
    return Theta(lattice, tuple(rising), tuple(falling), kappa, half, -1 if series == 1 and hyperbolic else 1)


@dataclass(frozen=True, eq=False)
class Quotient:
    """scale exp(i kappa v) theta_j(v - i y) / theta_4(v). If `mirrored`, for y < 0, its conjugate before scaling."""

    above: Theta
    below: Theta
    mirrored: bool = False
    scale: Number = 1

    def times(self, factor: Number) -> Quotient:
        """Return the quotient times a number."""
        return replace(self, scale=self.scale * factor)

    def value_and_slope(self, v: Number) -> tuple[Number, Number]:
        """Return the function and its derivative at a number v."""
        a, a_slope = self.above.value_and_slope(v)
        b, b_slope = self.below.value_and_slope(v)
        lift, lift_slope = self._lift(v)
        value = a * lift / b
        slope = (a_slope * lift + a * lift_slope - value * b_slope) / b
        if self.mirrored:
            value, slope = mp.conj(value), mp.conj(slope)
        return self.scale * value, self.scale * slope

    def _lift(self, v: Number) -> tuple[Number, Number]:
        """Return the quotient of the factors exp(w) that are not in the two series, and its derivative."""
        if self.above.half == self.below.half:
            return mp.mpf(1), mp.mpf(0)
        lattice = self.above.lattice
        if not lattice.hyperbolic:
            lift = lattice.exponentials(v)[2]
            return lift, lattice.s * lift
        lift = lattice.exponentials(abs(v))[2]
        return lift, -lattice.s * lift * (1 if v >= 0 else -1)


def quotient(lattice: Lattice, number: int, y: Number = 0, y_rest: Number | None = None, mirrored: bool = False) -> Quotient:
    """Return a multiple of theta_j(v - i y) / theta_4(v), with + i y if `mirrored`."""
    rest = lattice.K_prime if y_rest is None else y_rest
    return Quotient(theta(lattice, number, mp.mpf(y), rest), lattice.theta_4, mirrored)


def jacobi(lattice: Lattice) -> tuple[Quotient, Quotient, Quotient]:
    """Return sn, cn, dn (DLMF 22.2), normalised by sn'(0) = cn(0) = dn(0) = 1."""
    sn, cn, dn = (quotient(lattice, number) for number in (1, 2, 3))
    zero = mp.mpf(0)
    return (
        sn.times(1 / sn.value_and_slope(zero)[1]),
        cn.times(1 / cn.value_and_slope(zero)[0]),
        dn.times(1 / dn.value_and_slope(zero)[0]),
    )


class Points:
    """Arguments v (n,), |v| <= K, at which several functions of one lattice are evaluated in double precision."""

    def __init__(self, lattice: Lattice, v: Array) -> None:
        self._lattice, self._v = lattice, v
        self._size = np.abs(v) if lattice.hyperbolic else v
        self._grown, self._fallen, self._lift = lattice.exponential_arrays(self._size)

    @cached_property
    def _theta_4(self) -> Array:
        return np.asarray(np.real(self._lattice.theta_4.arrays(self._grown, self._fallen)))

    def theta(self, function: Theta) -> Any:
        """Return the function (n,), up to a positive factor."""
        value = function.arrays(self._grown, self._fallen)
        if function.kappa:
            value = value * np.exp(1j * float(function.kappa) * self._size)
        if self._lattice.hyperbolic:
            value = np.where(self._v < 0, function.odd * np.conj(value), value)
        return value

    def quotient(self, function: Quotient) -> ComplexArray:
        """Return the function (n,)."""
        value = self.theta(function.above) / self._theta_4
        if function.above.half != function.below.half:
            value = value * self._lift
        return np.asarray(complex(function.scale) * (np.conj(value) if function.mirrored else value))


def _polynomial(coefficients: tuple[Number, ...], x: Any) -> Any:
    """Return sum c[n] x^n for |x| <= 1, without the terms below a rounding unit."""
    numbers = np.array([complex(c) for c in coefficients])
    used = 1 + int(np.max(np.flatnonzero(np.abs(numbers) > 1e-18), initial=0))
    if not np.any(numbers.imag):
        numbers = numbers.real
    total = numbers[used - 1]
    for c in numbers[used - 2 :: -1] if used > 1 else ():
        total = total * x + c
    return total
