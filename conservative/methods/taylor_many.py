"""Many bodies for `Taylor`: their starts as columns of numbers, in axes and units of their own, and the run of them.

What `Taylor` makes of one scene is made of many at once: a start in principal axes, or in the frame that does not spin, with
axes D whose third one is that of the field, in units in which the body is of order one. Source: our own layout.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..attitude import Array, axes_about, from_quaternion, to_quaternion
from ..batch import Batch
from ..deferred_imports import kernels
from ..grid import Grid
from .columns import fill_columns, take_pieces
from .fields_of_many import Fields, find_fields, into_axes
from .many import Block, RunMany
from .units import COARSE, SHORTEST

NEARLY_EQUAL = 4e-12
"""Relative difference of two moments below which a body may be symmetric: no less than `Scene.symmetry_axis_B` allows."""


@dataclass(frozen=True, eq=False)
class Frames:
    """Axes in which bodies are integrated.

    Attributes
    ----------
    moments, J
        Moments (n, 3), kg m^2, along these axes, and those that the motion has: of a body that is symmetric together with its
        field, J1 three times, as the frame does not spin.
    R_BP
        Rotations (n, 3, 3) from these axes to the body's.
    spinning
        Which bodies (n,) are symmetric.
    """

    moments: Array
    J: Array
    R_BP: Array
    spinning: Any


@dataclass(frozen=True, eq=False)
class Units:
    """Units of moments of inertia, kg m^2, and of time, s, of each body (n,): powers of two (`conservative.methods.units`)."""

    moment: Array
    time: Array

    @property
    def energy(self) -> Array:
        """Units of energy (n,), J."""
        return self.moment / self.time / self.time


@dataclass(frozen=True, eq=False)
class Start:
    """Bodies as the kernel `taylor_many` takes them.

    Attributes
    ----------
    like
        `Models` and `State` of floats, whatever they are.
    columns, states
        The numbers of these, (., m): a column for each body, and the last one again until whole registers are full.
    spin
        Rates (n,), rad/s, of spins that are left out; None where no body has one.
    """

    like: tuple[Any, Any]
    columns: Array
    states: Array
    spin: Array | None


def prepare_bodies(bodies: Batch, grid: Grid, order: int) -> RunMany | None:
    """Return the run of bodies by series of an order; None where they have to run alone."""
    start = start_bodies(bodies, grid)
    if start is None:
        return None
    n, s, m = len(bodies), grid.n_samples, start.states.shape[1]
    enter, turns = kernels("taylor_many").enter, find_turns(start.spin, grid.t, m)
    R_WB0, cost = from_quaternion(to_quaternion(bodies.R_WB0)), m * (20e-9 + 0.7e-9 * order**2)

    def run() -> Block:
        states, R_WB, w_WB_B = start.states.copy(), np.empty((m, s, 3, 3)), np.empty((m, s, 3))
        samples = R_WB.reshape(-1), w_WB_B.reshape(-1)
        given = order, start.like, start.columns, states, turns
        take_pieces(grid.n_steps, cost, lambda done, last: enter(*given, done, last, grid.n_steps, grid.every, *samples))
        R_WB[:n, 0], w_WB_B[:n, 0] = R_WB0, bodies.w_WB_B0
        return Block(R_WB[:n], w_WB_B[:n], states[-1, :n] == 0)

    return run


def start_bodies(bodies: Batch, grid: Grid) -> Start | None:
    """Return the start of bodies; None where they have to run alone."""
    frames = find_frames(bodies)
    w = into_axes(bodies.w_WB_B0, frames.R_BP)
    fields = find_fields(bodies.scene.potential, bodies, frames.R_BP)
    if fields is None:
        return None
    if not fields.axis_W.any():
        fields = find_momenta(bodies, frames, w, fields.scale)
    energy = np.sum(frames.moments * w * w, axis=1) / 2 + fields.scale
    units = find_units(frames.moments, energy, grid.dt)
    R_DP = directions(fields.axis_W).swapaxes(1, 2) @ bodies.R_WB0 @ frames.R_BP
    model = build_model(frames, fields, units, grid.dt, w, np.where(energy > 0, energy, 1.0), R_DP)
    state = (model.g, model.a, model.L / model.J, np.zeros((len(w), 1)))
    spin, width = find_spins(frames, w) if frames.spinning.any() else None, kernels("lanes").REGISTER
    columns, states = (fill_columns(np.column_stack(parts), width) for parts in (model, state))
    return Start(build_likes(fields.like), columns, states, spin)


def find_frames(bodies: Batch) -> Frames:
    """Return the axes of all bodies. Those that may be symmetric are looked at one by one, unless all are the same."""
    moments, R_BP = (np.array(each) for each in bodies.principal)
    J, spinning = moments.copy(), np.zeros(len(bodies), bool)
    gaps = np.abs(moments - np.roll(moments, 1, axis=1)).min(axis=1)
    near = np.flatnonzero(gaps <= NEARLY_EQUAL * moments.max(axis=1))
    alike = bodies.inertia is None and not bodies.parameters
    for part in [near] if alike and len(near) else near[:, None]:
        i = int(part[0])
        axis_B = bodies.take(i).symmetry_axis_B
        if axis_B is not None:
            x, y, J3 = np.roll(moments[i], 2 - int(np.argmax(np.abs(axis_B @ R_BP[i]))))
            J1 = (x + y) / 2
            spinning[part], J[part], moments[part], R_BP[part] = True, J1, (J1, J1, J3), axes_about(axis_B)
    return Frames(moments, J, R_BP, spinning)


def find_spins(frames: Frames, w: Array) -> Array:
    """Return the rates (n,), rad/s, at which bodies turn about the third axis of their frames; w (n, 3), rad/s, in these."""
    J1, J3 = frames.moments[:, 0], frames.moments[:, 2]
    return np.asarray(np.where(frames.spinning, (J1 - J3) / (J1 * J3) * (w[:, 2] * J3), 0.0))


def find_units(moments: Array, energy: Array, dt: float) -> Units:
    """Return the units of bodies of moments (n, 3), kg m^2, with energies (n,), J, for a step dt, s (`units.find_units`)."""
    moment, step = np.frexp(moments.max(axis=1))[1], int(np.frexp(dt)[1])
    rate = (np.frexp(energy)[1] - moment) // 2
    time = np.where(energy > 0, np.minimum(-rate, step - SHORTEST), step)
    return Units(*(np.ldexp(1.0, COARSE * np.trunc(each / COARSE).astype(int)) for each in (moment, time)))


def find_momenta(bodies: Batch, frames: Frames, w: Array, scale: Array) -> Fields:
    """Return what stands for the field of free bodies with rates w (n, 3), rad/s: the momentum, whose size is the number.

    `scale` (n,) is that of a potential that does nothing, J.
    """
    L = w * frames.moments
    axis_W = (bodies.R_WB0 @ (frames.R_BP @ L[..., None]))[..., 0]
    return Fields(kernels("taylor_many").Free(0.0), np.linalg.norm(L, axis=1)[:, None], slice(0), axis_W, scale)


def directions(axes: Array) -> Array:
    """Return rotations (n, 3, 3) whose third columns point along vectors (n, 3): those of `axes_about`; along e_z for none."""
    sizes = np.linalg.norm(axes, axis=1)[:, None]
    third = np.where(sizes > 0, axes, (0.0, 0.0, 1.0)) / np.where(sizes > 0, sizes, 1.0)
    first = np.cross(np.eye(3)[(np.argmax(np.abs(third), axis=1) + 2) % 3], third)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(third, first), third], axis=2)


def build_model(frames: Frames, fields: Fields, units: Units, dt: float, w: Array, energy: Array, R_DP: Array) -> Any:
    """Return `Models` of numbers (n, .), a row for each body, in its units, for steps dt, s.

    Rates w (n, 3), rad/s, energies (n,), J, and attitudes R_DP (n, 3, 3) against axes D are those of the start.
    """
    moments, J = (each / units.moment[:, None] for each in (frames.moments, frames.J))
    L, energy = w * units.time[:, None] * moments, energy / units.energy
    spin = np.where(frames.spinning, J[:, 2] / moments[:, 2], 1.0)
    one = np.ones(len(w))
    return kernels("taylor_many").Models(
        J=J,
        J_inverse=1 / J,
        field=find_numbers(fields, units, frames.spinning, L),
        loose=np.column_stack([one, one, ~frames.spinning]),
        scales=np.column_stack([energy, np.sqrt(2 * energy * moments.max(axis=1))]),
        g=R_DP[:, 2],
        a=R_DP[:, 0],
        L=L,
        h=(dt / units.time)[:, None],
        axes=directions(fields.axis_W).reshape(-1, 9),
        R_BP=frames.R_BP.reshape(-1, 9),
        units=np.column_stack([one, one, spin]) / units.time[:, None],
    )


def find_numbers(fields: Fields, units: Units, spinning: Any, L: Array) -> Array:
    """Return the numbers (n, k) of fields in units of the bodies, with momenta L (n, 3) in these units, kg m^2/s if they are 1.

    Of `spinning` bodies (n,) the moment of gravity is along the axis.
    """
    numbers = fields.numbers.copy()
    numbers[:, fields.energies] /= units.energy[:, None]
    if isinstance(fields.like, kernels("taylor_many").Free):
        return np.linalg.norm(L, axis=1)[:, None]
    if isinstance(fields.like, kernels("fields").Uniform):
        numbers[spinning, :2] = 0.0  # along the axis but for round-off
    return numbers


def build_likes(field: Any) -> tuple[Any, Any]:
    """Return `Models` and `State` of floats, with a field."""
    kernel, one, three = kernels("taylor_many"), 0.0, (0.0, 0.0, 0.0)
    nine = (three, three, three)
    sizes = {"J": three, "J_inverse": three, "field": field, "loose": three, "scales": (one, one), "g": three, "a": three}
    return kernel.Models(**sizes, L=three, h=one, axes=nine, R_BP=nine, units=three), kernel.State(three, three, three, one)


def find_turns(spin: Array | None, t: Array, m: int) -> Array:
    """Return cosines and sines (s, 2, m) of the angles of spins (n,), rad/s, at times t (s,), s; of no angles (1, 2, m)."""
    angles = np.zeros((1, m)) if spin is None else np.outer(t, np.pad(spin, (0, m - len(spin))))
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)
