"""Volterra's closed form of the momentum of a free gyrostat: rational functions of Weierstrass' function of time.

L moves along the intersection of the sphere |L| = l and the ellipsoid of the energy. A cone of the pencil of these two quadrics
contains the curve too. With its vertex v and a rational parameter s of its lines d(s), L = v + rho d(s). The sphere gives rho,
with one root of a quartic D(s), and s' = m sqrt(D) with a constant m. Weierstrass' formula solves that from any start.

Sources: V. Volterra, Sur la théorie des variations des latitudes, Acta Math. 22 (1899); E. T. Whittaker and G. N. Watson, A
Course of Modern Analysis, 20.6.
"""

from __future__ import annotations

import mpmath
import numpy as np

from conservative.attitude import Array
from conservative.body import RigidBody


def momenta_of_volterra(body: RigidBody, w_WB_B0: Array, times: Array, digits: int = 40) -> Array:
    """Return the momenta (n, 3) of the body with its rotor, kg m^2/s, body axes, at times (n,), s."""
    mp = mpmath.MPContext()
    mp.dps = digits
    assert body.rotor_momentum is not None
    k, r = [1 / mp.mpf(x) for x in body.moments], [mp.mpf(x) for x in body.rotor_momentum @ body.R_BP]
    L0, i = [mp.mpf(x) for x in body.momentum(w_WB_B0) @ body.R_BP], mp.mpc(0, 1)
    w = [k * (L - r) for k, L, r in zip(k, L0, r, strict=True)]
    L0_rate = [L0[1] * w[2] - L0[2] * w[1], L0[2] * w[0] - L0[0] * w[2], L0[0] * w[1] - L0[1] * w[0]]

    def dot(a, b):
        return sum(x * y for x, y in zip(a, b, strict=True))

    def quartic(function):  # its coefficients, highest first
        points = [mp.mpf(x) for x in range(-2, 3)]
        powers = mp.matrix([[x ** (4 - j) for j in range(5)] for x in points])
        return list(mp.lu_solve(powers, mp.matrix([function(x) for x in points])))

    # The quadric sum k (L - r)^2 - 2 T - x (L.L - l^2) is a cone if its value at its centre v = k r / (k - x) is 0.
    square, twice_energy = dot(L0, L0), dot(w, [L - r for L, r in zip(L0, r, strict=True)])
    constant = sum(k * r * r for k, r in zip(k, r, strict=True)) - twice_energy

    def value_at_centre(x):
        gaps = [each - x for each in k]
        parts = [(k[j] * r[j]) ** 2 * gaps[j - 1] * gaps[j - 2] for j in range(3)]
        return (constant + x * square) * mp.fprod(gaps) - sum(parts)

    x = mp.polyroots(quartic(value_at_centre)[::-1], maxsteps=500, extraprec=200, asc=True)[0]
    v, a = [k * r / (k - x) for k, r in zip(k, r, strict=True)], [mp.sqrt(mp.mpc(each - x)) for each in k]

    def line(s):  # sum (a d)^2 = 0
        return [(1 - s * s) / a[0], 2 * s / a[1], i * (1 + s * s) / a[2]]

    e, e_rate = (
        [a * b for a, b in zip(a, each, strict=True)] for each in ([L - v for L, v in zip(L0, v, strict=True)], L0_rate)
    )
    under, under_rate = e[0] - i * e[2], e_rate[0] - i * e_rate[2]
    s0, rate0 = e[1] / under, (e_rate[1] * under - e[1] * under_rate) / under**2
    root0 = e[1] / (2 * s0) * dot(line(s0), line(s0)) + dot(v, line(s0))
    m = rate0 / root0
    D = quartic(lambda s: m * m * (dot(v, line(s)) ** 2 - dot(line(s), line(s)) * (dot(v, v) - square)))  # s'^2
    c = [D[0], D[1] / 4, D[2] / 6, D[3] / 4, D[4]]
    g2 = c[0] * c[4] - 4 * c[1] * c[3] + 3 * c[2] ** 2
    g3 = c[0] * c[2] * c[4] + 2 * c[1] * c[2] * c[3] - c[2] ** 3 - c[0] * c[3] ** 2 - c[1] ** 2 * c[4]
    e1, e2, e3 = mp.polyroots([-g3, -g2, 0, 4], maxsteps=500, extraprec=200, asc=True)
    value, slope, curvature, third = (
        mp.diff(lambda s: sum(c * s ** (4 - j) for j, c in enumerate(D)), s0, n) for n in range(4)
    )

    def parameter(t):
        sn, cn, dn = (mp.ellipfun(name, mp.sqrt(e1 - e3) * t, m=(e2 - e3) / (e1 - e3)) for name in ("sn", "cn", "dn"))
        p = e3 + (e1 - e3) / sn**2 - curvature / 24
        p_rate = -2 * (e1 - e3) * mp.sqrt(e1 - e3) * cn * dn / sn**3
        return s0 + (slope / 2 * p + value * third / 24 - rate0 * p_rate) / (2 * p * p - D[0] * value / 2)

    found = [L0]
    for t in times[1:]:
        s, root = parameter(mp.mpf(t)), mp.diff(parameter, mp.mpf(t)) / m
        rho = (root - dot(v, line(s))) / dot(line(s), line(s))
        found.append([mp.re(v + rho * d) for v, d in zip(v, line(s), strict=True)])
    return np.array([[float(x) for x in row] for row in found]) @ body.R_BP.T
