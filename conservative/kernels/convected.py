"""The equations of Krenk & Nielsen, numbered as in the paper, on 9 + 9 unknowns.

Symbols of the paper, used in this file only:

    q = (q1, q2, q3)    base vectors, the columns of R_WB, one after the other, (9,)
    p = (p1, p2, p3)    their conjugate momenta, (9,), kg m^2/s
    u = (q, p)          the state, (18,);  a bar is the mean of both ends of a step
    mu                  mean of G(q) p over both ends: the mean OF THE PRODUCT, which energy conservation depends on
    nu                  J^-1 mu
    lam                 Lagrange multipliers (26);  V_star is the finite derivative of the potential
"""

from __future__ import annotations

import numpy as np

from . import brief, kernel
from .fields import finite_derivative


@kernel
def skew(a):
    """hat(a), (3, 3)"""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


@brief
def G(q):
    """(8): w = -1/2 G(q) qdot and G(q) p = -L, (3, 9). Linear in q, with G(a) b = -G(b) a."""
    out = np.zeros((3, 9))
    q1, q2, q3 = q[0:3], q[3:6], q[6:9]
    out[0, 3:6], out[0, 6:9] = -q3, q2
    out[1, 0:3], out[1, 6:9] = q3, -q1
    out[2, 0:3], out[2, 3:6] = -q2, q1
    return out


@kernel
def C(q):
    """(5): derivative of the six Green strains by q, (6, 9). Linear in q, with C(a) b = C(b) a."""
    out = np.zeros((6, 9))
    q1, q2, q3 = q[0:3], q[3:6], q[6:9]
    out[0, 0:3], out[1, 3:6], out[2, 6:9] = q1, q2, q3
    out[3, 3:6], out[3, 6:9] = q3, q2
    out[4, 0:3], out[4, 6:9] = q3, q1
    out[5, 0:3], out[5, 3:6] = q2, q1
    return out


@kernel
def times_identity(small):
    """Kronecker product of a (3, 3) matrix with the unit matrix, (9, 9): it acts on the index of the base vector."""
    out = np.zeros((9, 9))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                out[3 * i + k, 3 * j + k] = small[i, j]
    return out


@kernel
def H(nu):
    """The matrix with G(q)' nu = H(nu) q, (9, 9), skew."""
    return times_identity(skew(nu))


@kernel
def S(kappa):
    """The matrix with C(q)' kappa = S(kappa) q, (9, 9), symmetric."""
    k = kappa
    return times_identity(np.array([[k[0], k[5], k[4]], [k[5], k[1], k[3]], [k[4], k[3], k[2]]]))


@brief
def conjugate_momentum(q, L):
    """(12) on a rigid motion: [p1 p2 p3] = 1/2 Q hat(L), for which G(q) p = -L and (17) C(q) p = 0 hold, (9,)."""
    Q = q.copy().reshape(3, 3).T
    return (0.5 * (Q @ skew(L))).T.copy().reshape(9)


@brief
def residual_and_tangent(dt, J_inverse, V_star, dV_star, q0, p0, q1, p1):
    """Return r (18,) of (27a, b) with (23), (25), (26) and K = dr/du (18, 18) of (29), analytic.

    `V_star` (9,) is the finite derivative of the potential, dV_star (9, 9) its derivative by q1; both None for a free body.

    The projection of V_star in (25) and the multipliers (26) enter as one vector of six, kappa = lam + (C C')^-1 C V_star.
    """
    qb, pb = 0.5 * (q0 + q1), 0.5 * (p0 + p1)
    nu = J_inverse @ (0.5 * (G(q0) @ p0 + G(q1) @ p1))
    Hn, Cq, Cp = H(nu), C(qb), C(pb)
    Hq, Hp = Hn @ qb, Hn @ pb
    CC = Cq @ Cq.T
    # (26), with the sign that follows from mu = -mean(G(p) q)
    rhs = -(Cq @ Hp + Cp @ Hq)
    if V_star is not None:
        rhs += Cq @ V_star
    kappa = np.linalg.solve(CC, rhs)
    # (27a), (27b)
    r = np.empty(18)
    r[:9] = (q1 - q0) - dt * Hq
    r[9:] = (p1 - p0) - dt * Hp - dt * (Cq.T @ kappa)
    # (29): d(qb)/dq1 = d(pb)/dp1 = 1/2, d(nu)/dq1 = -1/2 J^-1 G(p1), d(nu)/dp1 = 1/2 J^-1 G(q1)
    nu_q, nu_p = -0.5 * J_inverse @ G(p1), 0.5 * J_inverse @ G(q1)
    Gq, Gp = G(qb).T.copy(), G(pb).T.copy()
    Sk = S(kappa)
    by_nu = Cq @ Gp + Cp @ Gq
    rhs_q = -0.5 * (C(Hp) + Cp @ Hn) - by_nu @ nu_q
    rhs_p = -0.5 * (Cq @ Hn + C(Hq)) - by_nu @ nu_p
    # from d(C C') kappa + C C' d(kappa) = d(rhs)
    rhs_q -= 0.5 * (C(Cq.T @ kappa) + Cq @ Sk)
    if V_star is not None:
        rhs_q += 0.5 * C(V_star) + Cq @ dV_star
    kappa_u = np.linalg.solve(CC, np.hstack((rhs_q, rhs_p)))
    one = np.eye(9)
    K = np.empty((18, 18))
    K[:9, :9] = one - dt * (0.5 * Hn + Gq @ nu_q)
    K[:9, 9:] = -dt * (Gq @ nu_p)
    K[9:, :9] = -dt * (Gp @ nu_q + 0.5 * Sk)
    K[9:, 9:] = one - dt * (0.5 * Hn + Gp @ nu_p)
    K[9:, :] -= dt * (Cq.T @ kappa_u)
    if V_star is not None:
        r[9:] += dt * V_star
        K[9:, :9] += dt * dV_star
    return r, K


@brief
def finite_gradient(field, q0, q1):
    """V* (9,) between base vectors q0 and q1, and its derivative by q1 (9, 9)."""
    return finite_derivative(field, q0, q1)
