"""Largest drifts of the invariants of n bodies over their samples. A single body is a batch of one.

A run is accepted by these drifts, and an `Ensemble` lists them. `Trajectory.drift` returns the drift of one invariant at each
sample; `conservative.invariants` has the definitions and the scales of both.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from .attitude import Array
from .batch import Batch
from .deferred_imports import kernels
from .grid import Grid
from .invariants import AXIAL_MOMENTUM, MOMENTUM_UNIT, sizes
from .potentials.field import lengths
from .potentials.potential import depends_on_time
from .potentials.turning import Turning, static_part
from .scene import Scene

ORTHONORMALITY = "orthonormality"
_NO_ENERGIES = np.empty((0, 0))


def measure_drifts(
    bodies: Batch, reference: Array, grid: Grid, t: Array, R_WB: Array, w_WB_B: Array, supplied: Array | None = None
) -> Array:
    """Return the largest drifts (n, 5) of each body, dimensionless; `reference` (n, 10, 3) is from `find_reference`.

    The columns are orthonormality, energy, momentum, axial momentum, and the largest drift of the invariants that the method
    conserves. They are nan for a body with samples that are not finite, and for all bodies if the times are not the grid's.
    Samples are at times (m,), s: attitudes (n, m, 3, 3), body to world, and rates (n, m, 3), rad/s, body axes. In scenes with
    loads, drifts belong to the balances with `supplied` (n, m, 4), as in `Trajectory`; nan for a body that has none.
    """
    drifts, rotor, potential = np.empty((len(reference), 5)), bodies.scene.body.rotor_momentum, bodies.scene.potential
    V, impulse = _NO_ENERGIES if potential is None else field_energies(bodies, t, R_WB, w_WB_B), None
    if supplied is not None:
        sums = np.where(np.isnan(supplied), 0.0, supplied)
        work, impulse = sums[..., 0], np.ascontiguousarray(sums[..., 1:])
        if isinstance(potential, Turning):
            work = work - impulse @ (potential.orbit.rate * potential.orbit.normal_W)
        V = V - work if len(V) else -work
        if (motor := bodies.scene.body.motor) is not None:  # a change of h counts as an impulse of the opposite sign
            change = np.array([motor.at(time) for time in t.tolist()]) - motor.at(0.0)
            impulse = impulse - (R_WB @ change[:, :, None])[..., 0]
    kernels("drifts").measure(grid.dt, grid.every, grid.n_steps, t, R_WB, w_WB_B, V, impulse, rotor, reference, drifts)
    if supplied is not None:
        drifts[np.isnan(supplied).any(axis=(1, 2)), 1:] = np.nan
    return drifts


def drifts_of(scene: Scene, conserved: frozenset[str]) -> Callable[..., Array]:
    """Return `measure_drifts` of the body of a scene, for a method that conserves the invariants of these names."""
    bodies = scene.derive(Batch.of)
    return partial(measure_drifts, bodies, find_reference(bodies, conserved))


def find_reference(bodies: Batch, conserved: frozenset[str] = frozenset()) -> Array:
    """Return initial values of the invariants of n bodies, and their reference scales, as rows (n, 10, 3).

    `conservative.kernels.drifts.measure` defines the rows. The method conserves the invariants of these names. Scales follow
    the rules of `Scene.energy_scale`, `invariants_of` and `kept_sizes`.
    """
    scene, potential, w = bodies.scene, bodies.scene.potential, bodies.w_WB_B0
    largest = (scene.body.moments[None] if bodies.inertia is None else bodies.principal[0]).max(axis=1)
    L_B, kinetic, rotor = bodies.momenta, bodies.kinetic_energies, scene.body.rotor_momentum
    scale = bodies.energies
    scale[scale == 0] = 1.0
    largest_momentum = np.sqrt(2 * largest) * np.sqrt(scale)
    momentum = lengths(L_B)
    momentum = np.where(momentum > 0, momentum, largest_momentum / np.sqrt(2))
    if rotor is not None:
        largest_momentum += np.linalg.norm(rotor)
    if isinstance(potential, Turning):
        scale += potential.orbit.rate * largest_momentum

    rows = np.zeros((len(bodies), 10, 3))
    rows[:, :3] = scene.body.inertia if bodies.inertia is None else bodies.inertia
    # Unit vectors, row by row, along which momentum is conserved; otherwise 0.
    if potential is None:
        rows[:, 3:6] = np.eye(3) / momentum[:, None, None]
    elif potential.axis_W is not None:
        rows[:, 3] = (bodies.varied.axes_W() if bodies.parameters else potential.axis_W) / momentum[:, None]
    L_W = np.einsum("nij,nj->ni", bodies.R_WB0, L_B)
    rows[:, 6] = np.einsum("nij,nj->ni", rows[:, 3:6], L_W)
    if scene.symmetry_axis_B is not None:
        rows[:, 7] = np.nan_to_num(bodies.symmetry_axes_B) / momentum[:, None]
        rows[:, 8, 2] = np.einsum("ni,ni->n", rows[:, 7], L_B)
    own = [invariant for invariant in scene.invariants if invariant not in scene.extra_invariants]
    if any(invariant.unit == "J" for invariant in own):
        V = field_energies(bodies, np.zeros(1), bodies.R_WB0[:, None], w[:, None])
        rows[:, 8, 0], rows[:, 8, 1] = kinetic + (V[:, 0] if len(V) else 0.0), 1 / scale
    for invariant in own:
        if invariant.name in conserved and invariant.unit == "J":
            rows[:, 9, 0] = 1.0
        elif invariant.name in conserved:
            rows[:, 9, 2 if invariant.name == AXIAL_MOMENTUM else 1] = momentum / np.maximum(momentum, largest_momentum)
    return rows


def list_drifts(bodies: Batch) -> tuple[str, ...]:
    """Return the names of drifts: orthonormality, and the invariants of the scene; in free flight of the rotation only."""
    return (ORTHONORMALITY, *(invariant.name for invariant in bodies.scene.rotation_only.invariants))


def arrange_drifts(bodies: Batch, measured: Array, R_WB: Array, w_WB_B: Array) -> Array:
    """Return the largest drifts (n, k) by the names of `list_drifts`; nan if a body failed or does not have the invariant.

    `measured` (n, 5) is from `measure_drifts`. The samples are attitudes (n, m, 3, 3), body to world, and rates (n, m, 3),
    rad/s, body axes.
    """
    n, m = w_WB_B.shape[:2]
    scene, columns = bodies.scene, [measured[:, 0]]
    for invariant in scene.rotation_only.invariants:
        if invariant in scene.extra_invariants:
            start = invariant.evaluate(bodies.R_WB0, bodies.w_WB_B0)
            values = invariant.evaluate(R_WB.reshape(-1, 3, 3), w_WB_B.reshape(-1, 3)).reshape(n, m, *start.shape[1:])
            drift = (values - start[:, None]) / invariant.scale
            columns.append(sizes(drift.reshape(n * m, *start.shape[1:])).reshape(n, m).max(axis=1))
        elif invariant.name == AXIAL_MOMENTUM:
            columns.append(np.where(np.isnan(bodies.symmetry_axes_B[:, 0]), np.nan, measured[:, 3]))
        else:
            columns.append(measured[:, 2 if invariant.unit == MOMENTUM_UNIT else 1])
    return np.stack(columns, axis=1)


def field_energies(bodies: Batch, t: Array, R_WB: Array, w_WB_B: Array) -> Array:
    """Return the energies (n, m), J, whose sum with the kinetic energies is conserved; (0, 0) if there are none.

    In a turning field they include the term of the Jacobi integral. Samples are at times (m,), s: attitudes (n, m, 3, 3), body
    to world, and rates (n, m, 3), rad/s, body axes.
    """
    potential = bodies.scene.potential
    if potential is None or (depends_on_time(potential) and not isinstance(potential, Turning)):
        return _NO_ENERGIES
    R_OB = bodies.scene.in_field_axes(R_WB, t)
    V = bodies.varied.energies(R_OB) if bodies.parameters else static_part(potential).energy(R_OB)
    if isinstance(potential, Turning):
        inertia = bodies.scene.body.inertia if bodies.inertia is None else bodies.inertia[:, None]
        L_B = (inertia @ w_WB_B[..., None])[..., 0]
        if bodies.scene.body.rotor_momentum is not None:
            L_B += bodies.scene.body.rotor_momentum
        normal_B = potential.orbit.normal_W @ R_OB  # the normal has the same components in W and O
        V = V - potential.orbit.rate * np.sum(normal_B * L_B, axis=-1)
    return np.ascontiguousarray(V)
