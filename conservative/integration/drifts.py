"""What each of many bodies conserves, and how far the samples of a block are off it. Source: as `conservative.invariants`.

Drifts, and the rule of bounds, are those of one body: what `Trajectory.drift` and `conservative.trajectory.accept` say.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..attitude import Array
from ..deferred_imports import kernels
from ..invariants import MOMENTUM_UNIT, Invariant, sizes
from ..methods.many import Bodies
from ..potentials.potential import depends_on_time
from ..potentials.turning import Turning, static_part

ORTHONORMALITY = "orthonormality"
AXIAL = "axial momentum"
NEARLY = 1e-11
"""Relative difference of moments up to which a body is asked whether it is symmetric: more than what counts as equal."""


@dataclass(frozen=True, eq=False)
class Drifts:
    """The largest drifts of n bodies over their samples, dimensionless.

    Attributes
    ----------
    values
        (n, k) by the names of `list_drifts`, relative to the scales of the invariants; nan where a body has no such invariant,
        or its samples are not finite.
    bounded
        (n, k) relative to what the bounds of a method are relative to.
    """

    values: Array
    bounded: Array


def list_drifts(bodies: Bodies) -> tuple[str, ...]:
    """Return the names of what drifts: orthonormality, and the invariants of the scene."""
    return (ORTHONORMALITY, *(each.name for each in bodies.scene.invariants))


def find_drifts(bodies: Bodies, t: Array, R_WB: Array, w_WB_B: Array) -> Drifts:
    """Return how far samples are off what each body conserves.

    Parameters
    ----------
    bodies
        n bodies.
    t, R_WB, w_WB_B
        Times (m,), s, attitudes (n, m, 3, 3), body to world, and rates (n, m, 3), rad/s, body axes.
    """
    inertia, axes, axial = inertia_of(bodies), find_axes(bodies), find_axial(bodies)
    expected, scales = find_start(bodies, inertia, axes, axial)
    found, V = np.empty((len(bodies), 4)), field_energies(bodies, t, R_WB, w_WB_B)
    kernels("drifts_of_many").measure(R_WB, w_WB_B, V, inertia, axes, expected, found)
    values = np.stack([_drift_of(each, found, bodies, (R_WB, w_WB_B)) for each in (None, *bodies.scene.invariants)], axis=1)
    bounded = values.copy()
    for column, each in enumerate(bodies.scene.invariants, start=1):
        if each.unit == MOMENTUM_UNIT and each not in bodies.scene.extra_invariants:
            bounded[:, column] *= scales[:, 1] / scales[:, 2]
        if each.name == AXIAL:
            values[np.isnan(axial[:, 0]) & np.ones(len(bodies), dtype=bool), column] = np.nan
    return Drifts(values, bounded)


def _drift_of(invariant: Invariant | None, found: Array, bodies: Bodies, samples: tuple[Array, Array]) -> Array:
    """Return the largest drift (n,) of an invariant, None for orthonormality, out of what the kernel found (n, 4)."""
    if invariant is None:
        return found[:, 0]
    if invariant in bodies.scene.extra_invariants:
        return _drift_of_extra(invariant, bodies, *samples)
    if invariant.unit == "J":
        return found[:, 1]
    return found[:, 3] if invariant.name == AXIAL else found[:, 2]


def _drift_of_extra(invariant: Invariant, bodies: Bodies, R_WB: Array, w_WB_B: Array) -> Array:
    n, m = w_WB_B.shape[:2]
    start = invariant.evaluate(bodies.R_WB0, bodies.w_WB_B0)
    at = invariant.evaluate(R_WB.reshape(-1, 3, 3), w_WB_B.reshape(-1, 3)).reshape(n, m, *start.shape[1:])
    off = (at - start[:, None]) / invariant.scale
    return sizes(off.reshape(n * m, *start.shape[1:])).reshape(n, m).max(axis=1)


def inertia_of(bodies: Bodies) -> Array:
    """Return the inertia (n, 3, 3), kg m^2, body axes; (1, 3, 3) where all have the scene's."""
    return bodies.scene.body.inertia[None].copy() if bodies.inertia is None else bodies.inertia


def momenta_of(bodies: Bodies) -> Array:
    """Return the momenta (n, 3) at the start, kg m^2/s, body axes."""
    if bodies.inertia is None:
        return np.asarray(bodies.w_WB_B0 @ bodies.scene.body.inertia)
    return np.sum(bodies.inertia * bodies.w_WB_B0[:, None], axis=2)  # ten times as fast as products of small matrices


def find_start(bodies: Bodies, inertia: Array, axes: Array, axial: Array) -> tuple[Array, Array]:
    """Return what the start has of what is conserved, and what departures are relative to.

    The rule is that of `Scene.energy_scale`, `invariants_of` and `kept_sizes`, and both are what
    `conservative.kernels.drifts_of_many` says of `expected` (n, 10) and `scales` (n, 3), in SI units, kg, m and s. The inertia
    is (n or 1, 3, 3), kg m^2, body axes, `axes` are those of `find_axes` (n or 1, 3, 3), `axial` those of `find_axial` (n or
    1, 3).
    """
    n, potential = len(bodies), bodies.scene.potential
    R, w = np.ascontiguousarray(bodies.R_WB0), np.ascontiguousarray(bodies.w_WB_B0)
    V = field_energies(bodies, np.zeros(1), R[:, None], w[:, None])
    of_field, largest = np.atleast_1d(np.asarray(field_scales(bodies), dtype=float)), largest_moments(bodies)
    expected, scales = np.zeros((n, 10)), np.empty((n, 3))
    fixed = inertia, axes, np.nan_to_num(axial), of_field, largest
    kernels("drifts_of_many").find_start(R, w, V[:, 0] if len(V) else np.zeros(n), *fixed, expected, scales)
    if isinstance(potential, Turning):
        scales[:, 0] += potential.orbit.rate * np.sqrt(2) * np.sqrt(largest) * np.sqrt(scales[:, 0])
    if any(each.unit == "J" for each in bodies.scene.invariants):
        expected[:, 1] = 1 / scales[:, 0]
    return expected, scales


def largest_moments(bodies: Bodies) -> Array:
    """Return the largest moment (n,) of each body, kg m^2; (1,) where all have the scene's."""
    return bodies.scene.body.moments.max(keepdims=True) if bodies.inertia is None else bodies.principal[0].max(axis=1)


def find_axial(bodies: Bodies) -> Array:
    """Return unit vectors (n, 3), or (1, 3) for all, body axes, about which body and field are symmetric; nan where not."""
    none = np.full((1, 3), np.nan)
    if bodies.scene.symmetry_axis_B is None:
        return none
    if bodies.inertia is None and not bodies.parameters:
        return bodies.scene.symmetry_axis_B[None]
    found = np.repeat(none, len(bodies), axis=0)
    for i in np.flatnonzero(find_nearly_symmetric(bodies)).tolist():
        axis = bodies.take(i).symmetry_axis_B
        found[i] = none[0] if axis is None else axis
    return found


def find_nearly_symmetric(bodies: Bodies) -> Any:
    """Return which of n bodies (n,) have two moments that differ by no more than `NEARLY` of the largest."""
    J = np.sort(bodies.principal[0], axis=1)
    return np.diff(J, axis=1).min(axis=1) <= NEARLY * J[:, 2]


def find_axes(bodies: Bodies) -> Array:
    """Return unit vectors (n, 3, 3), or (1, 3, 3) for all, row by row, that momenta are conserved along; 0 is none."""
    if bodies.scene.potential is None:
        return np.eye(3)[None]
    axis = bodies.scene.potential.axis_W
    own = bodies.varied.axes_W() if bodies.parameters else np.zeros((1, 3)) if axis is None else axis[None]
    found = np.zeros((len(own), 3, 3))
    if axis is not None:  # else there is no such invariant
        found[:, 0] = own
    return found


def field_scales(bodies: Bodies) -> Any:
    """Return the size of the field, J: of each body (n,), or one for all."""
    if bodies.scene.potential is None:
        return 0.0
    return bodies.varied.scales() if bodies.parameters else bodies.scene.potential.scale()


def field_energies(bodies: Bodies, t: Array, R_WB: Array, w_WB_B: Array) -> Array:
    """Return what makes the conserved energies (n, m), J, of the kinetic ones; (0, 0) where nothing does.

    Samples are at times (m,), s: attitudes (n, m, 3, 3), body to world, and rates (n, m, 3), rad/s, body axes.
    """
    potential = bodies.scene.potential
    if potential is None or (depends_on_time(potential) and not isinstance(potential, Turning)):
        return np.empty((0, 0))
    R_OB = bodies.scene.in_field_axes(R_WB, t)
    V = bodies.varied.energies(R_OB) if bodies.parameters else static_part(potential).energy(R_OB)
    if not isinstance(potential, Turning):
        return np.ascontiguousarray(V)
    normal_O = potential.orbit.normal_W @ R_OB  # of the body's axes: the normal is the same in W and O
    L_B = (inertia_of(bodies)[:, None] @ w_WB_B[..., None])[..., 0]
    return np.ascontiguousarray(V - potential.orbit.rate * np.sum(normal_O * L_B, axis=-1))
