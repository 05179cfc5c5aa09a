"""Samples of many bodies in body axes, computed from quaternions and rates in lanes."""

from __future__ import annotations

from . import small
from .lanes import save_columns
from .vector import dot


@small
def rotation(q):
    """Return the rows of the matrix of a quaternion of any length."""
    w, x, y, z = q
    s = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        (1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)),
        (s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)),
        (s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)),
    )


@small
def store_sample(q, w, axes, place, samples, R_WB, w_WB_B):
    """Write one sample of the bodies in the lanes.

    q (4) and w (3) are attitude and rates in axes of the kernel. `axes` (9) are the rows of the rotation from these to body
    axes. R_WB and w_WB_B are flat arrays with `samples` samples per body; `place` is the number of the first body's sample.
    """
    r0, r1, r2 = rotation(q)
    a, b, c = axes[0:3], axes[3:6], axes[6:9]
    rows = (dot(r0, a), dot(r0, b), dot(r0, c), dot(r1, a), dot(r1, b), dot(r1, c), dot(r2, a), dot(r2, b), dot(r2, c))
    save_columns(R_WB, 9 * place, 9 * samples, rows)
    save_columns(w_WB_B, 3 * place, 3 * samples, (dot(w, a), dot(w, b), dot(w, c)))
