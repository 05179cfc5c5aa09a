"""The gradient of gravity, as a satellite feels it. Source: P. C. Hughes, Spacecraft Attitude Dynamics (1986), 8.1."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arithmetic import add, apply, cross, dot, fuse, halfway, in_body, scale, times
from ..attitude import Array
from ..check import positive_number, read_inertia, replace_unchecked, set_fields, unit_vector
from ..features import Feature, Features
from .field import FieldPotential


class GradientField(NamedTuple):
    """Rows of G = 3 rate^2 J, J, and the direction e of the centre, world axes (`conservative.potentials.field`).

    V = u' G u / 2 with u = R' e is quadratic in the base vectors. V* is therefore the gradient at their mean, e (G ubar)':
    ubar is the mean of u at both ends of the step.
    """

    rows: Any
    e: Any

    def energy(self, q: Any) -> Any:
        """Return V in J."""
        return self.slope((), in_body(q, self.e))[0]

    def body_torque(self, q: Any) -> Any:
        """Return the torque in N m."""
        u = in_body(q, self.e)
        return cross(u, apply(self.rows, u))

    def finite_torque(self, q: Any, a: Any) -> Any:
        """Return T = e x (M G ubar) and its derivative. M changes the product by dm; u, evaluated at -a, changes by -du."""
        e = in_body(q, self.e)  # e is at the start of the step; its mean over the step is M' e, and M' is M at -a
        u, du = halfway(scale(-1.0, a), e)
        m, dm = halfway(a, apply(self.rows, u))
        changes = (halfway(a, apply(self.rows, scale(-1.0, column)))[0] for column in du)
        return cross(e, m), tuple(cross(e, add(*column)) for column in zip(dm, changes, strict=True))

    def finite_derivative(self, q0: Any, q1: Any) -> Any:
        """Return e and G ubar."""
        u = tuple(0.5 * (dot(a, self.e) + dot(b, self.e)) for a, b in zip(q0, q1, strict=True))
        return self.e, apply(self.rows, u)

    def finite_slope(self, q0: Any, q1: Any) -> Any:
        """Return G and e e' / 2."""
        return self.rows, tuple(scale(0.5 * x, self.e) for x in self.e)

    def find_constants(self, J_inverse: Any) -> Any:
        """Return six rows, from which `series` forms h = G g in two arrangements, with component j divided by J_j.

        The arrangements of a vector v are v_r = (v2, v3, v1) and v_s = (v3, v1, v2). The first three rows times g_r, g_s and g,
        component by component, add up to h_r, and the last three to h_s.
        """
        x, y, z = self.rows
        of_r = (y[1], z[2], x[0]), (y[2], z[0], x[1]), (y[0], z[1], x[2])
        of_s = (z[1], x[2], y[0]), (z[2], x[0], y[1]), (z[0], x[1], y[2])
        return tuple(times(J_inverse, row) for row in (*of_r, *of_s))

    def slope(self, constants: Any, g: Any) -> Any:
        """Return V and dV/dg in J."""
        h = apply(self.rows, g)
        return 0.5 * dot(g, h), h

    def series(self, constants: Any, g: Any, series: Any) -> Any:
        """Return the recurrence of J^-1 (g x h), h = G g."""
        rows = [series.vector(*row) for row in constants]
        by_r, by_s, by_g = zip(rows[:3], rows[3:], strict=True)
        turned = series.history(), series.history()  # J^-1 h_r and J^-1 h_s

        def accelerate(c: Any, n: Any) -> Any:
            # c[n, 0], c[n, 1] and newest[0]: coefficient n of g_r, g_s and g
            for k, h in enumerate(turned):
                h.push(fuse(by_s[k], c[n, 1], fuse(by_r[k], c[n, 0], by_g[k] * c.newest[0])))
            (r, s), (g_r, g_s) = turned, c.turned(0)  # g x h = g_r h_s - g_s h_r
            return series.convolve(n, 0, n, ((s, g_r), (r, g_s)))[0]

        return accelerate

    def in_units(self, energy: Any) -> Any:
        """Return the field with energies in units of `energy`, J."""
        return self._replace(rows=self.rows / np.asarray(energy)[..., None, None])

    def energies(self, R_WB: Any) -> Any:
        """Return V, (...), in J."""
        u = self.e[..., None, :] @ R_WB
        return np.sum(u @ self.rows * u, axis=(-1, -2)) / 2

    def scale(self) -> Any:
        """Return the largest V, J."""
        return np.linalg.eigvalsh(self.rows)[..., -1] / 2

    def axis_W(self) -> Any:
        """Return the direction of the centre."""
        return self.e


@dataclass(frozen=True, eq=False, init=False)
class GravityGradient(FieldPotential):
    """Gravity gradient of a distant centre on a body that rotates about its centre of mass: V = 3/2 rate^2 u'J u, u = R' e.

    This is the second-order term in size over distance (Hughes, Spacecraft Attitude Dynamics, 8.1). The torque in body axes is
    3 rate^2 u x J u. The direction e to the centre is fixed in the world; for a satellite use `Orbit.gravity_gradient`.
    With a fixed direction the motion is integrable (F. de Brun, 1893): |L|^2 - 3 rate^2 det(J) u' J^-1 u is constant as well.
    No method here conserves it to round-off.

    Parameters
    ----------
    rate
        sqrt(G M / r^3), rad/s, positive: the rate of a circular orbit at the distance r.
    inertia
        Inertia of the body: moments (3,) or the tensor (3, 3) in body axes, kg m^2.
    direction_W
        Direction (3,) of the centre, world axes; any length above 0.

    Raises
    ------
    BadInput
        A parameter is not finite, not positive, not an inertia, or has the wrong shape.
    """

    rate: float
    inertia: Array
    direction_W: Array

    def __init__(self, rate: float, inertia: ArrayLike, direction_W: ArrayLike = (0, 0, 1)) -> None:
        set_fields(
            self,
            rate=positive_number("rate", rate, "a finite rate above 0, rad/s"),
            inertia=read_inertia(inertia),
            direction_W=unit_vector("direction_W", direction_W),
        )

    @property
    def factor(self) -> float:
        """Return 3 rate^2, 1/s^2: the factor of u x J u."""
        return 3 * self.rate**2

    features: ClassVar[Features] = frozenset({Feature.GRADIENT})
    NUMBERS: ClassVar[tuple[str, ...]] = ("rate", "inertia", "direction_W")

    @staticmethod
    def build_field(R_BP: Array | None, rate: Any, inertia: Any, direction_W: Any) -> GradientField:
        """Return the field in axes R_BP."""
        turned = inertia if R_BP is None else np.swapaxes(R_BP, -1, -2) @ inertia @ R_BP
        # A matrix that is not symmetric would do work on a closed path. An element below round-off would count in some sums and
        # vanish in others.
        symmetric = (turned + np.swapaxes(turned, -1, -2)) / 2
        least = 16 * np.finfo(float).eps * np.abs(symmetric).max(axis=(-1, -2), keepdims=True)
        symmetric = np.where(np.abs(symmetric) < least, 0.0, symmetric)
        return GradientField(3 * np.asarray(rate)[..., None, None] ** 2 * symmetric, direction_W)

    @property
    def axis_W(self) -> Array:
        """Return the direction of the centre, (3,)."""
        return self.direction_W

    def in_units(self, energy: float) -> GravityGradient:
        """Return the field with energies in units of `energy`, a power of two, J."""
        return replace_unchecked(self, inertia=self.inertia / energy)  # V is proportional to the inertia
