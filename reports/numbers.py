"""Sizes as texts: the same rule for tables, sentences, pictures and animations."""

from __future__ import annotations

import math

from conservative.number_text import DASH as DASH
from conservative.number_text import number as number
from conservative.number_text import rounded_up
from conservative.number_text import short_power as short_power


def bound(value: float, digits: int = 2) -> str:
    """Return a size that a motion stays within, such as an error or a drift: rounded up to `digits` digits, never down."""
    return number(rounded_up(value, digits), digits)


def angle(value: float, digits: int = 2) -> str:
    """Return an attitude error, rad, rounded up, with more digits if it would be above π, the largest possible one."""
    texts = (bound(value, more) for more in range(digits, digits + 3))
    return next((text for text in texts if not math.isfinite(value) or value > math.pi or float(text) <= math.pi), "π")
