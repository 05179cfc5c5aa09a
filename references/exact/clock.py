"""Phases that grow in proportion to time, reduced by their period without losing digits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from conservative.attitude import Array
from conservative.errors import BadInput

from .digits import Number, mp
from .theta import ComplexArray

MOST_PERIODS = 2**60
"""Periods up to which twice the digits of a double leave a phase to 1e-14 of one."""


@dataclass(frozen=True, eq=False)
class Clock:
    """The phase start + rate t, in many digits, of a period that may be infinite."""

    start: Number
    rate: Number
    period: Number

    def reduce(self, t: Array) -> tuple[Array, Array]:
        """Return the phase (n,) within half a period of 0, and the parity (n,), 0 or 1, of the periods taken off.

        The product with the time is carried in twice the digits: the error stays a rounding unit of the period up to
        `MOST_PERIODS` of them.

        Raises
        ------
        BadInput
            Some time is beyond those periods.
        """
        if self.period == mp.inf:
            high, low = _line(self.start, self.rate, t)
            return high + low, np.zeros_like(t)
        self._require_digits(t)
        high, low = _line(mp.mpf(0), self.rate / self.period, t)
        whole = np.rint(high)
        start, start_low = _two_parts(self.start / self.period)
        high, lost = _two_sum(high - whole, np.asarray(start))
        high, low = _two_sum(high, low + (lost + start_low))
        more = np.rint(high)
        high = high - more
        period, period_low = _two_parts(self.period)
        return period * high + (period * low + period_low * high), np.mod(np.mod(whole, 2) + more, 2)

    def _require_digits(self, t: Array) -> None:
        """Raise `BadInput` for times after more than `MOST_PERIODS`, of which nothing is left of the phase."""
        last = float(np.abs(t).max(initial=0.0))
        periods = abs(self.rate / self.period) * mp.mpf(last)
        if periods > MOST_PERIODS:
            counted, longest = mp.nstr(periods, 3), float(MOST_PERIODS * abs(self.period / self.rate))
            raise BadInput("t", f"{last:g} s, {counted} periods", f"times of up to 2^60 periods, {longest:.3g} s")

    def phasor(self, t: Array) -> ComplexArray:
        """Return exp(i phase), (n,); the period must be 2 pi."""
        return np.asarray(np.exp(1j * self.reduce(t)[0]))


def rotation_clock(start: Number, rate: Number) -> Clock:
    """Return the clock of an angle, rad."""
    return Clock(start, rate, 2 * mp.pi)


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
    a_high, a_low = _halves(np.asarray(a))
    b_high, b_low = _halves(b)
    product = a * b
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def _halves(a: Array) -> tuple[Array, Array]:
    """Return a as a sum of two numbers of 26 bits (Veltkamp)."""
    shifted = 134217729.0 * a
    high = shifted - (shifted - a)
    return high, a - high
