"""Arithmetic for exact solutions: numbers of 500 bits, vectors and quaternions of them, and phases that keep their digits."""

from __future__ import annotations

from dataclasses import dataclass
from threading import RLock
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from conservative.attitude import Array
from conservative.errors import BadInput

mp = mpmath.MPContext()  # private: the global context has one precision for all threads
mp.prec = 500

MP_LOCK = RLock()
"""Held while `mp` is used: mpmath's functions change the precision of their context while they run."""

Number = Any
"""A real or complex number of `mp`."""
Vector = list[Number]
Matrix = Any
"""A matrix of `mp`."""
ComplexArray = NDArray[np.complex128]


def as_array(values: Matrix) -> Array:
    """Return a matrix of `mp` in double precision."""
    return np.array([[float(value) for value in row] for row in values.tolist()])


def cross(a: Vector, b: Vector) -> Vector:
    """Return a x b."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def cayley_klein_in_double(R: Matrix) -> tuple[complex, complex]:
    """Return `cayley_klein` in double precision."""
    alpha, beta = cayley_klein(R)
    return complex(alpha), complex(beta)


def cayley_klein(R: Matrix) -> tuple[Number, Number]:
    """Return the Cayley-Klein parameters of a rotation, alpha = q0 + i q3 and beta = q1 + i q2 (Shepperd 1978)."""
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    squares = [1 + trace, *(1 + 2 * R[i, i] - trace for i in range(3))]
    largest = max(range(4), key=lambda i: squares[i])
    odd = [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    if largest == 0:
        q = [squares[0], *odd]
    else:
        k = largest - 1
        q = [odd[k], *(squares[largest] if i == k else R[i, k] + R[k, i] for i in range(3))]
    q = [x / (2 * mp.sqrt(squares[largest])) for x in q]
    return mp.mpc(q[0], q[3]), mp.mpc(q[1], q[2])


def multiply(left: Any, right: Any) -> Any:
    """Return the product of two quaternions, each a pair (alpha, beta) of numbers or of arrays (n,)."""
    (a, b), (c, d) = left, right
    return a * c - b * np.conj(d), a * d + b * np.conj(c)


def root(square: Number) -> Number:
    """Return the square root of a number that is negative only by round-off."""
    return mp.sqrt(max(square, mp.mpf(0)))


def clamp_to_unit(value: Number) -> Number:
    """Return `value` within [0, 1], which it leaves only by round-off."""
    return min(max(value, mp.mpf(0)), mp.mpf(1))


def from_cayley_klein(alpha: Any, beta: Any) -> Array:
    """Return rotations (n, 3, 3) of quaternions of any length, given as alpha = q0 + i q3 and beta = q1 + i q2, each (n,).

    Theta functions give these Cayley-Klein parameters (Klein & Sommerfeld, Theorie des Kreisels, I.2).
    """
    aa, bb = alpha * alpha, beta * beta
    a_size, b_size = np.abs(alpha) ** 2, np.abs(beta) ** 2
    inverse = 1 / (a_size + b_size)
    mixed, product = alpha * np.conj(beta), alpha * beta
    out = np.empty((*alpha.shape, 3, 3))
    out[..., 0, 0], out[..., 1, 1] = (aa + bb).real * inverse, (aa - bb).real * inverse
    out[..., 1, 0], out[..., 0, 1] = (aa + bb).imag * inverse, (bb - aa).imag * inverse
    out[..., 2, 2] = (a_size - b_size) * inverse
    out[..., 0, 2], out[..., 1, 2] = 2 * product.imag * inverse, -2 * product.real * inverse
    out[..., 2, 0], out[..., 2, 1] = 2 * mixed.imag * inverse, 2 * mixed.real * inverse
    return out


MOST_PERIODS = 2**60
"""Largest number of periods after which two doubles determine the phase to 1e-14 of a period."""


@dataclass(frozen=True, eq=False)
class Phase:
    """A phase start + rate t, reduced by its period without loss of digits. The period can be infinite."""

    start: Number
    rate: Number
    period: Number

    def reduce(self, t: Array) -> tuple[Array, Array]:
        """Return the phase (n,) within half a period of 0, and the parity (n,), 0 or 1, of the periods subtracted.

        The product with the time is a sum of two doubles, so the error is a rounding unit of the period up to `MOST_PERIODS`.
        Later times raise `BadInput`.
        """
        if self.period == mp.inf:
            high, low = _line(self.start, self.rate, t)
            return high + low, np.zeros_like(t)
        last = float(np.abs(t).max(initial=0.0))
        periods = abs(self.rate / self.period) * mp.mpf(last)
        if periods > MOST_PERIODS:
            count, longest = mp.nstr(periods, 3), float(MOST_PERIODS * abs(self.period / self.rate))
            raise BadInput("t", f"{last:g} s, {count} periods", f"times of up to 2^60 periods, {longest:.3g} s")
        high, low = _line(mp.mpf(0), self.rate / self.period, t)
        whole = np.rint(high)
        start, start_low = _two_parts(self.start / self.period)
        high, lost = _two_sum(high - whole, np.asarray(start))
        high, low = _two_sum(high, low + (lost + start_low))
        more = np.rint(high)
        high = high - more
        period, period_low = _two_parts(self.period)
        return period * high + (period * low + period_low * high), np.mod(np.mod(whole, 2) + more, 2)

    def phasor(self, t: Array) -> ComplexArray:
        """Return exp(i phase), (n,); the period must be 2 pi."""
        return np.asarray(np.exp(1j * self.reduce(t)[0]))


def rotation_phase(start: Number, rate: Number) -> Phase:
    """Return the phase of an angle, rad, whose period is 2 pi."""
    return Phase(start, rate, 2 * mp.pi)


def _line(start: Number, rate: Number, t: Array) -> tuple[Array, Array]:
    """Return start + rate t (n,) as an unevaluated sum of two doubles."""
    high, low = _two_parts(rate)
    product, error = _two_product(high, t)
    first, rest = _two_parts(start)
    total, lost = _two_sum(product, np.asarray(first))
    return total, error + (lost + rest + low * t)


def _two_parts(value: Number) -> tuple[float, float]:
    high = float(value)
    return high, float(value - mp.mpf(high))


def _two_sum(a: Any, b: Any) -> tuple[Array, Array]:
    """Return a + b and its rounding error (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def _two_product(a: float, b: Array) -> tuple[Array, Array]:
    """Return a b and its rounding error (Dekker)."""
    a_high, a_low = _split(np.asarray(a))
    b_high, b_low = _split(b)
    product = a * b
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def _split(a: Array) -> tuple[Array, Array]:
    """Return a as a sum of two numbers of 26 bits (Veltkamp)."""
    shifted = 134217729.0 * a  # 2^27 + 1
    high = shifted - (shifted - a)
    return high, a - high
