"""The equations of Krenk & Nielsen (COMPDYN 2013), numbered as in the paper, on 9 + 9 unknowns.

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
    """Return hat(a), (3, 3)."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


@kernel
def G(q):
    """(8): w = -1/2 G(q) qdot and G(q) p = -L, (3, 9). Linear in q, with G(a) b = -G(b) a."""
    out = np.zeros((3, 9))
    for i in range(3):
        q1, q2, q3 = q[i], q[3 + i], q[6 + i]
        out[0, 3 + i], out[0, 6 + i] = -q3, q2
        out[1, i], out[1, 6 + i] = q3, -q1
        out[2, i], out[2, 3 + i] = -q2, q1
    return out


@kernel
def C(q):
    """(5): derivative of the six Green strains by q, (6, 9). Linear in q, with C(a) b = C(b) a."""
    out = np.zeros((6, 9))
    for i in range(3):
        q1, q2, q3 = q[i], q[3 + i], q[6 + i]
        # (q1.q1 - 1)/2 and its kin, then q2.q3, q3.q1 and q1.q2: the shear strains count twice.
        out[0, i], out[1, 3 + i], out[2, 6 + i] = q1, q2, q3
        out[3, 3 + i], out[3, 6 + i] = q3, q2
        out[4, i], out[4, 6 + i] = q3, q1
        out[5, i], out[5, 3 + i] = q2, q1
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
    """Return the skew matrix with G(q)' nu = H(nu) q, (9, 9)."""
    return times_identity(skew(nu))


@kernel
def S(kappa):
    """Return the symmetric matrix with C(q)' kappa = S(kappa) q, (9, 9)."""
    k = kappa
    return times_identity(np.array([[k[0], k[5], k[4]], [k[5], k[1], k[3]], [k[4], k[3], k[2]]]))


def conjugate_momentum(q, L):
    """(12) on a rigid motion: [p1 p2 p3] = 1/2 Q hat(L), for which G(q) p = -L and (17) C(q) p = 0 hold, (9,)."""
    return (0.5 * (q.reshape(3, 3).T @ skew(L))).T.flatten()


@kernel
def multiply(A, B):
    """A B (n, m). NumPy's product compiles in half a second for each kind of argument, and its `solve` in two."""
    out = np.zeros((len(A), B.shape[1]))
    for i in range(out.shape[0]):
        for k in range(len(B)):
            for j in range(out.shape[1]):
                out[i, j] += A[i, k] * B[k, j]
    return out


@kernel
def transpose(A):
    """A' as an array of the same layout."""
    out = np.empty((A.shape[1], len(A)))
    for i in range(len(A)):
        for j in range(A.shape[1]):
            out[j, i] = A[i, j]
    return out


@kernel
def apply(A, x):
    """A x (n,)"""
    out = np.zeros(len(A))
    for i in range(len(A)):
        for k in range(len(x)):
            out[i] += A[i, k] * x[k]
    return out


@kernel
def invert(A):
    """Return the inverse of a positive definite matrix. Elimination needs no pivots. Not finite if singular."""
    n = len(A)
    left, out = A.copy(), np.eye(n)
    for k in range(n):
        over = 1.0 / left[k, k]
        for j in range(n):
            left[k, j] *= over
            out[k, j] *= over
        for i in range(n):
            factor = left[i, k]
            if i != k:
                for j in range(n):
                    left[i, j] -= factor * left[k, j]
                    out[i, j] -= factor * out[k, j]
    return out


@brief
def residual_and_tangent(dt, J_inverse, V_star, dV_star, q0, p0, q1, p1):
    """Return r (18,) of (27a, b) with (23), (25), (26) and K = dr/du (18, 18) of (29), analytic.

    `V_star` (9,) is the finite derivative of the potential, dV_star (9, 9) its derivative by q1; both None for a free body.

    The projection of V_star in (25) and the multipliers (26) enter as one vector of six, kappa = lam + (C C')^-1 C V_star.
    """
    qb, pb = 0.5 * (q0 + q1), 0.5 * (p0 + p1)
    nu = apply(J_inverse, 0.5 * (apply(G(q0), p0) + apply(G(q1), p1)))
    Hn, Cq, Cp = H(nu), C(qb), C(pb)
    Hq, Hp = apply(Hn, qb), apply(Hn, pb)
    Ct = transpose(Cq)
    inverse = invert(multiply(Cq, Ct))
    # (26), with the sign that follows from mu = -mean(G(p) q)
    rhs = -(apply(Cq, Hp) + apply(Cp, Hq))
    if V_star is not None:
        rhs += apply(Cq, V_star)
    kappa = apply(inverse, rhs)
    force = apply(Ct, kappa)
    # (29): d(qb)/dq1 = d(pb)/dp1 = 1/2, d(nu)/dq1 = -1/2 J^-1 G(p1), d(nu)/dp1 = 1/2 J^-1 G(q1)
    nu_q, nu_p = -0.5 * multiply(J_inverse, G(p1)), 0.5 * multiply(J_inverse, G(q1))
    Gq, Gp, Sk = transpose(G(qb)), transpose(G(pb)), S(kappa)
    by_nu = multiply(Cq, Gp) + multiply(Cp, Gq)
    # from d(C C') kappa + C C' d(kappa) = d(rhs)
    rhs_q = -0.5 * (C(Hp) + multiply(Cp, Hn) + C(force) + multiply(Cq, Sk)) - multiply(by_nu, nu_q)
    rhs_p = -0.5 * (multiply(Cq, Hn) + C(Hq)) - multiply(by_nu, nu_p)
    if V_star is not None:
        rhs_q += 0.5 * C(V_star) + multiply(Cq, dV_star)
    projector = multiply(Ct, inverse)
    K_qq, K_qp = 0.5 * Hn + multiply(Gq, nu_q), multiply(Gq, nu_p)
    K_pq = 0.5 * Sk + multiply(Gp, nu_q) + multiply(projector, rhs_q)
    K_pp = 0.5 * Hn + multiply(Gp, nu_p) + multiply(projector, rhs_p)
    r, K = np.empty(18), np.eye(18)
    for i in range(9):
        # (27a), (27b)
        r[i] = (q1[i] - q0[i]) - dt * Hq[i]
        r[9 + i] = (p1[i] - p0[i]) - dt * Hp[i] - dt * force[i]
        for j in range(9):
            K[i, j] -= dt * K_qq[i, j]
            K[i, 9 + j] -= dt * K_qp[i, j]
            K[9 + i, j] -= dt * K_pq[i, j]
            K[9 + i, 9 + j] -= dt * K_pp[i, j]
            if V_star is not None:
                K[9 + i, j] += dt * dV_star[i, j]
        if V_star is not None:
            r[9 + i] += dt * V_star[i]
    return r, K


@brief
def finite_gradient(field, q0, q1):
    """V* (9,) between base vectors q0 and q1, and its derivative by q1 (9, 9)."""
    return finite_derivative(field, q0, q1)
