"""Scenes as heyoka integrates them: axes, parameters, initial state, and the conversion of states to attitudes and rates.

The forms are in `conservative.references.heyoka_equations.forms`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from dataclasses import field as dataclass_field
from itertools import pairwise
from typing import Any

import numpy as np

from conservative.attitude import Array, from_quaternion, to_quaternion
from conservative.potentials.turning import Turning
from conservative.scene import Scene

from ..engine import EngineAxes, principal_axes, symmetric_axes
from . import forms
from .accelerations import express_field, order_axes

_SMALLEST_POLE_DISTANCE = 0.7
"""Smallest 1 + n_z for axis and angle. Closer to the pole their additional steps cost more than the products they save."""

_DOWN = np.diag([1.0, -1.0, -1.0])
"""Turns the world upside down, for tops that swing below the fixed point."""


@dataclass(frozen=True, eq=False)
class Formulation:
    """A scene as heyoka integrates it.

    Attributes
    ----------
    axes
        Axes F of the equations.
    form, parameters, start
        Equations, values of their parameters, initial state.
    readout
        Maps times (n,) and states (n, m) to attitudes (n, 3, 3) and rates (n, 3) in F.
    fast_math
        True if the compiler may reorder sums.
    attitudes, R_WD
        If R_WF is R_WD attitudes(states without rates), this function and R_WD; otherwise None and the identity.
    """

    axes: EngineAxes
    form: forms.Form
    parameters: list[float]
    start: Array
    readout: Callable[[Array, Array], tuple[Array, Array]]
    fast_math: bool = False
    attitudes: Callable[[Array], Array] | None = None
    R_WD: Array = dataclass_field(default_factory=lambda: np.eye(3))


def body(scene: Scene) -> Formulation:
    """Return quaternion and rates in principal axes."""
    return _with_attitude(scene, forms.quaternion, to_quaternion, from_quaternion)


def base_vectors(scene: Scene) -> Formulation:
    """Return third and first row of the rotation matrix, in world axes whose third is the field's axis, and rates.

    The second row is their cross product. The rows are not orthonormalised, so their drift shows in the samples.
    """
    formulation = _with_attitude(scene, forms.base_vectors, lambda R: R[[2, 0]].ravel(), _from_rows)
    return replace(formulation, fast_math=True)  # measured: 3 to 7 % less time; for the quaternion 2 to 5 % more


def _with_attitude(
    scene: Scene, attitude: Callable[..., Any], write: Callable[[Array], Array], read: Callable[[Array], Array]
) -> Formulation:
    """Return Euler's equations with those of an attitude that `write` and `read` convert from and to matrices."""
    field = express_field(scene)
    axes, R_WD = field.axes, field.R_WD
    equations = forms.EulerEquations(attitude, field.acceleration)
    form, parameters = forms.form_of(equations, [*_gyroscopic(axes), *field.turn_D.tolist(), *field.parameters])

    def readout(t: Array, states: Array) -> tuple[Array, Array]:
        R = R_WD @ read(states[:, :-3])
        return scene.potential.orbit.R_WO(t) @ R if isinstance(scene.potential, Turning) else R, states[:, -3:]

    start = np.concatenate([write(R_WD.T @ axes.R_WF0), axes.w0])
    steady = None if isinstance(scene.potential, Turning) else read
    return Formulation(axes, form, parameters, start, readout, attitudes=steady, R_WD=R_WD)


def _from_rows(rows: Array) -> Array:
    """Return matrices (n, 3, 3) from third and first rows (n, 6)."""
    (g1, g2, g3), (a1, a2, a3) = rows[:, :3].T, rows[:, 3:].T
    out = np.empty((len(rows), 3, 3))
    out[:, 0], out[:, 2] = rows[:, 3:], rows[:, :3]
    # Not `np.cross`, which takes as long as a hundred steps of an integration.
    out[:, 1, 0], out[:, 1, 1], out[:, 1, 2] = g2 * a3 - g3 * a2, g3 * a1 - g1 * a3, g1 * a2 - g2 * a1
    return out


def non_spinning(scene: Scene) -> Formulation:
    """Return quaternion and momentum of the frame that turns at l/J1; the spin of a symmetric body has a closed form."""
    axes = symmetric_axes(scene)
    assert axes is not None  # checked by `Heyoka.unsupported`
    u0, spin = _slow_rates(axes)
    form, parameters = forms.form_of(forms.non_spinning, [axes.moment[2] / axes.J[0], u0[2]])

    def readout(t: Array, states: Array) -> tuple[Array, Array]:
        R_WF = from_quaternion(states[:, :4]) @ _about_3(spin * t)
        return R_WF, _body_rates(axes, R_WF, states[:, 4:6], u0[2])

    return Formulation(axes, form, parameters, np.concatenate([axes.q0, u0[:2]]), readout)


def lean(scene: Scene) -> Formulation:
    """Return the formulation with the fewest products."""
    axes = symmetric_axes(scene)
    if axes is None:
        if not scene.free:
            return base_vectors(scene)
        # A body at rest has no momentum to turn about.
        return _free_rates_and_angle(scene) if scene.kinetic_energy0 > 0 else body(scene)
    lowest, highest = _heights(axes)
    if scene.free or max(1 + lowest, 1 - highest) < _SMALLEST_POLE_DISTANCE:
        return non_spinning(scene)
    return _axis_and_angle(axes, np.eye(3) if lowest > -highest else _DOWN)


def _free_rates_and_angle(scene: Scene) -> Formulation:
    axes = _order_axes(principal_axes(scene))
    L0 = axes.J * axes.w0
    momentum = float(np.linalg.norm(L0))
    slope = momentum / axes.J[2]
    numerator = (L0 @ axes.w0 - momentum * slope) / axes.J[2]
    form, parameters = forms.form_of(forms.free_rates_and_angle, [*_gyroscopic(axes), slope, numerator])
    base = axes.R_WF0 @ _least(L0[None] / momentum)[0]

    def readout(t: Array, states: Array) -> tuple[Array, Array]:
        w = states[:, :3]
        L = w * axes.J
        direction = L / np.sqrt(np.einsum("ni,ni->n", L, L))[:, None]
        to_momentum = np.swapaxes(_least(direction), 1, 2)
        return base @ _about_3(slope * t + states[:, 3]) @ to_momentum, w

    return Formulation(axes, form, parameters, np.append(axes.w0, 0.0), readout)


def _axis_and_angle(axes: EngineAxes, world: Array) -> Formulation:
    R0 = world @ axes.R_WF0
    u0, spin = _slow_rates(axes)
    u0, n0, k = world @ u0, R0[:, 2], axes.moment[2] / axes.J[0] * world[2, 2]
    form, parameters = forms.form_of(forms.axis_and_angle, [k, u0[2], u0 @ n0 + u0[2]])
    turned = _least(n0[None])[0].T @ R0
    p0 = float(np.arctan2(turned[1, 0], turned[0, 0]))

    def readout(t: Array, states: Array) -> tuple[Array, Array]:
        n = states[:, :3]
        R = _least(n / np.sqrt(np.einsum("ni,ni->n", n, n))[:, None]) @ _about_3(states[:, 5] + spin * t)
        return world @ R, _body_rates(axes, R, states[:, 3:5], u0[2])

    return Formulation(axes, form, parameters, np.array([*n0, *u0[:2], p0]), readout)


def _gyroscopic(axes: EngineAxes) -> list[float]:
    J1, J2, J3 = axes.J.tolist()
    return [(J2 - J3) / J1, (J3 - J1) / J2, (J1 - J2) / J3]


def _slow_rates(axes: EngineAxes) -> tuple[Array, float]:
    """Return the rates l/J1 of the slow frame, world axes, and the spin of the body in it."""
    J1, _, J3 = axes.J.tolist()
    return axes.R_WF0 @ (axes.J * axes.w0) / J1, (1 - J3 / J1) * float(axes.w0[2])


def _body_rates(axes: EngineAxes, R_WF: Array, u12: Array, u3: float) -> Array:
    """Return body rates (n, 3) from u = l/J1, whose third component is constant."""
    u = np.empty((len(u12), 1, 3))
    u[:, 0, :2], u[:, 0, 2] = u12, u3
    return (u @ R_WF)[:, 0] * (axes.J[0] / axes.J)


def _heights(axes: EngineAxes) -> tuple[float, float]:
    """Return the lowest and highest n_z of a symmetric top: the roots around its initial value of the cubic J1^2 n_z'^2."""
    (J1, _, J3), M = axes.J.tolist(), float(axes.moment[2])
    n = float(axes.R_WF0[2, 2])
    l3, L3 = float(axes.R_WF0[2] @ (axes.J * axes.w0)), J3 * float(axes.w0[2])
    energy = J1 * float(axes.w0[:2] @ axes.w0[:2]) / 2 + M * n
    cubic = np.polysub(2 * J1 * np.polymul([-1, 0, 1], [-M, energy]), np.polymul([-L3, l3], [-L3, l3]))
    roots = np.roots(cubic)
    turning = np.sort(roots[(np.abs(roots.imag) < 1e-6) & (np.abs(roots) < 1)].real)
    ends = np.concatenate([[-1.0], turning, [1.0]])
    # If the start is a turning point, the motion is on the side where the cubic is positive, or steady if there is none.
    reached = [
        (low, high)
        for low, high in pairwise(ends)
        if low - 1e-6 <= n <= high + 1e-6 and np.polyval(cubic, (low + high) / 2) > 0
    ]
    return min((low for low, _ in reached), default=n), max((high for _, high in reached), default=n)


def _order_axes(axes: EngineAxes) -> EngineAxes:
    """Return principal axes in the order in which a free body's momentum circulates about the third axis, L3 > 0.

    The third is the axis of the largest moment if l^2 > 2 T J_middle, of the smallest otherwise.
    """
    L0 = axes.J * axes.w0
    order = np.argsort(axes.J)
    third = order[2] if L0 @ axes.w0 * axes.J[order[1]] < L0 @ L0 else order[0]
    ordered = order_axes(axes, int(third))
    return EngineAxes(axes.scene, ordered.R_BF @ _DOWN, ordered.J) if L0[third] < 0 else ordered


def _least(n: Array) -> Array:
    """Return the smallest rotations (k, 3, 3) from e_3 to unit vectors (k, 3), none of which is -e_3."""
    x, y, z = n.T
    a, b = x / (1 + z), y / (1 + z)
    out = np.empty((len(n), 3, 3))
    out[:, 0, 0], out[:, 1, 1] = 1 - x * a, 1 - y * b
    out[:, 0, 1] = out[:, 1, 0] = -x * b
    out[:, :, 2], out[:, 2, 0], out[:, 2, 1] = n, -x, -y
    return out


def _about_3(angle: Array) -> Array:
    """Return rotations (n, 3, 3) about the third axis by angles (n,), rad."""
    out = np.zeros((len(angle), 3, 3))
    out[:, 0, 0] = out[:, 1, 1] = np.cos(angle)
    out[:, 1, 0] = np.sin(angle)
    out[:, 0, 1] = -out[:, 1, 0]
    out[:, 2, 2] = 1
    return out
