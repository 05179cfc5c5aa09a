"""Largest drifts of the invariants of n bodies over their samples.

Definitions are in `conservative.invariants`; `conservative.drifts` fills the reference values.
"""

from __future__ import annotations

import math

from . import entry, small


@small
def transform(A, x):
    """Return A x for a matrix A (3, 3) and a vector x (3,)."""
    return (
        A[0, 0] * x[0] + A[0, 1] * x[1] + A[0, 2] * x[2],
        A[1, 0] * x[0] + A[1, 1] * x[1] + A[1, 2] * x[2],
        A[2, 0] * x[0] + A[2, 1] * x[1] + A[2, 2] * x[2],
    )


@small
def largest_skewness(R):
    """Return the largest component of |R'R - 1|."""
    worst = abs(R[0, 0] * R[0, 0] + R[1, 0] * R[1, 0] + R[2, 0] * R[2, 0] - 1.0)
    worst = max(worst, abs(R[0, 1] * R[0, 1] + R[1, 1] * R[1, 1] + R[2, 1] * R[2, 1] - 1.0))
    worst = max(worst, abs(R[0, 2] * R[0, 2] + R[1, 2] * R[1, 2] + R[2, 2] * R[2, 2] - 1.0))
    worst = max(worst, abs(R[0, 0] * R[0, 1] + R[1, 0] * R[1, 1] + R[2, 0] * R[2, 1]))
    worst = max(worst, abs(R[0, 1] * R[0, 2] + R[1, 1] * R[1, 2] + R[2, 1] * R[2, 2]))
    return max(worst, abs(R[0, 2] * R[0, 0] + R[1, 2] * R[1, 0] + R[2, 2] * R[2, 0]))


@entry
def measure(dt, every, n_steps, t, R_WB, w_WB_B, V, impulse, rotor, reference, drifts):
    """Measure the largest drifts of n bodies over m samples.

    Parameters
    ----------
    dt, every, n_steps, t
        Step, s, and number of steps of the grid, and the times (m,), s, at which the samples should be its.
    R_WB, w_WB_B
        Attitudes (n, m, 3, 3), body to world, and rates (n, m, 3), rad/s, body axes.
    V
        Energies (n, m), J, to add to the kinetic ones; (0, 0) if there are none.
    impulse
        Impulses (n, m, 3) of loads, N m s, world axes, to subtract from the momenta; None without loads.
    rotor
        Momentum (3,) of the rotor of all bodies, kg m^2/s, body axes; None without one.
    reference
        Rows (n, 10, 3). With J the inertia, kg m^2, and S the reference scale of momentum, kg m^2/s:

            0 to 2    J, body axes
            3 to 5    directions along which momentum is conserved, world axes, divided by S; otherwise 0
            6         the initial momentum along them, divided by S
            7         the symmetry axis, body axes, divided by S; otherwise 0
            8         initial energy, J; 1 / reference scale of the energy; initial axial momentum / S
            9         weights of energy, momentum and axial momentum in the last column of `drifts`; 0 if not conserved
    drifts
        Filled with the largest drifts (n, 5), dimensionless: orthonormality, energy, momentum, axial momentum, and the largest
        of the last three times their weights. They are nan if a sample is not finite, or not at its time.
    """
    for k in range(len(t)):
        # The last sample belongs to the last step, whose number need not be a multiple of `every`.
        if t[k] != min(k * every, n_steps) * dt:
            drifts[:] = math.nan
            return
    for i in range(len(R_WB)):
        at, axes = reference[i], reference[i, 3:6]
        skew = energy = momentum = axial = total = 0.0
        for k in range(len(t)):
            R, w = R_WB[i, k], w_WB_B[i, k]
            L_B = transform(at, w)
            E = 0.5 * (L_B[0] * w[0] + L_B[1] * w[1] + L_B[2] * w[2])
            if len(V):
                E += V[i, k]
            if rotor is not None:
                L_B = (L_B[0] + rotor[0], L_B[1] + rotor[1], L_B[2] + rotor[2])
            L = transform(axes, transform(R, L_B))
            a, b, c = L[0] - at[6, 0], L[1] - at[6, 1], L[2] - at[6, 2]
            if impulse is not None:
                S = transform(axes, impulse[i, k])
                a, b, c = a - S[0], b - S[1], c - S[2]
            of_R = largest_skewness(R)
            of_energy = abs((E - at[8, 0]) * at[8, 1])
            of_momentum = a * a + b * b + c * c
            of_axial = abs(at[7, 0] * L_B[0] + at[7, 1] * L_B[1] + at[7, 2] * L_B[2] - at[8, 2])
            skew, energy = max(skew, of_R), max(energy, of_energy)
            momentum, axial = max(momentum, of_momentum), max(axial, of_axial)
            total += of_R + of_energy + of_momentum + of_axial  # a sum is nan if a term is, a maximum need not be
        momentum = math.sqrt(momentum)
        if math.isfinite(total):
            drifts[i, 0], drifts[i, 1], drifts[i, 2], drifts[i, 3] = skew, energy, momentum, axial
            drifts[i, 4] = max(energy * at[9, 0], max(momentum * at[9, 1], axial * at[9, 2]))
        else:
            drifts[i] = math.nan
