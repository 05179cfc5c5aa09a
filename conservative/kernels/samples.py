"""Samples in body axes from the results of kernels: quaternions and momenta in principal axes."""

from __future__ import annotations

import math

from . import entry
from .compiler.signals import call_handlers, end_of_block
from .compiler.vector import product

BLOCK = 2**18
"""Samples between two calls of handlers of signals."""


@entry
def to_body_axes(t, q, L, J_inverse, spin, R_BP, R_WB, w_WB_B):
    """Fill R_WB (n, 3, 3) and w_WB_B (n, 3) from the first n of q (., 4), of any length, and L (., 3), at times t (.,).

    `spin` is None, or the rate about the third axis, rad/s, by which the body turns relative to the frame of q, and 1/J3.
    `R_BP` is None if principal and body axes are the same. Without them, their products are left out. Return the number of
    samples before the first one that is not finite.
    """
    finite = 0
    done, n = 0, len(R_WB)
    while done < n:
        last = end_of_block(done, n, BLOCK)
        for i in range(done, last):
            rates = (L[i, 0] * J_inverse[0], L[i, 1] * J_inverse[1], L[i, 2] * J_inverse[2])
            w, x, y, z = q[i, 0], q[i, 1], q[i, 2], q[i, 3]
            if spin is not None:
                cos, sin = math.cos(0.5 * spin[0] * t[i]), math.sin(0.5 * spin[0] * t[i])
                w, x, y, z = product((w, x, y, z), (cos, 0.0, 0.0, sin))
                # Rates turn by the whole angle, whose half is in the quaternion.
                c, s = 1.0 - 2.0 * sin * sin, 2.0 * sin * cos
                rates = (c * rates[0] + s * rates[1], c * rates[1] - s * rates[0], L[i, 2] * spin[1])
            s = 2.0 / (w * w + x * x + y * y + z * z)
            rows = (
                (1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)),
                (s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)),
                (s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)),
            )
            size = 0.0
            for j in range(3):
                if R_BP is None:
                    R_WB[i, j, 0], R_WB[i, j, 1], R_WB[i, j, 2] = rows[j]
                    w_WB_B[i, j] = rates[j]
                else:
                    for k in range(3):
                        R_WB[i, j, k] = rows[j][0] * R_BP[k, 0] + rows[j][1] * R_BP[k, 1] + rows[j][2] * R_BP[k, 2]
                    w_WB_B[i, j] = R_BP[j, 0] * rates[0] + R_BP[j, 1] * rates[1] + R_BP[j, 2] * rates[2]
                size += abs(R_WB[i, j, 0]) + abs(R_WB[i, j, 1]) + abs(R_WB[i, j, 2]) + abs(w_WB_B[i, j])
            # One test for twelve numbers. Later samples do not count once one is not finite.
            if finite == i and math.isfinite(size):
                finite = i + 1
        done = last
        if done < n:
            call_handlers()
    return finite


@entry
def of_many(t, q, L, J_inverse, spin, R_BP, places, R_WB, w_WB_B):
    """`to_body_axes` of k bodies, whose places among n are `places` (k,): all other arrays have one more axis in front.

    R_WB and w_WB_B are of all n bodies, q and L of k or more; spin is (k, 2) or None.
    """
    for i in range(len(places)):
        J, to = (J_inverse[i, 0], J_inverse[i, 1], J_inverse[i, 2]), places[i]
        if spin is None:
            to_body_axes(t, q[i], L[i], J, None, R_BP[i], R_WB[to], w_WB_B[to])
        else:
            to_body_axes(t, q[i], L[i], J, (spin[i, 0], spin[i, 1]), R_BP[i], R_WB[to], w_WB_B[to])
