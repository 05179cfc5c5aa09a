"""Series steps of a free body and of a symmetric top: an oscillation with few products, and angles by quadrature (`taylor`).

The integrals of these motions leave one equation x'' = polynomial of x. Angles are integrals of quotients of polynomials of x,
taken by Gauss' quadrature with eight nodes from the series of a step. No closed form is used. The next step does not need the
angles, so the processor computes them while it takes that step. In compiled code a vector of one body is a register.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..arithmetic import add, choose, cosine, cross, dot, fuse, root, scale, sine, times
from .compiler.series import HIGHEST, Series, sum_to_order
from .compiler.series import add as add_product
from .compiler.traced import add_lanes, lanes_like

_X, _WEIGHTS = np.polynomial.legendre.leggauss(8)
NODES, WEIGHTS = 0.5 + 0.5 * _X, 0.5 * _WEIGHTS
"""Nodes and weights of the quadrature over a step."""
FLAT, TINY = 1e-8, 1e-300
"""Regularisation: relative, of squares of gradients, and added to what can be 0."""
ROUND_OFF = 2.0**-50
"""Relative defect up to which nothing is corrected."""


def significant(x, scale):
    """Return x moved towards 0 by the round-off of the scale: continuous, so that noise is not amplified."""
    least = ROUND_OFF * scale
    return choose(x > least, x - least, choose(x < -least, x + least, 0.0))


def move_along(x, y, a):
    """Return a, perpendicular to x, after the smallest rotation that takes the unit vector x to y."""
    return add(a, scale(-dot(a, y) / (1.0 + dot(x, y)), add(x, y)))


def sum_oscillation(x, slope, second, linear, product, cubic):
    """Yield for each order the change of x and of its slope in a step, and the change of x (its first component) at `NODES`.

    With the coefficients x[n] of powers of t/h, x[1] = slope and 2 x[2] = second, for n = 1, 2, ...

        (n+1) (n+2) x[n+2] = linear x[n] + p[n]        p[n] = product/2 sum of x[i] x[n-i], i = 1 ... n-1

    If `cubic`, p[n] is replaced by x0 p[n] + sum of (product x0 x[i] + p[i]) x[n-i]. Products with x0 are in `linear`, so that
    one product lies between a coefficient and the next but one. Sums run from the middle outwards: the newest come last.
    """
    xs, twice, squares = [x, slope], [x * product, slope * product], [None]
    change, change_of_slope, at_nodes = slope, None, None
    for n in range(HIGHEST):
        newest = xs[-1].split() if getattr(xs[-1], "width", 0) else xs[-1]
        first = newest[0] if isinstance(newest, tuple) else newest
        at_nodes = add_product(at_nodes, first, lanes_like(first, NODES ** (n + 1)))
        yield change, change_of_slope, at_nodes
        p = rest = None
        for i in range(n // 2, 0, -1):
            p = rest = add_product(p, xs[n - i], twice[i] * 0.5 if 2 * i == n else twice[i])
        if cubic and n > 1:
            halves = [None, None]
            for i in sorted(range(1, n), key=lambda i: abs(2 * i - n)):
                halves[2 * i > n] = add_product(halves[2 * i > n], xs[n - i], squares[i])
            rest = fuse(xs[0], p, halves[0]) if n == 2 else fuse(xs[0], p, halves[0]) + halves[1]
        squares += [add_product(p, twice[0], xs[n])] if n else []
        xs.append((add_product(rest, linear, xs[n]) if n else second) * (1.0 / ((n + 1) * (n + 2))))
        twice.append(xs[-1] * product)
        change, change_of_slope = change + xs[-1], add_product(change_of_slope, xs[-1], float(n + 2))


class Polhode(NamedTuple):
    """A free body: x = g, the direction of the momentum in principal axes, circulates about the third axis.

    `w` are the factors of g in the rates, rad/s, and g'' = g (linear + product/2 g^2), by components. `mean` is g.w, twice the
    energy over the momentum, `axis` the sign of g3, and `row` the first row of the attitude's matrix at the start, moved to the
    third axis with g.
    """

    w: Any
    linear: Any
    product: Any
    mean: Any
    axis: Any
    row: Any

    def advance(self, order, h, x):
        """Return x after a step, not corrected, and the change of the angle about the momentum, rad.

        The row a of the matrix is at this angle to the row that moves along great circles through the third axis c. From
        a' = a x w, its rate is -w.(g + c)/(1 + g.c).
        """
        series, (w1, w2, w3) = Series(x[0]), self.w
        slope = times((h * (w3 - w2), h * (w1 - w3), h * (w2 - w1)), (x[1] * x[2], x[2] * x[0], x[0] * x[1]))
        vectors = x, slope, scale(h * h, self.linear), scale(h * h, self.product)
        # The third component is in front, because `sum_oscillation` evaluates the first one at the nodes.
        g, slope, linear, product = (series.vector(v[2], v[0], v[1]) for v in vectors)
        square = g * g * product
        # The second derivative at the start, and the linear term of the equation there: the derivative of g'' by g.
        sums = sum_oscillation(g, slope, (square * 0.5 + linear) * g, square * 1.5 + linear, product, True)
        change, _, at_nodes = sum_to_order(order, sums)
        third, first, second = series.split(change)
        height = self.axis * (x[2] + at_nodes)
        rate = (self.mean + w3 * height) / (1.0 + height)
        return add(x, (first, second, third)), (-h * add_lanes(rate * lanes_like(w3, WEIGHTS)),)

    def correct(self, x):
        """Return x of length 1 and with the energy of the start, to first order, the relative defect, and the share left.

        The gradient of g.w along the sphere is 2 (w - mean g). Its product with g is -2 times the defect.
        """
        slope = times(tuple(2.0 * (value - self.mean) for value in self.w), x)
        n, e, flat = 0.5 - 0.5 * dot(x, x), -0.5 * dot(slope, x), FLAT * (self.mean * self.mean)
        over = 1.0 / (flat + dot(slope, slope))
        turn = scale(over * significant(e, self.mean), slope)
        return add(scale(1.0 + n, x), turn), abs(e) * (1.0 / self.mean) + abs(n), flat * over

    def find_rows(self, x, angles):
        """Return g, a and w."""
        a = move_along((0.0, 0.0, self.axis), x, self.row)
        return x, add(scale(cosine(angles[0]), a), scale(sine(angles[0]), cross(x, a))), times(self.w, x)


class Nutation(NamedTuple):
    """A symmetric top in the frame that does not spin: x = (u, u'), the third component of g and its rate.

    `along` and `spin` are the momenta about the axes of field and body over the moment of inertia J, rad/s. `energy` is twice
    the energy over J minus spin^2, `moment` is twice the potential at u = 1 over J, 1/s^2. `turns` are cosine and sine of the
    angles of precession and of the body's own rotation at the start (R = Rz Ry Rz).
    """

    along: Any
    spin: Any
    energy: Any
    moment: Any
    turns: Any

    def cubic(self, u):
        """Return u'^2 and u'' at a height u."""
        wide, across, slow = fuse(-u, u, 1.0), fuse(-self.moment, u, self.energy), fuse(-self.spin, u, self.along)
        return wide * across - slow * slow, self.spin * slow - u * across - 0.5 * self.moment * wide

    def advance(self, order, h, x):
        """Return x after a step, not corrected, and the changes of the two angles, rad.

        Sum and difference of the angles have the rates (along + spin)/(1 + u) and (along - spin)/(1 - u).
        """
        (u, slope), hh, product = x, h * h, 3.0 * h * h * self.moment
        linear = product * u - hh * (self.energy + self.spin * self.spin)
        sums = sum_oscillation(u, h * slope, hh * self.cubic(u)[1], linear, product, False)
        change, change_of_slope, at_nodes = sum_to_order(order, sums)
        height, half = u + at_nodes, lanes_like(u, 0.5 * WEIGHTS)
        p, q = (self.along + self.spin) * half / (1.0 + height), (self.along - self.spin) * half / (1.0 - height)
        return (u + change, slope + change_of_slope / h), (h * add_lanes(p + q), h * add_lanes(p - q))

    def correct(self, x):
        """Return x with the energy of the start, to first order, the relative defect, and the share left.

        The gradient of the defect is (2 u'', -2 u'). Changes of u are weighed by the square of a rate.
        """
        (u, slope), size = x, self.energy + self.spin * self.spin + abs(self.moment)
        square, second = self.cubic(u)
        e, flat = square - slope * slope, FLAT * (size * size)
        over = 1.0 / (2.0 * (second * second + size * (slope * slope) + flat))
        by = over * significant(e, size)
        return (fuse(-by, second, u), fuse(by * size, slope, slope)), abs(e) / (size * fuse(-u, u, 1.0)), 2.0 * flat * over

    def find_rows(self, x, angles):
        """Return g, a and w."""
        (u, slope), turns = x, ((cosine(angle), sine(angle)) for angle in angles)
        (cp, sp), (cr, sr) = ((c * d - s * t, s * d + c * t) for (c, s), (d, t) in zip(self.turns, turns, strict=True))
        wide = root(fuse(-u, u, 1.0))
        slow, fast = (self.along - self.spin * u) / wide, slope / wide
        a, w = (cp * u * cr - sp * sr, -(cp * u * sr) - sp * cr, wide * cp), (-slow * cr - fast * sr, slow * sr - fast * cr)
        return (-wide * cr, wide * sr, u), a, (*w, self.spin)
