"""Arithmetic of laws and kernels, written once for floats, for arrays and for numbers of compiled code.

A number is a float, a NumPy array with one element per body, or a `Traced` number, whose operations emit machine instructions
(`conservative.kernels.compiler.traced`). Vectors and quaternions are tuples of numbers, so that compiled code keeps them in
registers. No function branches on the value of a number. Sums of products state with `fuse` which product is not rounded.
Otherwise the compiler chooses, and it can choose differently for one body and for several.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

Vector = Sequence[Any]
"""Three numbers."""


class Traced:
    """Base class of numbers of compiled code."""


class Axes(NamedTuple):
    """Three numbers with + - and * by component, with another such value or with one number for all."""

    x: Any
    y: Any
    z: Any

    def __add__(self, other: Any) -> Axes:
        return Axes(*(a + b for a, b in zip(self, _thrice(other), strict=True)))

    def __sub__(self, other: Any) -> Axes:
        return Axes(*(a - b for a, b in zip(self, _thrice(other), strict=True)))

    def __mul__(self, other: Any) -> Axes:
        return Axes(*(a * b for a, b in zip(self, _thrice(other), strict=True)))

    def __neg__(self) -> Axes:
        return Axes(*(-a for a in self))


def _thrice(x: Any) -> Any:
    return x if isinstance(x, Axes) else (x, x, x)


def fuse(a: Any, b: Any, c: Any) -> Any:
    """Return a b + c; compiled code rounds once."""
    if not isinstance(a, Traced | Axes) and not isinstance(b, Traced | Axes) and not isinstance(c, Traced | Axes):
        return a * b + c
    if isinstance(a, Axes) or isinstance(b, Axes):
        return Axes(*map(fuse, _thrice(a), _thrice(b), _thrice(c)))
    number: Any = next(x for x in (a, b, c) if isinstance(x, Traced))
    return number.fuse(a, b, c)


def root(x: Any) -> Any:
    """Return the square root."""
    if isinstance(x, Traced):
        return x.root()  # type: ignore[attr-defined]
    return np.sqrt(x) if isinstance(x, np.ndarray) else math.sqrt(x)


def sine(x: Any) -> Any:
    """Return sin x."""
    return x.call("sin", x) if isinstance(x, Traced) else math.sin(x)  # type: ignore[attr-defined]


def cosine(x: Any) -> Any:
    """Return cos x."""
    return x.call("cos", x) if isinstance(x, Traced) else math.cos(x)  # type: ignore[attr-defined]


def choose(mask: Any, a: Any, b: Any) -> Any:
    """Return a where the mask is true and b elsewhere; a and b are numbers or tuples of the same form."""
    if isinstance(a, tuple):
        chosen = [choose(mask, *pair) for pair in zip(a, b, strict=True)]
        return type(a)(*chosen) if hasattr(a, "_fields") else tuple(chosen)
    if isinstance(mask, Traced):
        return mask.choose(a, b)  # type: ignore[attr-defined]
    return np.where(mask, a, b) if isinstance(mask, np.ndarray) else a if mask else b


def divide(a: Any, b: Any) -> Any:
    """Return a / b, and 0 where a is 0."""
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.divide(a, b, out=np.zeros(np.broadcast(a, b).shape), where=np.not_equal(a, 0.0))
    if isinstance(a, Traced) or isinstance(b, Traced):
        return choose(a == 0.0, 0.0, a / b)
    return a / b if a else 0.0


def dot(a: Vector, b: Vector) -> Any:
    """Return a . b."""
    return fuse(a[2], b[2], fuse(a[1], b[1], a[0] * b[0]))


def cross(a: Vector, b: Vector) -> Any:
    """Return a x b."""
    return (
        fuse(a[1], b[2], -(a[2] * b[1])),
        fuse(a[2], b[0], -(a[0] * b[2])),
        fuse(a[0], b[1], -(a[1] * b[0])),
    )


def add(a: Vector, b: Vector) -> Any:
    """Return a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtract(a: Vector, b: Vector) -> Any:
    """Return a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(s: Any, a: Vector) -> Any:
    """Return s a."""
    return (s * a[0], s * a[1], s * a[2])


def times(a: Vector, b: Vector) -> Any:
    """Return the product component by component: a diagonal matrix times a vector."""
    return (a[0] * b[0], a[1] * b[1], a[2] * b[2])


def apply(rows: Sequence[Vector], b: Vector) -> Any:
    """Return the product of the matrix with these rows and b."""
    return (dot(rows[0], b), dot(rows[1], b), dot(rows[2], b))


def invert(columns: Sequence[Vector]) -> Any:
    """Return the rows of the inverse of the matrix with these columns, and one over its determinant.

    Cramer's rule needs one division and no branch, and stays in registers.
    """
    c0, c1, c2 = columns
    c12 = cross(c1, c2)
    over = 1.0 / dot(c0, c12)
    return (scale(over, c12), scale(over, cross(c2, c0)), scale(over, cross(c0, c1))), over


def inverse(columns: Sequence[Vector]) -> Any:
    """Return the rows of the inverse of the matrix with these columns."""
    return invert(columns)[0]


def product(q: Sequence[Any], p: Sequence[Any]) -> Any:
    """Return the quaternion product, scalar first."""
    return (
        fuse(-q[3], p[3], fuse(-q[2], p[2], fuse(-q[1], p[1], q[0] * p[0]))),
        fuse(-q[3], p[2], fuse(q[2], p[3], fuse(q[1], p[0], q[0] * p[1]))),
        fuse(q[3], p[1], fuse(q[2], p[0], fuse(-q[1], p[3], q[0] * p[2]))),
        fuse(q[3], p[0], fuse(-q[2], p[1], fuse(q[1], p[2], q[0] * p[3]))),
    )


def turn(q: Sequence[Any], v: Vector) -> Any:
    """Return the quaternion product q (0, v) without the products by zero."""
    return (
        -fuse(q[3], v[2], fuse(q[2], v[1], q[1] * v[0])),
        fuse(q[0], v[0], fuse(q[2], v[2], -(q[3] * v[1]))),
        fuse(q[0], v[1], fuse(q[3], v[0], -(q[1] * v[2]))),
        fuse(q[0], v[2], fuse(q[1], v[1], -(q[2] * v[0]))),
    )


def _square(q: Sequence[Any]) -> Any:
    return fuse(q[3], q[3], fuse(q[2], q[2], fuse(q[1], q[1], q[0] * q[0])))


def vertical(q: Sequence[Any]) -> Any:
    """Return the world's e_z in the axes that the quaternion q, of any length, turns into world axes."""
    n = 1.0 / _square(q)
    return (
        2.0 * n * fuse(q[1], q[3], -(q[0] * q[2])),
        2.0 * n * fuse(q[2], q[3], q[0] * q[1]),
        n * fuse(q[3], q[3], fuse(-q[2], q[2], fuse(-q[1], q[1], q[0] * q[0]))),
    )


def in_body(q: Sequence[Any], v: Vector) -> Any:
    """Return a world vector v in the axes that the quaternion q, of any length, turns into world axes."""
    n, r = in_long_body(q, v)
    return scale(n, r)


def in_long_body(q: Sequence[Any], v: Vector) -> Any:
    """Return 1 / |q|^2 and |q|^2 times the result of `in_body`, apart: an error of |q|^2 then changes no direction."""
    u = (-q[1], -q[2], -q[3])
    t, uv = cross(u, v), dot(u, v)
    along, across, rest = 2.0 * uv, 2.0 * q[0], fuse(q[0], q[0], -dot(u, u))
    return 1.0 / _square(q), tuple(fuse(rest, v[k], fuse(along, u[k], across * t[k])) for k in range(3))


def swing(a: Vector, c: Vector) -> Any:
    """Return s and v with M c = c + s v, half of the way c + 2 s v from c to Cay(2 a) c."""
    ac = cross(a, c)
    return 1.0 / (1.0 + dot(a, a)), add(ac, cross(a, ac))


def halfway(a: Vector, c: Vector) -> Any:
    """Return M c with M = (1 + Cay(2 a))/2, and its derivative by a (three columns).

    M c is the mean of c over a step, in the axes of its start: M = 1 + (hat(a) + hat(a)^2) / (1 + a.a), and M' is M at -a.
    """
    s, v = swing(a, c)
    m = add(c, scale(s, v))
    # d(M c)/da_k = s (e_k x c + (a.c) e_k + c_k a - 2 a_k M c)
    f, t = dot(a, c), scale(2.0, m)
    turned = ((f, -c[2], c[1]), (c[2], f, -c[0]), (-c[1], c[0], f))
    columns = [scale(s, tuple(fuse(c[k], a[i], fuse(-a[k], t[i], turned[k][i])) for i in range(3))) for k in range(3)]
    return m, tuple(columns)


def accumulate(total: Any, carry: Any, increment: Any) -> Any:
    """Return a compensated (Kahan) sum, and by how much it is too large after rounding: the `carry` of the next call."""
    wanted = increment - carry
    new = total + wanted
    return new, (new - total) - wanted
