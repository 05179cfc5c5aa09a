"""Samples of many bodies in body axes, out of the quaternions and rates of lanes."""

from __future__ import annotations

from . import small
from .lanes import WIDTH, save
from .vector import dot

ROOM = 12 * WIDTH
"""Floats that `store_sample` needs room for."""


@small
def rotation(q):
    """Rows of the matrix of a quaternion of any length."""
    w, x, y, z = q
    s = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        (1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)),
        (s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)),
        (s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)),
    )


@small
def store_sample(q, w, rows, first, sample, room, R_WB, w_WB_B):
    """Write a sample of the bodies from number `first` on, as many as there are, to R_WB (n, s, 3, 3) and w_WB_B (n, s, 3).

    q (4) and w (3) are attitude and rate in axes of the kernel, `rows` those of the matrix R that turns these to the body's.
    """
    R, count = rotation(q), min(WIDTH, len(R_WB) - first)
    for k in range(3):
        for j in range(3):
            save(room, (3 * j + k) * WIDTH, dot(R[j], rows[k]))
        save(room, (9 + k) * WIDTH, dot(w, rows[k]))
    for lane in range(count):
        for j in range(3):
            for k in range(3):
                R_WB[first + lane, sample, j, k] = room[(3 * j + k) * WIDTH + lane]
            w_WB_B[first + lane, sample, j] = room[(9 + j) * WIDTH + lane]
