"""Series steps (`series`) as plain Python: arrays (4,), order after order. Products are rounded before they are added."""

from __future__ import annotations

from itertools import islice

import numpy as np

from .series import sum_orders
from .simd_numpy import LANES


class Emitter:
    """Arithmetic by name; what is stored stays where it is."""

    def constant(self, x):
        """The number x in all lanes."""
        return np.full(LANES, x)

    splat = constant

    def plus(self, a, b):
        """a + b"""
        return a + b

    def minus(self, a, b):
        """a - b"""
        return a - b

    def times(self, a, b):
        """a b"""
        return a * b

    def add(self, c, a, b):
        """c + a b; c is None for 0."""
        return a * b if c is None else c + a * b

    def subtract(self, c, a, b):
        """c - a b"""
        return c - a * b

    def shuffle(self, v, places):
        """The lanes of v at these places."""
        return v[list(places)]

    def store(self, v):
        """Keep v; returns where."""
        return v

    def load(self, at):
        """What was stored there."""
        return at


def sum_to_order(series, numbers, p, h, start, K):
    """What a step of order p and length h adds to g, a and w, and its last two terms (`series_llvm`)."""
    emit = Emitter()
    field = series(emit, *(np.broadcast_to(x, LANES) for x in numbers))
    totals = sum_orders(emit, emit.splat(h), start, K, field)
    return next(islice(totals, p - 1, None))
