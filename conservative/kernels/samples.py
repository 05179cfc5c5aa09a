"""Samples in body axes from the results of kernels: quaternions and momenta in principal axes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from . import entry, kernel
from .compiler.signals import call_handlers, end_of_block
from .compiler.vector import product

BLOCK = 2**18
"""Samples between two calls of handlers of signals."""
SPIN, ALONG, TURNED, R_BP, RATE, NORMAL, DISTANCE, END = 3, 4, 5, 6, 15, 16, 19, 20
"""Places of the numbers that `gather_axes` describes; J_inverse is in front."""


def gather_axes(J_inverse: Any, spin: Any, rotation: Any, orbit: Any = None, dt: float = 0.0) -> Any:
    """Return the numbers (20,) by which `fill` converts samples: one array, because each argument takes time.

    They are J_inverse (3,), 1/(kg m^2); the rate about the third axis, rad/s, by which the body turns relative to the frame of
    the samples, and 1/J3, both 0 without `spin`; 1 if a `rotation` (3, 3) from the frame's to body axes follows, and its
    numbers; rate, rad/s, and normal of the axes O if the samples are relative to the axes of an `orbit`, otherwise 0; and the
    step, s.
    """
    axes = np.zeros(END)
    axes[:3], axes[DISTANCE] = J_inverse, dt
    if spin is not None:
        axes[SPIN:TURNED] = spin
    if rotation is not None:
        axes[TURNED], axes[R_BP:RATE] = 1.0, np.reshape(rotation, 9)
    if orbit is not None:
        axes[RATE:DISTANCE] = orbit.rate, *orbit.normal_W
    return axes


@kernel
def rows_of(w, x, y, z):
    """Return the rows of the rotation of a quaternion of any length."""
    s = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        (1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)),
        (s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)),
        (s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)),
    )


@kernel
def turn_by_orbit(axes, t, i, R_WB):
    """Turn sample i from the axes of an orbit to world axes at a time t, s."""
    half = 0.5 * axes[RATE] * t
    s = math.sin(half)
    turn = rows_of(math.cos(half), s * axes[NORMAL], s * axes[NORMAL + 1], s * axes[NORMAL + 2])
    for k in range(3):
        x, y, z = R_WB[i, 0, k], R_WB[i, 1, k], R_WB[i, 2, k]
        for j in range(3):
            R_WB[i, j, k] = turn[j][0] * x + turn[j][1] * y + turn[j][2] * z


@entry
def fill(t, every, n_steps, q, L, axes, R_WB, w_WB_B):
    """Fill R_WB (n, 3, 3) and w_WB_B (n, 3) from the first n of q (., 4), of any length, and L (., 3).

    `axes` are from `gather_axes`. Their times are t (n,), s, or if t is empty every `every`-th of n_steps steps, and the last.
    Products without effect are left out. Return the number of samples before the first one that is not finite.
    """
    finite = 0
    done, n = 0, len(R_WB)
    while done < n:
        last = end_of_block(done, n, BLOCK)
        for i in range(done, last):
            rates = (L[i, 0] * axes[0], L[i, 1] * axes[1], L[i, 2] * axes[2])
            w, x, y, z = q[i, 0], q[i, 1], q[i, 2], q[i, 3]
            time = t[i] if len(t) else min(i * every, n_steps) * axes[DISTANCE]
            if axes[ALONG] != 0.0:
                cos, sin = math.cos(0.5 * axes[SPIN] * time), math.sin(0.5 * axes[SPIN] * time)
                w, x, y, z = product((w, x, y, z), (cos, 0.0, 0.0, sin))
                # Rates turn by the whole angle, whose half is in the quaternion.
                c, s = 1.0 - 2.0 * sin * sin, 2.0 * sin * cos
                rates = (c * rates[0] + s * rates[1], c * rates[1] - s * rates[0], L[i, 2] * axes[ALONG])
            rows = rows_of(w, x, y, z)
            size = 0.0
            for j in range(3):
                if axes[TURNED] == 0.0:
                    R_WB[i, j, 0], R_WB[i, j, 1], R_WB[i, j, 2] = rows[j]
                    w_WB_B[i, j] = rates[j]
                else:
                    for k in range(3):
                        a, b, c = axes[R_BP + 3 * k], axes[R_BP + 3 * k + 1], axes[R_BP + 3 * k + 2]
                        R_WB[i, j, k] = rows[j][0] * a + rows[j][1] * b + rows[j][2] * c
                    a, b, c = axes[R_BP + 3 * j], axes[R_BP + 3 * j + 1], axes[R_BP + 3 * j + 2]
                    w_WB_B[i, j] = a * rates[0] + b * rates[1] + c * rates[2]
                size += abs(R_WB[i, j, 0]) + abs(R_WB[i, j, 1]) + abs(R_WB[i, j, 2]) + abs(w_WB_B[i, j])
            if axes[RATE] != 0.0:
                turn_by_orbit(axes, time, i, R_WB)
            # One test for twelve numbers. Later samples do not count once one is not finite.
            if finite == i and math.isfinite(size):
                finite = i + 1
        done = last
        if done < n:
            call_handlers()
    return finite


@entry
def of_many(t, q, L, J_inverse, spin, rotations, places, R_WB, w_WB_B):
    """`fill` of k bodies, whose places among n are `places` (k,): all other arrays have one more axis in front.

    R_WB and w_WB_B are of all n bodies, q and L of k or more; spin is (k, 2) or None.
    """
    axes = np.zeros(END)
    axes[TURNED] = 1.0
    for i in range(len(places)):
        to = places[i]
        axes[0], axes[1], axes[2] = J_inverse[i, 0], J_inverse[i, 1], J_inverse[i, 2]
        for j in range(9):
            axes[R_BP + j] = rotations[i, j // 3, j % 3]
        if spin is not None:
            axes[SPIN], axes[ALONG] = spin[i, 0], spin[i, 1]
        fill(t, 1, len(t), q[i], L[i], axes, R_WB[to], w_WB_B[to])
