"""Twofold arithmetic: a number as the pair (high, low) of floats, about 31 digits (Dekker 1971)."""

from __future__ import annotations

from . import kernel

SPLIT = 134217729.0
"""2^27 + 1, which divides a float into two halves of 26 bits (Veltkamp)."""


@kernel
def two(x):
    """Return the float x as a twofold number."""
    return (x, 0.0)


@kernel
def _fast(a, b):
    s = a + b
    return (s, b - (s - a))


@kernel
def plus(x, y):
    """Return x + y."""
    s = x[0] + y[0]
    v = s - x[0]
    return _fast(s, ((x[0] - (s - v)) + (y[0] - v)) + (x[1] + y[1]))


@kernel
def minus(x, y):
    """Return x - y."""
    return plus(x, (-y[0], -y[1]))


@kernel
def times(x, y):
    """Return x y."""
    p = x[0] * y[0]
    t = SPLIT * x[0]
    xh = t - (t - x[0])
    xl = x[0] - xh
    t = SPLIT * y[0]
    yh = t - (t - y[0])
    yl = y[0] - yh
    e = ((xh * yh - p) + xh * yl + xl * yh) + xl * yl
    return _fast(p, e + (x[0] * y[1] + x[1] * y[0]))


@kernel
def scale(f, x):
    """Return f x for a float f."""
    return times((f, 0.0), x)


@kernel
def over(x, y):
    """Return x / y."""
    q = x[0] / y[0]
    r = minus(x, scale(q, y))
    return _fast(q, (r[0] + r[1]) / y[0])
