"""Angular accelerations of the fields in double precision, with few products.

Each field has an axis, so its torque depends on one unit vector: g, the field's axis in principal axes of the body. With the
constant moment m, A the distance of the anchor from the fixed point, and d the distance of body point b from the anchor:

    uniform gravity     J w' = J w x w + g x m                          m = weight com
    spring              J w' = J w x w + (1 - rest / d) g x m           m = -stiffness A b      d^2 = b.b + A^2 - 2 A b.g
    attraction          J w' = J w x w + d^-3 g x m                     m = -strength A b
    gravity gradient    J w' = J w x w + g x (3 rate^2 I g)

The first is linear in g and needs no product of variables. The second and the third are perpendicular to m, so two products
give all three components. The last has the same products of g as Euler's equations of w. The expressions accept heyoka's
symbols and floats. `conservative.references.precise` has its own copy of the torques, so that a mistake in one of them shows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import Any

import numpy as np

from conservative.attitude import Array, axes_about, hat
from conservative.potentials.gravity_gradient import GravityGradient
from conservative.potentials.point_to_point import LinearSpring, PointAttraction, PointPotential
from conservative.potentials.potential import Potential
from conservative.potentials.turning import Turning, static_part
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene

from ..engine import EngineAxes, principal_axes
from .forms import Expression, is_zero, product

Expressions = Sequence[Expression]
Acceleration = Callable[[Expressions, Expressions], list[Expression]]
"""Maps parameters and g to the angular acceleration by the field."""

_ROUND_OFF = 4 * np.finfo(float).eps
"""Relative size of a component in principal axes below which it is round-off of the change of axes."""


Law = tuple[EngineAxes, Acceleration, list[float]]
"""A field: principal axes of the body, ordered for it, its expressions, and the values of their parameters."""


def express_field(scene: Scene, axes: EngineAxes | None = None) -> tuple[Array, Array, Law]:
    """Return the field of a scene whose potential, or the potential that turns, is None or one of `READERS`.

    `axes` are principal axes that the law keeps; by default it orders them. The result is the rotation R_WD (3, 3) whose third
    column is the field's axis in world axes, the rates (3,) of the axes D, rad/s, in D, and the law. The first rate is 0. The
    field is constant in D.
    """
    potential, given, turn_D = static_part(scene.potential), axes or principal_axes(scene), np.zeros(3)
    line = None if potential is None else potential.axis_W
    if potential is None or line is None:  # a potential without an axis has no torque
        law: Law = (given, uniform, [0.0] * 9)
    else:
        law = READERS[type(potential)](given, potential, axes is not None)
    if not isinstance(scene.potential, Turning):
        return np.eye(3) if line is None else axes_about(line), turn_D, law
    orbit = scene.potential.orbit
    third = orbit.normal_W if line is None else line
    first = np.cross(orbit.normal_W, third)  # perpendicular to the normal, so that the first rate of D is 0
    size = np.linalg.norm(first)
    R_WD = axes_about(third)
    if size > _ROUND_OFF:
        R_WD = np.stack([first / size, np.cross(third, first / size), third], axis=1)
    return R_WD, _drop_round_off(orbit.rate * (orbit.normal_W @ R_WD)), law


def uniform(parameters: Expressions, g: Expressions) -> list[Expression]:
    """Return M g, parameters M (9)."""
    return product(parameters, g)


def spring(parameters: Expressions, g: Expressions, last: int = 2) -> list[Expression]:
    """Return (1 - s^-1/2) M g with s = (distance / rest length)^2; parameters as for `_pull`."""
    return _pull(parameters, g, lambda s: 1.0 - s**-0.5, last)


def attraction(parameters: Expressions, g: Expressions, last: int = 2) -> list[Expression]:
    """Return s^-3/2 M g with s = distance^2; parameters as for `_pull`."""
    return _pull(parameters, g, lambda s: s**-1.5, last)


@cache
def _with_last(acceleration: Callable[..., list[Expression]], last: int) -> Acceleration:
    """Return a pull whose component `last` follows from the two others: the same object each time, as forms are compared."""
    return acceleration if last == 2 else partial(acceleration, last=last)


def gradient(parameters: Expressions, g: Expressions) -> list[Expression]:
    """Return A (g2 g3, g3 g1, g1 g2) + B (g2^2 - g3^2, g3^2 - g1^2, g1^2 - g2^2), parameters A (9) and diagonal B (3)."""
    pairs = [(g[(i + 1) % 3], g[(i + 2) % 3]) for i in range(3)]
    out = product(parameters[:9], [a * b for a, b in pairs])
    return [x if is_zero(c) else x + c * (a * a - b * b) for x, c, (a, b) in zip(out, parameters[9:], pairs, strict=True)]


def _pull(parameters: Expressions, g: Expressions, law: Callable[[Expression], Expression], last: int) -> list[Expression]:
    """Return law(s) M g with s = s0 - s1.g.

    Parameters: the rows of M (6) apart from number `last`, the coefficients of component `last` in the two others (2), s0, and
    s1 (3).
    """
    along = [c * x for c, x in zip(parameters[9:], g, strict=True) if not is_zero(c)]
    factor = law(parameters[8] - sum(along[1:], along[0]))
    first, second, _ = product([*parameters[:6], 0.0, 0.0, 0.0], g)
    pulled = [first * factor, second * factor]
    pulled.insert(last, sum((c * x for c, x in zip(parameters[6:8], pulled, strict=True) if not is_zero(c)), 0.0))
    return pulled


def _read_spring(axes: EngineAxes, potential: Any, keep: bool) -> Law:
    if potential.rest_length == 0:
        moment = -potential.stiffness * np.linalg.norm(potential.anchor_W) * (potential.point_B @ axes.R_BF)
        return axes, uniform, _turning(axes, moment)
    return _read_points(axes, potential, keep, spring, potential.stiffness, potential.rest_length)


def _read_points(
    axes: EngineAxes,
    potential: PointPotential,
    keep: bool,
    acceleration: Callable[..., list[Expression]],
    strength: float,
    unit: float,
) -> Law:
    """Return the law of a force along the line between two points, from expressions, strength and unit of length.

    The component of the acceleration that follows from the two others is along the axis that is nearest to the line. It is the
    third, so that all bodies have one form, unless `keep` keeps the order of the axes.
    """
    if not potential.point_B.any():
        return axes, uniform, [0.0] * 9
    last = int(np.argmax(np.abs(potential.point_B @ axes.R_BF)))
    if not keep:
        axes, last = order_axes(axes, last), 2
    b, A = _drop_round_off(potential.point_B @ axes.R_BF), float(np.linalg.norm(potential.anchor_W))
    two = [i for i in range(3) if i != last]
    derived = -b[two] * axes.J[two] / (b[last] * axes.J[last])
    rows = np.reshape(_turning(axes, -strength * A * b), (3, 3))[two]
    distance = np.array([b @ b + A * A, *(2 * A * b)]) / unit**2
    return axes, _with_last(acceleration, last), [*rows.ravel().tolist(), *derived.tolist(), *distance.tolist()]


def _read_gradient(axes: EngineAxes, potential: Any, keep: bool) -> Law:
    inertia = potential.factor * _drop_round_off(axes.R_BF.T @ potential.inertia @ axes.R_BF)
    A, B = np.empty((3, 3)), np.empty(3)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        A[i, [i, j, k]] = inertia[k, k] - inertia[j, j], -inertia[i, j], inertia[i, k]
        B[i] = inertia[j, k]
    return axes, gradient, [*(A / axes.J[:, None]).ravel().tolist(), *(B / axes.J).tolist()]


READERS: dict[type[Potential], Callable[[EngineAxes, Any, bool], Law]] = {
    UniformGravity: lambda axes, field, keep: (axes, uniform, _turning(axes, field.moment_B @ axes.R_BF)),
    LinearSpring: _read_spring,
    PointAttraction: lambda axes, field, keep: _read_points(axes, field, keep, attraction, field.strength, 1.0),
    GravityGradient: _read_gradient,
}
"""Functions that express a potential, by its type, from principal axes and whether their order is kept."""


def order_axes(axes: EngineAxes, third: int) -> EngineAxes:
    """Return principal axes in the order in which axis number `third` is the third."""
    turn = np.roll(np.eye(3), 2 - third, axis=1)
    return EngineAxes(axes.scene, axes.R_BF @ turn, axes.J @ turn)


def _drop_round_off(components: Array) -> Array:
    """Set components that are round-off to zero, which removes their terms from the equations."""
    return np.where(np.abs(components) <= _ROUND_OFF * np.abs(components).max(), 0.0, components)


def _turning(axes: EngineAxes, moment: Array) -> list[float]:
    """Return the matrix (9) of J^-1 (g x m), row by row."""
    return (-hat(moment) / axes.J[:, None]).ravel().tolist()
