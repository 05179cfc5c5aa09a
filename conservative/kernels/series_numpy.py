"""Series steps (`series`) as plain Python: arrays (4,), order after order. Products are rounded before they are added."""

from __future__ import annotations

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


def make_orders(field_series):
    """Return `orders(p, h, g, a, w, K, numbers)` of a field whose coefficients `field_series` forms (`series_llvm`)."""

    def orders(p, h, g, a, w, K, numbers):
        emit = Emitter()
        field = field_series(emit, *(np.broadcast_to(x, LANES) for x in numbers))
        for order, (total, _) in enumerate(sum_orders(emit, emit.splat(h), (g, a, w), K, field), 1):
            if order == p:
                break
        return total

    return orders
