"""Three-vectors, quaternions and 3 x 3 systems as tuples of floats, which compile to registers."""

from __future__ import annotations

from . import small
from .lanes import fuse


@small
def dot(a, b):
    """a . b"""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@small
def cross(a, b):
    """a x b"""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@small
def add(a, b):
    """a + b"""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@small
def subtract(a, b):
    """a - b"""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@small
def scale(s, a):
    """s a"""
    return (s * a[0], s * a[1], s * a[2])


@small
def times(a, b):
    """Component by component: a diagonal matrix times a vector."""
    return (a[0] * b[0], a[1] * b[1], a[2] * b[2])


@small
def product(q, p):
    """Quaternion product, scalar first."""
    return (
        q[0] * p[0] - q[1] * p[1] - q[2] * p[2] - q[3] * p[3],
        q[0] * p[1] + q[1] * p[0] + q[2] * p[3] - q[3] * p[2],
        q[0] * p[2] - q[1] * p[3] + q[2] * p[0] + q[3] * p[1],
        q[0] * p[3] + q[1] * p[2] - q[2] * p[1] + q[3] * p[0],
    )


@small
def turn(q, v):
    """The product q (0, v), without products by zero; which product is rounded is said, for the same bits in lanes."""
    return (
        -fuse(q[3], v[2], fuse(q[2], v[1], q[1] * v[0])),
        fuse(q[0], v[0], fuse(q[2], v[2], -(q[3] * v[1]))),
        fuse(q[0], v[1], fuse(q[3], v[0], -(q[1] * v[2]))),
        fuse(q[0], v[2], fuse(q[1], v[1], -(q[2] * v[0]))),
    )


@small
def vertical(q):
    """World e_z in the axes that the quaternion q turns into world axes: the last row of its matrix, over |q|^2."""
    n = 1.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (
        2.0 * n * (q[1] * q[3] - q[0] * q[2]),
        2.0 * n * (q[2] * q[3] + q[0] * q[1]),
        n * (q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3]),
    )


@small
def invert(columns):
    """Rows of the inverse of the matrix with these columns, and one over its determinant.

    By Cramer's rule: one division, no branch, all in registers.
    """
    c0, c1, c2 = columns
    c12 = cross(c1, c2)
    over = 1.0 / dot(c0, c12)
    return (scale(over, c12), scale(over, cross(c2, c0)), scale(over, cross(c0, c1))), over


@small
def inverse(columns):
    """Rows of the inverse of the matrix with these columns."""
    return invert(columns)[0]


@small
def apply(rows, b):
    """The matrix with these rows times b."""
    return (dot(rows[0], b), dot(rows[1], b), dot(rows[2], b))


@small
def accumulate(total, carry, increment):
    """Compensated (Kahan) sum: the new total and what it lost, to be handed back with the next increment."""
    wanted = increment - carry
    new = total + wanted
    return new, (new - total) - wanted
