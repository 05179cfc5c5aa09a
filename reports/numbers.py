"""Numbers as texts: the same rule for tables, sentences, pictures and animations."""

from __future__ import annotations

import math

from conservative.presentation import rounded_up

DASH = "–"


def number(value: float, digits: int = 2) -> str:
    """Return a number to `digits` significant digits, a dash for NaN."""
    if math.isnan(value):
        return DASH
    plain = value == 0 or 0.01 <= abs(value) < 1e6
    return f"{float(f'{value:.{digits}g}'):,g}" if plain else short_power(f"{value:.{digits - 1}e}")


def bound(value: float, digits: int = 2) -> str:
    """Return a size that a motion stays within, such as an error or a drift: rounded up to `digits` digits, never down."""
    return number(rounded_up(value, digits), digits)


def angle(value: float, digits: int = 2) -> str:
    """Return an attitude error, rad, rounded up, with more digits if it would be above π, the largest possible one."""
    texts = (bound(value, more) for more in range(digits, digits + 3))
    return next((text for text in texts if not math.isfinite(value) or value > math.pi or float(text) <= math.pi), "π")


def short_power(text: str) -> str:
    """Return a number with a short exponent: `1e-3` for `1e-03`."""
    mantissa, _, exponent = text.partition("e")
    return f"{mantissa}e{int(exponent)}" if exponent else text
