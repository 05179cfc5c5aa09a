"""Whether samples keep what a motion keeps, at once: what every run of a compiled method is asked.

Source: the definitions in `conservative.invariants`, which is asked sample by sample where the answer here is no.
"""

from __future__ import annotations

from . import kernel, small


@small
def departure(R, w, V, J, constants):
    """Sum of the sizes of what an attitude R (3, 3) and rates w (3,) are off by, as `are_kept` has it."""
    x = J[0, 0] * w[0] + J[0, 1] * w[1] + J[0, 2] * w[2]
    y = J[1, 0] * w[0] + J[1, 1] * w[1] + J[1, 2] * w[2]
    z = J[2, 0] * w[0] + J[2, 1] * w[1] + J[2, 2] * w[2]
    energy = 0.5 * (x * w[0] + y * w[1] + z * w[2]) + V
    total = abs((energy - constants[0, 3]) * constants[0, 0])
    X = R[0, 0] * x + R[0, 1] * y + R[0, 2] * z
    Y = R[1, 0] * x + R[1, 1] * y + R[1, 2] * z
    Z = R[2, 0] * x + R[2, 1] * y + R[2, 2] * z
    for row in range(1, 4):
        total += abs(constants[row, 0] * X + constants[row, 1] * Y + constants[row, 2] * Z - constants[row, 3])
    return total + abs(constants[4, 0] * x + constants[4, 1] * y + constants[4, 2] * z - constants[4, 3])


@small
def skewness(R):
    """Sum of the sizes of the components of R'R - 1, those off the diagonal once."""
    total = abs(R[0, 0] * R[0, 0] + R[1, 0] * R[1, 0] + R[2, 0] * R[2, 0] - 1.0)
    total += abs(R[0, 1] * R[0, 1] + R[1, 1] * R[1, 1] + R[2, 1] * R[2, 1] - 1.0)
    total += abs(R[0, 2] * R[0, 2] + R[1, 2] * R[1, 2] + R[2, 2] * R[2, 2] - 1.0)
    total += abs(R[0, 0] * R[0, 1] + R[1, 0] * R[1, 1] + R[2, 0] * R[2, 1])
    total += abs(R[0, 1] * R[0, 2] + R[1, 1] * R[1, 2] + R[2, 1] * R[2, 2])
    return total + abs(R[0, 2] * R[0, 0] + R[1, 2] * R[1, 0] + R[2, 2] * R[2, 0])


@kernel
def are_kept(dt, every, n_steps, t, R_WB, w_WB_B, V, J, constants, drift, orthonormality):
    """Whether all samples are at their times, finite and within the bounds; where it is close, the answer may be no.

    Times are t (n,), s, attitudes R_WB (n, 3, 3), rates w_WB_B (n, 3), rad/s, body axes, V potential energies (n,), J, and J
    the inertia (3, 3), kg m^2, body axes. With `constants` (5, 4), each row a, b, c, d, what is kept to `drift` is

        row 0        (energy - d) a
        rows 1 to 3  (a, b, c) . R J w - d
        row 4        (a, b, c) . J w - d
    """
    for i in range(len(t)):
        # Samples end with the last step, which is no multiple of `every` where that does not divide n_steps.
        if t[i] != min(i * every, n_steps) * dt:
            return False
        # No comparison with what is not a number is true.
        if not (skewness(R_WB[i]) <= orthonormality and departure(R_WB[i], w_WB_B[i], V[i], J, constants) <= drift):
            return False
    return True
