"""Numbers as texts: one rule for messages, tables and pictures. It imports nothing that `--help` would wait for."""

from __future__ import annotations

import math
from decimal import ROUND_UP, Context, Decimal

DASH = "–"
"""In place of a number that was not measured."""


def rounded_up(value: float, digits: int) -> float:
    """Return a size, such as an error or a drift, rounded away from 0 to `digits` digits: what is shown is never too small."""
    if not math.isfinite(value):
        return value
    # Of the 15 digits that a double has for certain, so that 0.1 and 100 * 0.07 = 7.000000000000001 stay 0.1 and 7.
    return float(Context(digits, ROUND_UP).create_decimal(Decimal(f"{value:.15g}")))


def number(value: float, digits: int = 2) -> str:
    """Return a number to `digits` significant digits, a dash for NaN."""
    if math.isnan(value):
        return DASH
    plain = value == 0 or 0.01 <= abs(value) < 1e6
    return f"{float(f'{value:.{digits}g}'):,g}" if plain else short_power(f"{value:.{digits - 1}e}")


def short_power(text: str) -> str:
    """Return a number with a short exponent: `1e-3` for `1e-03`."""
    mantissa, _, exponent = text.partition("e")
    return f"{mantissa}e{int(exponent)}" if exponent else text
