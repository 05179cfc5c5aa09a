"""Scenes as heyoka integrates them: axes, parameters, initial state, and the conversion of states to attitudes and rates.

The forms are in `conservative.references.heyoka_equations.forms`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from conservative.attitude import Array, hat, to_quaternion
from conservative.potentials.turning import Turning
from conservative.scene import Scene

from ..engine import EngineAxes, principal_axes, symmetric_axes
from ..samples import AXIS_AND_ANGLE, NON_SPINNING, QUATERNION, RATES_AND_ANGLE, ROW_AND_ANGLE, ROWS, States
from . import forms
from .accelerations import express_field, order_axes

_SMALLEST_POLE_DISTANCE = 0.7
"""Smallest 1 + n_z for axis and angle. Closer to the pole their additional steps cost more than the products they save."""

_TRIAL_TOL, _TRIAL_SAMPLES, _TRIAL_STEPS = 1e-6, 500, 10_000
"""Tolerance, samples and most steps of the run that shows where the field's axis goes in the body."""

_DOWN = np.diag([1.0, -1.0, -1.0])
"""Half a turn about the first axis: of the world for tops that swing below the fixed point, of a free body's axes if L3 < 0."""


@dataclass(frozen=True, eq=False)
class Formulation:
    """A scene as heyoka integrates it.

    Attributes
    ----------
    axes
        Axes F of the equations.
    form, parameters, start
        Equations, values of their parameters, initial state.
    kind, constants
        Form of the state (`conservative.references.samples`) and its constants (4,).
    R_WD
        Rotation (3, 3) from the axes in which the attitude is to world axes.
    fast_math
        True if the compiler may reorder sums.
    """

    axes: EngineAxes
    form: forms.Form
    parameters: list[float]
    start: Array
    kind: int
    constants: Sequence[float]
    R_WD: Array
    fast_math: bool = False


def gather(problems: Sequence[Formulation]) -> Callable[[Array], States]:
    """Return a function that makes states of bodies of one form out of their values (n, s, m)."""
    R_WD, constants = np.array([problem.R_WD for problem in problems]), np.array([problem.constants for problem in problems])
    return lambda values: States(problems[0].kind, values, R_WD, constants)


def body(scene: Scene) -> Formulation:
    """Return quaternion and rates in principal axes."""
    return _with_attitude(scene, forms.quaternion, to_quaternion, QUATERNION)


def base_vectors(scene: Scene) -> Formulation:
    """Return third and first row of the rotation matrix, in world axes whose third is the field's axis, and rates.

    The second row is their cross product. The rows are not orthonormalised, so their drift shows in the samples.
    """
    formulation = _with_attitude(scene, forms.base_vectors, lambda R: R[[2, 0]].ravel(), ROWS)
    return replace(formulation, fast_math=True)  # `Heyoka` has what it changes


def angle(scene: Scene) -> Formulation:
    """Return the field's axis in the body, one angle about it, and rates, in axes whose third stays away from the pole.

    The field does not turn.
    """
    axes = scene.derive(_axes_away_from_pole)
    formulation = _with_attitude(scene, forms.axis_and_angle_in_body, _row_and_angle, ROW_AND_ANGLE, axes)
    return replace(formulation, fast_math=True)


def _row_and_angle(R: Array) -> Array:
    turned = R @ _smallest_rotation(R[2])
    return np.append(R[2], np.arctan2(turned[1, 0], turned[0, 0]))


def _axes_away_from_pole(scene: Scene) -> EngineAxes:
    """Return principal axes, ordered and directed such that the field's axis stays farthest away from the negative third one.

    A trial run is looked at, until its end or for `_TRIAL_STEPS` steps.
    """
    trial, axes = base_vectors(scene), principal_axes(scene)
    with forms.compile_double(trial.form, _TRIAL_TOL, trial.fast_math).borrow() as integrator:
        integrator.pars[:] = trial.parameters[: len(integrator.pars)]
        integrator.time, integrator.state[:] = 0.0, trial.start
        states = integrator.propagate_grid(np.linspace(0.0, scene.t_end, _TRIAL_SAMPLES), max_steps=_TRIAL_STEPS)[-1]
    g = states[np.isfinite(states).all(axis=1), :3] @ trial.axes.R_BF.T @ axes.R_BF
    distances = np.stack([1 + g.min(axis=0), 1 - g.max(axis=0)])
    below, third = np.unravel_index(int(np.argmax(distances)), distances.shape)
    axes = order_axes(axes, int(third))
    return replace(axes, R_BF=axes.R_BF @ _DOWN) if below else axes


def _with_attitude(
    scene: Scene,
    attitude: Callable[..., Any],
    write: Callable[[Array], Array],
    kind: int,
    kept: EngineAxes | None = None,
) -> Formulation:
    """Return Euler's equations with the equations of an attitude that `write` makes of a matrix, in axes that are `kept`."""
    R_WD, turn_D, (axes, acceleration, values) = express_field(scene, kept)
    equations, rotor = forms.EulerEquations(attitude, acceleration), (hat(axes.rotor) / axes.J[:, None]).ravel().tolist()
    form, parameters = forms.form_of(equations, [*_gyroscopic(axes), *turn_D.tolist(), *rotor, *values])
    start = np.concatenate([write(R_WD.T @ axes.R_WF0), axes.w0])
    orbit = scene.potential.orbit if isinstance(scene.potential, Turning) else None
    constants = [orbit.rate, *orbit.normal_W.tolist()] if orbit else [0.0] * 4
    return Formulation(axes, form, parameters, start, kind, constants, R_WD)


def non_spinning(scene: Scene) -> Formulation:
    """Return quaternion and momentum of the frame that turns at l/J1; the spin of a symmetric body has a closed form."""
    axes = symmetric_axes(scene)
    assert axes is not None  # checked by `Heyoka.unsupported`
    u0, constants = _slow_frame(axes, np.eye(3))
    form, parameters = forms.form_of(forms.non_spinning, [axes.moment[2] / axes.J[0], u0[2]])
    start = np.concatenate([axes.q0, u0[:2]])
    return Formulation(axes, form, parameters, start, NON_SPINNING, constants, np.eye(3))


def lean(scene: Scene) -> Formulation:
    """Return the formulation with the fewest products."""
    axes = symmetric_axes(scene)
    if axes is None:
        if not scene.free or scene.body.rotor_momentum is not None:
            return base_vectors(scene)
        # A body at rest has no momentum to turn about.
        return _free_rates_and_angle(scene) if scene.kinetic_energy0 > 0 else body(scene)
    lowest, highest = _heights(axes)
    if scene.free or max(1 + lowest, 1 - highest) < _SMALLEST_POLE_DISTANCE:
        return non_spinning(scene)
    return _axis_and_angle(axes, np.eye(3) if lowest > -highest else _DOWN)


def _free_rates_and_angle(scene: Scene) -> Formulation:
    """Return the formulation in principal axes in the order in which the momentum circulates about the third axis, L3 > 0.

    The third is the axis of the largest moment if l^2 > 2 T J_middle, of the smallest otherwise.
    """
    axes = principal_axes(scene)
    L0, order = axes.J * axes.w0, np.argsort(axes.J)
    third = int(order[2] if L0 @ axes.w0 * axes.J[order[1]] < L0 @ L0 else order[0])
    axes = order_axes(axes, third)
    if L0[third] < 0:
        axes = replace(axes, R_BF=axes.R_BF @ _DOWN)
    L0 = axes.J * axes.w0
    momentum = float(np.linalg.norm(L0))
    slope = momentum / axes.J[2]
    numerator = (L0 @ axes.w0 - momentum * slope) / axes.J[2]
    form, parameters = forms.form_of(forms.free_rates_and_angle, [*_gyroscopic(axes), slope, numerator])
    base = axes.R_WF0 @ _smallest_rotation(L0 / momentum)
    return Formulation(axes, form, parameters, np.append(axes.w0, 0.0), RATES_AND_ANGLE, [slope, *axes.J.tolist()], base)


def _axis_and_angle(axes: EngineAxes, world: Array) -> Formulation:
    R0, (u0, constants) = world @ axes.R_WF0, _slow_frame(axes, world)
    n0, k = R0[:, 2], axes.moment[2] / axes.J[0] * world[2, 2]
    form, parameters = forms.form_of(forms.axis_and_angle, [k, u0[2], u0 @ n0 + u0[2]])
    turned = _smallest_rotation(n0).T @ R0
    p0 = float(np.arctan2(turned[1, 0], turned[0, 0]))
    start = np.array([*n0, *u0[:2], p0])
    return Formulation(axes, form, parameters, start, AXIS_AND_ANGLE, constants, world)


def _gyroscopic(axes: EngineAxes) -> list[float]:
    """Return the factors of w2 w3, w3 w1 and w1 w2 in Euler's equations."""
    J1, J2, J3 = axes.J.tolist()
    return [(J2 - J3) / J1, (J3 - J1) / J2, (J1 - J2) / J3]


def _slow_frame(axes: EngineAxes, world: Array) -> tuple[Array, list[float]]:
    """Return the rates l/J1 of the slow frame, world axes turned by `world`, and the constants of its states."""
    J1, J2, J3 = axes.J.tolist()
    u0 = world @ (axes.R_WF0 @ (axes.J * axes.w0) / J1)
    return u0, [(1 - J3 / J1) * float(axes.w0[2]), u0[2], J1 / J2, J1 / J3]


def _heights(axes: EngineAxes) -> tuple[float, float]:
    """Return the lowest and highest n_z of a symmetric top: the roots around its initial value of the cubic J1^2 n_z'^2."""
    (J1, _, J3), M = axes.J.tolist(), float(axes.moment[2])
    n = float(axes.R_WF0[2, 2])
    l3, L3 = float(axes.R_WF0[2] @ (axes.J * axes.w0)), J3 * float(axes.w0[2])
    energy = J1 * float(axes.w0[:2] @ axes.w0[:2]) / 2 + M * n
    cubic = np.polysub(2 * J1 * np.polymul([-1, 0, 1], [-M, energy]), np.polymul([-L3, l3], [-L3, l3]))
    # 1e-6: `roots` splits a double root by the root of round-off.
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


def _smallest_rotation(n: Array) -> Array:
    """Return the smallest rotation (3, 3) from e_3 to a unit vector (3,) that is not -e_3."""
    x, y, z = n.tolist()
    a, b = x / (1 + z), y / (1 + z)
    return np.array([[1 - x * a, -x * b, x], [-x * b, 1 - y * b, y], [-x, -y, z]])
