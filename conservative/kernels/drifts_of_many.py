"""How far the samples of many bodies are off what each conserves: compiled, as every block of bodies is asked.

Source: the definitions in `conservative.invariants`.
"""

from __future__ import annotations

import math

import numpy as np

from . import entry, kernel, small


@small
def turned(R, x):
    """Components R x of a vector x, R being (3, 3)."""
    return (
        R[0, 0] * x[0] + R[0, 1] * x[1] + R[0, 2] * x[2],
        R[1, 0] * x[0] + R[1, 1] * x[1] + R[1, 2] * x[2],
        R[2, 0] * x[0] + R[2, 1] * x[1] + R[2, 2] * x[2],
    )


@small
def largest_skewness(R):
    """Largest size of a component of R'R - 1."""
    worst = abs(R[0, 0] * R[0, 0] + R[1, 0] * R[1, 0] + R[2, 0] * R[2, 0] - 1.0)
    worst = max(worst, abs(R[0, 1] * R[0, 1] + R[1, 1] * R[1, 1] + R[2, 1] * R[2, 1] - 1.0))
    worst = max(worst, abs(R[0, 2] * R[0, 2] + R[1, 2] * R[1, 2] + R[2, 2] * R[2, 2] - 1.0))
    worst = max(worst, abs(R[0, 0] * R[0, 1] + R[1, 0] * R[1, 1] + R[2, 0] * R[2, 1]))
    worst = max(worst, abs(R[0, 1] * R[0, 2] + R[1, 1] * R[1, 2] + R[2, 1] * R[2, 2]))
    return max(worst, abs(R[0, 2] * R[0, 0] + R[1, 2] * R[1, 0] + R[2, 2] * R[2, 0]))


@kernel
def are_rotations(R, tolerance):
    """Which of n matrices (n, 3, 3) are orthonormal to a tolerance, with determinant +1: no comparison with nan is true."""
    found = np.empty(len(R), dtype=np.bool_)
    for i in range(len(R)):
        a = R[i]
        x = a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1]
        y = a[1, 2] * a[2, 0] - a[1, 0] * a[2, 2]
        z = a[1, 0] * a[2, 1] - a[1, 1] * a[2, 0]
        determinant = a[0, 0] * x + a[0, 1] * y + a[0, 2] * z
        found[i] = determinant > 0.0 and largest_skewness(a) <= tolerance
    return found


@entry
def find_start(R_WB, w_WB_B, V, J, axes, axial, field, largest, expected, scales):
    """Fill `expected` (n, 10), as `measure` takes it, and `scales` (n, 3): of energy, J, and of momentum, kg m^2/s, twice.

    Starts are R_WB (n, 3, 3) and w_WB_B (n, 3), rad/s, body axes; V (n,) J is what is added to their kinetic energies. `field`
    (n or 1,) is the size of the field, J, which is part of the energy's scale, `largest` (n or 1,) the largest moment, kg m^2,
    and `axial` (n or 1, 3) the axis of symmetry, body axes, 0 where there is none. The second scale of momentum is that of
    bounds: no less than all that the energy can make of it. Where there is nothing to be relative to, energies are relative
    to 1 J, and momenta to what that makes.
    """
    for i in range(len(R_WB)):
        inertia, along, w = J[min(i, len(J) - 1)], axes[min(i, len(axes) - 1)], w_WB_B[i]
        x, a = turned(inertia, w), axial[min(i, len(axial) - 1)]
        L, kinetic = turned(along, turned(R_WB[i], x)), 0.5 * (x[0] * w[0] + x[1] * w[1] + x[2] * w[2])
        energy = kinetic + field[min(i, len(field) - 1)]
        energy = energy if energy != 0.0 else 1.0
        most = math.sqrt(largest[min(i, len(largest) - 1)]) * math.sqrt(energy)
        size = math.hypot(math.hypot(x[0], x[1]), x[2])
        momentum = size if size > 0.0 else most
        scales[i, 0], scales[i, 1], scales[i, 2] = energy, momentum, max(momentum, math.sqrt(2.0) * most)
        expected[i, 0], expected[i, 5] = kinetic + V[i], 1.0 / momentum
        expected[i, 2], expected[i, 3], expected[i, 4] = L
        for k in range(3):
            expected[i, 7 + k] = a[k] / momentum
        expected[i, 6] = expected[i, 7] * x[0] + expected[i, 8] * x[1] + expected[i, 9] * x[2]


@entry
def measure(R_WB, w_WB_B, V, J, axes, expected, found):
    """Fill found (n, 4): the largest departure of each body's samples, nan if one of them is not finite.

    Its columns are orthonormality, energy, momentum along `axes` and axial momentum, relative to what `expected` (n, 10) says
    of each body: energy at the start and one over its scale; momentum (3) and one over its scale; axial momentum and its axis
    (3), body axes, both divided by their scale already.

    Attitudes are R_WB (n, s, 3, 3), rates w_WB_B (n, s, 3), rad/s, body axes, V potential energies (n, s), J, or (0, 0) where
    there are none. The inertia J, kg m^2, body axes, and the rows of `axes`, in which momenta are taken, are (n, 3, 3), or
    (1, 3, 3) where all bodies have the same.
    """
    n, samples = R_WB.shape[:2]
    for i in range(n):
        inertia, along, at = J[min(i, len(J) - 1)], axes[min(i, len(axes) - 1)], expected[i]
        skew = energy = momentum = axial = total = 0.0
        for k in range(samples):
            R, w = R_WB[i, k], w_WB_B[i, k]
            x = turned(inertia, w)
            E = 0.5 * (x[0] * w[0] + x[1] * w[1] + x[2] * w[2])
            if len(V):
                E += V[i, k]
            L = turned(along, turned(R, x))
            a, b, c = (L[0] - at[2]) * at[5], (L[1] - at[3]) * at[5], (L[2] - at[4]) * at[5]
            off = largest_skewness(R)
            skew = max(skew, off)
            off_energy = abs((E - at[0]) * at[1])
            energy = max(energy, off_energy)
            square = a * a + b * b + c * c
            momentum = max(momentum, square)
            off_axial = abs(at[7] * x[0] + at[8] * x[1] + at[9] * x[2] - at[6])
            axial = max(axial, off_axial)
            total += off + off_energy + square + off_axial  # of all parts, as a maximum may pass over what is not a number
        if math.isfinite(total):
            found[i, 0], found[i, 1], found[i, 2], found[i, 3] = skew, energy, math.sqrt(momentum), axial
        else:
            found[i] = math.nan
