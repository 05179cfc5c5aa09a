"""Rotations: the hat map, the Cayley map, quaternions (scalar first), angles and orthonormality.

Functions are vectorised over leading axes. `R_WB` maps body components to world components. Source: M. D. Shuster, A survey of
attitude representations (1993).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arithmetic import cross

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

ROTATION_TOLERANCE = 1e-9
"""Largest |R'R - 1| of an attitude that a user passes."""


def hat(v: ArrayLike) -> Array:
    """Return the skew matrices (..., 3, 3) with `hat(v) @ x == cross(v, x)` for v (..., 3)."""
    v = np.asarray(v, dtype=float)
    out = np.zeros((*v.shape[:-1], 3, 3))
    out[..., 2, 1], out[..., 0, 2], out[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    out[..., 1, 2], out[..., 2, 0], out[..., 0, 1] = -v[..., 0], -v[..., 1], -v[..., 2]
    return out


def cayley(v: ArrayLike) -> Array:
    """Return Cay(v) = (1 - hat(v)/2)^-1 (1 + hat(v)/2), (..., 3, 3), for v (..., 3): the rotation by 2 atan(|v|/2) about v."""
    half = np.asarray(v, dtype=float) / 2
    skew = hat(half)
    scale = 2 / (1 + np.sum(half * half, axis=-1))[..., None, None]
    return np.eye(3) + scale * (skew + skew @ skew)


def from_quaternion(q: ArrayLike) -> Array:
    """Return matrices (..., 3, 3) of quaternions (..., 4), scalar first.

    A quaternion of norm n gives n^2 times a rotation, so the drift of a method's quaternion shows as lost orthonormality.
    """
    w, x, y, z = np.moveaxis(np.asarray(q, dtype=float), -1, 0)
    ww, xx, yy, zz = w * w, x * x, y * y, z * z
    R = np.empty((*np.shape(w), 3, 3))  # written in place: stacking takes twice as long, and engines are timed with it
    R[..., 0, 0], R[..., 0, 1], R[..., 0, 2] = ww + xx - yy - zz, 2 * (x * y - w * z), 2 * (x * z + w * y)
    R[..., 1, 0], R[..., 1, 1], R[..., 1, 2] = 2 * (x * y + w * z), ww - xx + yy - zz, 2 * (y * z - w * x)
    R[..., 2, 0], R[..., 2, 1], R[..., 2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), ww - xx - yy + zz
    return R


_ROWS = np.array([[0, 4, 5, 6], [4, 1, 7, 8], [5, 7, 2, 9], [6, 8, 9, 3]])
"""Places of 4 w q, 4 x q, 4 y q and 4 z q among the products in `to_quaternion`."""


def to_quaternion(R: ArrayLike) -> Array:
    """Return unit quaternions (..., 4), scalar first, of rotation matrices (..., 3, 3).

    The formula with the largest component is used (Shepperd 1978). The scalar part is not negative.
    """
    R = np.asarray(R, dtype=float)
    xx, yy, zz = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    wx, wy, wz = R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]
    xy, xz, yz = R[..., 0, 1] + R[..., 1, 0], R[..., 0, 2] + R[..., 2, 0], R[..., 1, 2] + R[..., 2, 1]
    squares = (1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz)
    products = np.stack([*squares, wx, wy, wz, xy, xz, yz], axis=-1)
    q = np.take_along_axis(products, _ROWS[np.argmax(products[..., :4], axis=-1)], axis=-1)
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.where(q[..., :1] < 0, -q, q)


def angle_between(R_ref: ArrayLike, R: ArrayLike) -> Array:
    """Return the angle in rad, (...), of R_ref' R for attitudes (..., 3, 3).

    2 asin(|R - R_ref|_F / sqrt 8) has full relative accuracy at small angles, where acos of the trace loses half the digits.
    """
    difference = np.asarray(R, dtype=float) - np.asarray(R_ref, dtype=float)
    chord = np.sqrt(np.sum(difference * difference, axis=(-2, -1)) / 8)
    return 2 * np.arcsin(np.where(chord > 1, 1.0, chord))


def orthonormality(R: ArrayLike) -> Array:
    """Return the largest component of |R'R - 1|, (...), dimensionless, for matrices (..., 3, 3)."""
    R = np.asarray(R, dtype=float)
    gram = np.swapaxes(R, -1, -2) @ R - np.eye(3)
    return np.abs(gram).max(axis=(-2, -1))


def rotation_about(axis: ArrayLike, angle: float) -> Array:
    """Return the rotation (3, 3) by `angle`, rad, about `axis` (3,) of any length."""
    axis = np.asarray(axis, dtype=float)
    n = axis / np.linalg.norm(axis)
    half = angle / 2
    return from_quaternion(np.concatenate([[np.cos(half)], np.sin(half) * n]))


def axes_about(axis: Array, beside: int | None = None) -> Array:
    """Return a rotation (3, 3) whose third column is the unit vector `axis` (3,).

    The first column is perpendicular to coordinate axis number `beside`, which must not be parallel to `axis`. The default of
    `beside` depends on `axis`; for e_z the result is the identity.
    """
    other = np.eye(3)[(np.argmax(np.abs(axis)) + 2) % 3 if beside is None else beside]
    first = np.array(cross(other.tolist(), axis.tolist()))
    first /= np.linalg.norm(first)
    return np.stack([first, cross(axis.tolist(), first.tolist()), axis], axis=1)


def triple(values: Array) -> Triple:
    """Return an array (3,) as the tuple of floats that kernels accept."""
    x, y, z = values.tolist()
    return x, y, z
