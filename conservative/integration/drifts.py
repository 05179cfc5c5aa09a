"""Drifts of the invariants of many bodies, from the samples of a block.

The rules of drifts and bounds are those of one body: `Trajectory.drift` and `conservative.trajectory.accept`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..attitude import Array
from ..batch import Batch
from ..deferred_imports import kernels
from ..invariants import MOMENTUM_UNIT, sizes
from ..potentials.potential import depends_on_time
from ..potentials.turning import Turning, static_part

ORTHONORMALITY = "orthonormality"
AXIAL = "axial momentum"
NEARLY = 1e-11
"""Relative difference of moments up to which the symmetry of a body is checked in full: more than counts as equal."""


@dataclass(frozen=True, eq=False)
class Drifts:
    """The largest drifts of n bodies over their samples, dimensionless.

    Attributes
    ----------
    values
        (n, k) by the names of `list_drifts`, relative to the scales of the invariants; nan where a body has no such invariant,
        or its samples are not finite.
    bounded
        (n, k) relative to the scales of the bounds of a method.
    """

    values: Array
    bounded: Array


def list_drifts(bodies: Batch) -> tuple[str, ...]:
    """Return the names of the columns of `Drifts`: orthonormality, and the invariants of the scene."""
    return (ORTHONORMALITY, *(each.name for each in bodies.scene.invariants))


def find_drifts(bodies: Batch, t: Array, R_WB: Array, w_WB_B: Array) -> Drifts:
    """Return the largest drifts of the invariants of each body.

    Parameters
    ----------
    bodies
        n bodies.
    t, R_WB, w_WB_B
        Times (m,), s, attitudes (n, m, 3, 3), body to world, and rates (n, m, 3), rad/s, body axes.
    """
    n, m = w_WB_B.shape[:2]
    inertia, axes, axial = inertia_of(bodies), find_axes(bodies), find_axial(bodies)
    expected, scales = find_start(bodies, inertia, axes, axial)
    found, V = np.empty((n, 4)), field_energies(bodies, t, R_WB, w_WB_B)
    kernels("drifts_of_many").measure(R_WB, w_WB_B, V, inertia, axes, expected, found)
    skew, energy, momentum, axial_momentum = found.T
    values, bounded = [skew], [skew]
    for each in bodies.scene.invariants:
        if each in bodies.scene.extra_invariants:
            start = each.evaluate(bodies.R_WB0, bodies.w_WB_B0)
            at = each.evaluate(R_WB.reshape(-1, 3, 3), w_WB_B.reshape(-1, 3)).reshape(n, m, *start.shape[1:])
            off = (at - start[:, None]) / each.scale
            drift = sizes(off.reshape(n * m, *start.shape[1:])).reshape(n, m).max(axis=1)
        elif each.unit == "J":
            drift = energy
        else:
            drift = axial_momentum if each.name == AXIAL else momentum
        is_momentum = each.unit == MOMENTUM_UNIT and each not in bodies.scene.extra_invariants
        bounded.append(drift * (scales[:, 1] / scales[:, 2]) if is_momentum else drift)
        values.append(np.where(np.isnan(axial[:, 0]), np.nan, drift) if each.name == AXIAL else drift)
    return Drifts(np.stack(values, axis=1), np.stack(bounded, axis=1))


def inertia_of(bodies: Batch) -> Array:
    """Return the inertia (n, 3, 3), kg m^2, body axes; (1, 3, 3) where all have the scene's."""
    return bodies.scene.body.inertia[None].copy() if bodies.inertia is None else bodies.inertia


def momenta_of(bodies: Batch) -> Array:
    """Return the momenta (n, 3) at the start, kg m^2/s, body axes."""
    if bodies.inertia is None:
        return np.asarray(bodies.w_WB_B0 @ bodies.scene.body.inertia)
    return np.sum(bodies.inertia * bodies.w_WB_B0[:, None], axis=2)  # ten times as fast as products of small matrices


def find_start(bodies: Batch, inertia: Array, axes: Array, axial: Array) -> tuple[Array, Array]:
    """Return the initial values of the invariants and their reference scales.

    The rules are those of `Scene.energy_scale`, `invariants_of` and `kept_sizes`. `conservative.kernels.drifts_of_many` defines
    the columns of `expected` (n, 10) and `scales` (n, 3), in SI units. The inertia is (n or 1, 3, 3), kg m^2, body axes, `axes`
    are those of `find_axes` (n or 1, 3, 3), `axial` those of `find_axial` (n or 1, 3).
    """
    n, potential = len(bodies), bodies.scene.potential
    R, w = np.ascontiguousarray(bodies.R_WB0), np.ascontiguousarray(bodies.w_WB_B0)
    V = field_energies(bodies, np.zeros(1), R[:, None], w[:, None])
    of_field = np.atleast_1d(np.asarray(field_scales(bodies), dtype=float))
    moments = bodies.scene.body.moments[None] if bodies.inertia is None else bodies.principal[0]
    largest = moments.max(axis=1)
    expected, scales = np.zeros((n, 10)), np.empty((n, 3))
    fixed = inertia, axes, np.nan_to_num(axial), of_field, largest
    kernels("drifts_of_many").find_start(R, w, V[:, 0] if len(V) else np.zeros(n), *fixed, expected, scales)
    if isinstance(potential, Turning):
        scales[:, 0] += potential.orbit.rate * np.sqrt(2) * np.sqrt(largest) * np.sqrt(scales[:, 0])
    if any(each.unit == "J" for each in bodies.scene.invariants):
        expected[:, 1] = 1 / scales[:, 0]
    return expected, scales


def find_axial(bodies: Batch) -> Array:
    """Return unit vectors (n, 3), or (1, 3) for all, body axes, about which body and field are symmetric; nan where not."""
    none = np.full((1, 3), np.nan)
    if bodies.scene.symmetry_axis_B is None:
        return none
    if bodies.inertia is None and not bodies.parameters:
        return bodies.scene.symmetry_axis_B[None]
    found = np.repeat(none, len(bodies), axis=0)
    J = np.sort(bodies.principal[0], axis=1)
    nearly_symmetric = np.diff(J, axis=1).min(axis=1) <= NEARLY * J[:, 2]
    for i in np.flatnonzero(nearly_symmetric).tolist():
        axis = bodies.take(i).symmetry_axis_B
        found[i] = none[0] if axis is None else axis
    return found


def find_axes(bodies: Batch) -> Array:
    """Return unit vectors (n, 3, 3), or (1, 3, 3) for all, row by row, along which momentum is conserved; else 0."""
    if bodies.scene.potential is None:
        return np.eye(3)[None]
    axis = bodies.scene.potential.axis_W
    own = bodies.varied.axes_W() if bodies.parameters else np.zeros((1, 3)) if axis is None else axis[None]
    found = np.zeros((len(own), 3, 3))
    if axis is not None:  # else there is no such invariant
        found[:, 0] = own
    return found


def field_scales(bodies: Batch) -> Any:
    """Return the size of the field, J: of each body (n,), or one for all."""
    if bodies.scene.potential is None:
        return 0.0
    return bodies.varied.scales() if bodies.parameters else bodies.scene.potential.scale()


def field_energies(bodies: Batch, t: Array, R_WB: Array, w_WB_B: Array) -> Array:
    """Return the energies (n, m), J, that make conserved energies of the kinetic ones; (0, 0) if there is no such energy.

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
