"""Numbers of 500 bits, in a context of mpmath's that is nobody else's. Source: mpmath's documentation."""

from __future__ import annotations

from threading import RLock
from typing import Any

import mpmath

mp = mpmath.MPContext()
mp.prec = 500

MP_LOCK = RLock()
"""Held while `mp` is used: mpmath's functions raise the precision of their context while they run."""

Number = Any
"""A real or complex number of `mp`."""
