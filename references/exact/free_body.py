"""The motion of a free rigid body in closed form (Jacobi 1849; Whittaker, Analytical Dynamics, 69; van Zon & Schofield 2007).

In principal axes, ordered so that 2 is the intermediate one and the momentum stays on the side of +3,

    L = (L1max cn v, L2max sn v, L3max dn v),     v = v0 + Omega t.

With m = L/|L| the attitude relative to the fixed momentum is R = Rz(2 chi) P(m), where P is the smallest rotation from m to
e_z, which is regular for m3 > 0. Then

    2 chi' = |L|/J3 + (2T/|L| - |L|/J3) / (1 + m3),

This has a pole at 1 + m3 = 0, that is dn v = -|L|/L3max. Therefore exp(i chi) is the phase of exp(i mu t) theta_4(v - i y) with
quarter periods (K, 2 K') and dc(y, 1 - m) = |L|/L3max.
"""

from __future__ import annotations

import numpy as np

from conservative.attitude import Array

from .digits import (
    Matrix,
    Phase,
    Vector,
    as_array,
    cayley_klein_in_double,
    cross,
    from_cayley_klein,
    mp,
    multiply,
    rotation_phase,
)
from .start import InitialState, Solution
from .theta import Lattice, Points, jacobi, theta


def order_axes(start: InitialState) -> tuple[Vector, Vector, Matrix]:
    """Return moments and momentum in axes 1, 2, 3 as above, and these axes (R_BP), with L1 and L3 not negative.

    The sign of |L|^2 - 2 T J2 determines the axis that the momentum circles.
    """
    J, axes = start.principal
    w = start.rates(axes)
    a, b, c = sorted(range(3), key=lambda i: J[i])
    around_small = w[a] ** 2 * J[a] * (J[b] - J[a]) > w[c] ** 2 * J[c] * (J[c] - J[b])
    order = (c, b, a) if around_small else (a, b, c)
    signs = [mp.mpf(-1 if w[i] < 0 else 1) for i in order]
    columns = [[axes[row, i] * sign for row in range(3)] for i, sign in zip(order, signs, strict=True)]
    columns[1] = cross(columns[2], columns[0])
    R_BP = mp.matrix(columns).T
    moments = [J[i] for i in order]
    return moments, [j * w for j, w in zip(moments, start.rates(R_BP), strict=True)], R_BP


def free_motion(start: InitialState) -> Solution:
    """Return the motion of an initial state that is not steady."""
    J, L, R_BP = order_axes(start)
    # 1/J_i - 1/J_j: all have one sign, so that no sum of them cancels.
    gap_12, gap_13, gap_23 = ((J[j] - J[i]) / (J[i] * J[j]) for i, j in ((0, 1), (0, 2), (1, 2)))
    size, excess = mp.norm(L), L[0] ** 2 * gap_13 + L[1] ** 2 * gap_23  # |L| and 2T - |L|^2/J3
    third = (L[1] ** 2 * gap_12 + L[2] ** 2 * gap_13) / gap_13
    largest = [mp.sqrt(excess / gap_13), mp.sqrt(excess / gap_23), mp.sqrt(third)]
    # 1 - m = (L3min/L3max)^2. L3min^2 is the only difference. Without divisions it is exact, so it is 0 on the separatrix.
    (J1, J2, J3), (L1, _, L3) = J, L
    least = (J1 * (J3 - J2) * L3**2 - J3 * (J2 - J1) * L1**2) / (J1 * (J3 - J2))
    m = (largest[1] / largest[2]) ** 2 * gap_12 / gap_13
    lattice = Lattice.of(m, max(least / largest[2] ** 2, mp.mpf(0)))
    omega = gap_13 * largest[0] * largest[2] / largest[1]
    cn, sn, dn = (a / b for a, b in zip(L, largest, strict=True))
    v0 = sn * mp.elliprf(cn**2, dn**2, 1)
    # K' - y = A F(1 - A^2, 1 - A^2 (1 - m), 1) with Carlson's F and A = L3max/|L|, also if K' is infinite.
    L1max, L2max, L3max = (x / size for x in largest)
    rest = L3max * mp.elliprf(L1max**2, L1max**2 + L2max**2 * gap_12 / gap_13, 1)
    phase = theta(Lattice(lattice.K, 2 * lattice.K_prime), 4, lattice.K_prime - rest, lattice.K_prime + rest)
    value, slope = phase.value_and_slope(mp.mpf(0))
    mu = (size / J3 + excess / size / (1 + L3max)) / 2 - omega * (slope / value).imag
    # The smallest rotation from the direction of L, whose third component is positive, to e_z.
    x, y, z = (component / size for component in L)
    k = 1 / (1 + z)
    R_lP0 = mp.matrix([[1 - x * x * k, -x * y * k, -x], [-x * y * k, 1 - y * y * k, -y], [x, y, z]])
    q_Wl, q_PB = cayley_klein_in_double(start.attitude * R_BP * R_lP0.T), cayley_klein_in_double(R_BP.T)
    argument, turn = Phase(v0, omega, 2 * lattice.K), rotation_phase(-mp.arg(phase.value_and_slope(v0)[0]), mu)
    shape, inverse_J = np.array([float(x / size) for x in largest]), np.array([float(1 / x) for x in J])
    parts, axes = jacobi(lattice), as_array(R_BP)

    def at(t: Array) -> tuple[Array, Array]:
        v, odd = argument.reduce(t)
        points = Points(lattice, v)
        sn, cn, dn = (points.quotient(part).real for part in parts)
        flip = 1 - 2 * odd
        m = np.stack([flip * cn, flip * sn, dn], axis=-1) * shape
        chi = turn.phasor(t) * Points(phase.lattice, v).theta(phase)
        q_lP = (chi * (1 + m[:, 2]), chi * (m[:, 1] - 1j * m[:, 0]))
        return from_cayley_klein(*multiply(multiply(q_Wl, q_lP), q_PB)), (m * (float(size) * inverse_J)) @ axes.T

    return at
