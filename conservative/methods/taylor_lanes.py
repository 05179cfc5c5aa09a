"""Taylor series of many bodies at once, each in a lane of the kernel `taylor`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..attitude import Array, axes_about, from_quaternion, to_quaternion
from ..batch import Batch
from ..deferred_imports import kernels
from ..errors import IntegrationFailed, NotConverged
from ..grid import Grid
from ..potentials.field import FieldPotential, into_axes, to_tuples
from ..potentials.uniform_gravity import UniformField
from .columns import stack_columns, take_pieces
from .many import Block, RunMany
from .principal_axes import spin_rate
from .units import find_units_of_bodies

NEARLY_EQUAL = 4e-12
"""Relative difference of two moments below which a body may be symmetric: no less than `Scene.symmetry_axis_B` allows."""


def prepare_bodies(bodies: Batch, grid: Grid, order: int) -> RunMany | None:
    """Return the run of bodies by series of an order; None if they have to run alone.

    This does for all bodies at once what `taylor_model` does for one scene. Each body has units in which it is of order one.
    """
    potential, n, s = bodies.scene.potential, len(bodies), grid.n_samples
    if bodies.scene.body.rotor_momentum is not None or not isinstance(potential, FieldPotential | None):
        return None
    kernel = kernels("taylor")
    moments, J, R_BP, symmetric = find_frames(bodies)
    w = into_axes(bodies.w_WB_B0, R_BP)
    field = None if potential is None else potential.fields(bodies.parameters, R_BP)
    axis_W = np.zeros((n, 3)) if field is None else np.asarray(field.axis_W())
    energy = np.sum(moments * w * w, axis=1) / 2 + (0.0 if field is None else field.scale())
    mass, time = find_units_of_bodies(moments, energy, grid.dt)
    energy_unit = mass / time / time
    L = w * time[:, None] * (moments / mass[:, None])
    if field is None or not axis_W.any():
        axis_W = (bodies.R_WB0 @ (R_BP @ (w * moments)[..., None]))[..., 0]
        field = kernel.Free(np.linalg.norm(L, axis=1))
    else:
        field = field.in_units(energy_unit)
        if isinstance(field, UniformField):  # the moment of a symmetric body is along its axis, except for round-off
            field = field._replace(x=np.where(symmetric, 0.0, field.x), y=np.where(symmetric, 0.0, field.y))
    # The third of the axes D is along the field, or along the momentum of a free body. An axis that all bodies share has
    # stride 0 and is converted once.
    R_WD = np.broadcast_to(directions(axis_W if axis_W.strides[0] else axis_W[:1]), (n, 3, 3))
    R_DP = R_WD.swapaxes(1, 2) @ bodies.R_WB0 @ R_BP
    energy, ones = np.where(energy > 0, energy, 1.0) / energy_unit, np.ones(n)
    J_in_units = J / mass[:, None]
    start = kernel.Bodies(
        J=J_in_units,
        J_inverse=1 / J_in_units,
        field=field,
        loose=np.column_stack([ones, ones, ~symmetric]),
        scales=np.column_stack([energy, np.sqrt(2 * energy * (moments / mass[:, None]).max(axis=1))]),
        g=R_DP[:, 2],
        a=R_DP[:, 0],
        L=L,
        h=grid.dt / time,
        axes=R_WD,
        R_BP=R_BP,
        # The motion of a symmetric body has its first moment three times, so its third rate is J3 / J1 times the real one.
        units=np.column_stack([ones, ones, np.where(symmetric, J[:, 2] / moments[:, 2], 1.0)]) / time[:, None],
    )
    motion = kernel.LaneState(start.g, start.a, L / J_in_units, np.zeros(n), np.zeros(n))
    width, like = kernels("compiler.lanes").REGISTER, (zeros_like(start), zeros_like(motion))
    columns, motions = (stack_columns(list(flatten(value, n)), width) for value in (start, motion))
    m = columns.shape[1]
    spin = np.where(symmetric, spin_rate(moments[:, 0], moments[:, 2], w[:, 2] * moments[:, 2]), 0.0)
    angles = np.outer(grid.t, np.pad(spin, (0, m - n))) if symmetric.any() else np.zeros((1, m))
    turns = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    # Time of a step of all bodies, s, roughly: it only decides how many steps are taken between two checks for an interrupt.
    cost = m * (20e-9 + 0.7e-9 * order**2)
    R_WB0 = from_quaternion(to_quaternion(bodies.R_WB0))

    def run() -> Block:
        ends, R_WB, w_WB_B = motions.copy(), np.empty((m, s, 3, 3)), np.empty((m, s, 3))
        inputs, samples = (order, like, columns, ends, turns), (R_WB.reshape(-1), w_WB_B.reshape(-1))
        take_pieces(
            grid.n_steps, cost, lambda done, last: kernel.enter_many(*inputs, done, last, grid.n_steps, grid.every, *samples)
        )
        R_WB[:n, 0], w_WB_B[:n, 0] = R_WB0, bodies.w_WB_B0
        failed, defects = ends[-2, :n], ends[-1, :n]  # the last rows of `LaneState`: the step that failed, or 0, and its defect
        failures: dict[int, IntegrationFailed] = {}
        for i in np.flatnonzero(failed).tolist():
            done = int(failed[i]) - 1
            failures[i] = NotConverged(done + 1, done * grid.dt, float(defects[i]), kernel.FAILURE)
            R_WB[i, grid.count_samples(done) :], w_WB_B[i, grid.count_samples(done) :] = np.nan, np.nan
        return Block(R_WB[:n], w_WB_B[:n], failed == 0, failures)

    return run


def find_frames(bodies: Batch) -> tuple[Array, Array, Array, Any]:
    """Return the axes in which bodies are integrated: (moments, J, R_BP, symmetric).

    Moments (n, 3), kg m^2, are along these axes, and rotations R_BP (n, 3, 3) take them to body axes. `symmetric` (n,) is true
    for a body that is symmetric together with its field. It is described in the frame that does not spin, so that its motion
    has the moments J (n, 3): J1 three times. Bodies that may be symmetric are examined one by one, unless all are the same.
    """
    moments, R_BP = (np.array(array) for array in bodies.principal)
    J, symmetric = moments.copy(), np.zeros(len(bodies), bool)
    gaps = np.abs(moments - np.roll(moments, 1, axis=1)).min(axis=1)
    near = np.flatnonzero(gaps <= NEARLY_EQUAL * moments.max(axis=1))
    alike = bodies.inertia is None and not bodies.parameters
    for part in [near] if alike and len(near) else near[:, None]:  # all of them, or one body at a time
        i = int(part[0])
        axis_B = bodies.take(i).symmetry_axis_B
        if axis_B is not None:
            # The moment about the axis of symmetry last. The others differ by round-off at most.
            x, y, J3 = np.roll(moments[i], 2 - int(np.argmax(np.abs(axis_B @ R_BP[i]))))
            J1 = (x + y) / 2
            symmetric[part], J[part], moments[part], R_BP[part] = True, J1, (J1, J1, J3), axes_about(axis_B)
    return moments, J, R_BP, symmetric


def directions(axes: Array) -> Array:
    """Return the rotations (n, 3, 3) of `axes_about` for vectors (n, 3): third columns along them, along e_z for a vector 0."""
    sizes = np.linalg.norm(axes, axis=1)[:, None]
    third = np.where(sizes > 0, axes, (0.0, 0.0, 1.0)) / np.where(sizes > 0, sizes, 1.0)
    first = np.cross(np.eye(3)[(np.argmax(np.abs(third), axis=1) + 2) % 3], third)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(third, first), third], axis=2)


def flatten(value: Any, n: int) -> Iterator[Array]:
    """Yield the numbers (n, .) of arrays (n, ...) in a tuple of tuples."""
    if not isinstance(value, tuple):
        yield np.reshape(value, (n, -1))
        return
    for part in value:
        yield from flatten(part, n)


def zeros_like(value: Any) -> Any:
    """Return zeros in the arrangement of one body, for a tuple of tuples of arrays (n, ...)."""
    if isinstance(value, tuple):
        return type(value)(*map(zeros_like, value))
    return to_tuples(np.zeros(np.shape(value)[1:]))
