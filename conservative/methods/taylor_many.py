"""Many bodies for `Taylor`: their starts as columns of numbers, in units and axes of their own, and the run of them.

What a scene is converted to for the kernel of one body, many bodies are converted to at once: in principal axes, or in the frame
that does not spin, in units in which each body is of order one, and with axes D whose third one is that of the field. Where
fields turn, or steps are divided by a tolerance, bodies run alone. Source: our own layout.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import singledispatch
from typing import Any

import numpy as np

from ..attitude import Array, axes_about, from_quaternion, to_quaternion
from ..deferred_imports import kernels
from ..method import Grid
from ..potentials.gravity_gradient import GravityGradient
from ..potentials.point_to_point import LinearSpring, PointAttraction
from ..potentials.uniform_gravity import UniformGravity
from .many import Block, Bodies, RunMany
from .units import COARSE, SHORTEST

PIECE = 0.03
"""About how long a call of compiled code takes, s."""
NEARLY_EQUAL = 4e-12
"""Relative difference of two moments below which a body may be symmetric: no smaller than what `Scene.symmetry_axis_B` allows."""


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
    spinning: Array


@dataclass(frozen=True, eq=False)
class Units:
    """Units of moments of inertia, kg m^2, and of time, s, of each body (n,): powers of two (`conservative.methods.units`)."""

    moment: Array
    time: Array

    @property
    def energy(self) -> Array:
        """Units of energy (n,), J."""
        return self.moment / self.time / self.time


def find_frames(bodies: Bodies) -> Frames:
    """Return the axes of all bodies."""
    moments, R_BP = (np.array(each) for each in bodies.principal)
    gaps = np.abs(moments - np.roll(moments, 1, axis=1)).min(axis=1)
    near = np.flatnonzero(gaps <= NEARLY_EQUAL * moments.max(axis=1))
    spinning, J = np.zeros(len(bodies), bool), moments.copy()
    shared = bodies.inertia is None and not bodies.parameters
    for part in [near] if shared and len(near) else near[:, None]:
        axis_B = bodies.take(part[0]).symmetry_axis_B
        if axis_B is None:
            continue
        own = np.roll(moments[part[0]], 2 - int(np.argmax(np.abs(axis_B @ R_BP[part[0]]))))
        J1 = (own[0] + own[1]) / 2
        spinning[part], J[part], moments[part], R_BP[part] = True, J1, (J1, J1, own[2]), axes_about(axis_B)
    return Frames(moments, J, R_BP, spinning)


def find_units(moments: Array, energy: Array, dt: float) -> Units:
    """Return the units of bodies of moments (n, 3), kg m^2, with energies (n,), J, for a step dt, s (`units.find_units`)."""
    moment, step = np.frexp(moments.max(axis=1))[1], np.frexp(dt)[1]
    rate = (np.frexp(energy)[1] - moment) // 2
    time = np.where(energy > 0, np.minimum(-rate, step - SHORTEST), step)
    return Units(*(np.ldexp(1.0, COARSE * np.trunc(each / COARSE).astype(int)) for each in (moment, time)))


def read_parameter(bodies: Bodies, name: str) -> Array:
    """Return a number, or numbers, of the potential of each body, (n, ...), of its own unit."""
    value = np.asarray(bodies.parameters.get(name, getattr(bodies.scene.potential, name)), dtype=float)
    return value if name in bodies.parameters else np.broadcast_to(value, (len(bodies), *value.shape))


@dataclass(frozen=True, eq=False)
class Fields:
    """The field of each body.

    Attributes
    ----------
    like
        The kernel's field, whatever its numbers.
    numbers
        These numbers (n, k), one row for each body; lengths in units of the longest.
    energies
        Those of them that are proportional to energy; J.
    axis_W
        Axes (n, 3), vectors of any length, world axes.
    scale
        Sizes (n,) of the potential, J.
    """

    like: Any
    numbers: Array
    energies: slice
    axis_W: Array
    scale: Array


@singledispatch
def find_fields(potential: Any, bodies: Bodies, R_BP: Array) -> Fields | None:
    """Return the fields of bodies in axes R_BP (n, 3, 3); None where they have to run alone."""
    return None


@find_fields.register
def _of_gravity(potential: UniformGravity, bodies: Bodies, R_BP: Array) -> Fields:
    moments = into_axes(read_parameter(bodies, "weight")[:, None] * read_parameter(bodies, "com_B"), R_BP)
    up = np.broadcast_to(potential.axis_W, moments.shape)
    return Fields(kernels("fields").Uniform(0.0, 0.0, 0.0), moments, slice(3), up, np.linalg.norm(moments, axis=1))


def _points(bodies: Bodies, R_BP: Array, *lengths: Array) -> tuple[Array, Array, Array]:
    """Return the points of body and world (n, 3) in units, m, and these units (n,), powers of two."""
    b, A = into_axes(read_parameter(bodies, "point_B"), R_BP), read_parameter(bodies, "anchor_W")
    longest = np.max(np.column_stack([np.abs(b), np.abs(A), *lengths]), axis=1)
    unit = np.ldexp(1.0, np.frexp(longest)[1])
    return b / unit[:, None], A / unit[:, None], unit


@find_fields.register
def _of_springs(potential: LinearSpring, bodies: Bodies, R_BP: Array) -> Fields:
    rest, stiffness = read_parameter(bodies, "rest_length"), read_parameter(bodies, "stiffness")
    b, A, unit = _points(bodies, R_BP, rest)
    stiffness, rest = stiffness * unit * unit, rest / unit
    farthest = np.linalg.norm(b, axis=1) + np.linalg.norm(A, axis=1)
    like = kernels("point_fields").Spring((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, 0.0)
    return Fields(like, np.column_stack([b, A, stiffness, rest]), slice(6, 7), A, stiffness / 2 * np.maximum(farthest, rest) ** 2)


@find_fields.register
def _of_attractions(potential: PointAttraction, bodies: Bodies, R_BP: Array) -> Fields:
    b, A, unit = _points(bodies, R_BP)
    strength = read_parameter(bodies, "strength") / unit
    like = kernels("point_fields").Attraction((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)
    scale = np.abs(strength) / np.hypot(np.linalg.norm(b, axis=1), np.linalg.norm(A, axis=1))
    return Fields(like, np.column_stack([b, A, strength]), slice(6, 7), A, scale)


@find_fields.register
def _of_gradients(potential: GravityGradient, bodies: Bodies, R_BP: Array) -> Fields:
    factor = 3 * read_parameter(bodies, "rate")[:, None, None] ** 2
    rows = factor * (np.swapaxes(R_BP, 1, 2) @ read_parameter(bodies, "inertia") @ R_BP)
    e, none = read_parameter(bodies, "direction_W"), (0.0, 0.0, 0.0)
    scale = np.linalg.eigvalsh(rows)[:, -1] / 2
    numbers = np.column_stack([rows.reshape(-1, 9), e])
    return Fields(kernels("gradient_field").Gradient(none, none, none, none), numbers, slice(9), e, scale)


def into_axes(v: Array, R_BP: Array) -> Array:
    """Return vectors (n, 3) of any unit, body axes, in axes R_BP (n, 3, 3)."""
    return np.asarray((v[:, None, :] @ R_BP)[:, 0, :])


def axes_about_many(axes: Array) -> Array:
    """Return rotations (n, 3, 3) whose third columns have the directions (n, 3): those of `axes_about`."""
    third = axes / np.linalg.norm(axes, axis=1)[:, None]
    first = np.cross(np.eye(3)[(np.argmax(np.abs(third), axis=1) + 2) % 3], third)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(third, first), third], axis=2)


@dataclass(frozen=True, eq=False)
class Start:
    """Bodies as the kernel `taylor_many` takes them.

    Attributes
    ----------
    like, columns, states
        `Models` and `State` of floats, and the numbers of them in columns (., m), one for each body and the last one again until
        whole registers are full.
    spin
        Rates (n,), rad/s, of spins that are left out; None where all are 0.
    """

    like: Any
    columns: Array
    states: Array
    spin: Array | None


def start_many(bodies: Bodies, grid: Grid) -> Start | None:
    """Return the start of bodies; None where they have to run alone."""
    frames = find_frames(bodies)
    fields = free_fields(bodies, frames) if is_free(bodies) else find_fields(bodies.scene.potential, bodies, frames.R_BP)
    if fields is None:
        return None
    w = into_axes(bodies.w_WB_B0, frames.R_BP)
    energy = np.sum(frames.moments * w * w, axis=1) / 2 + fields.scale
    units = find_units(frames.moments, energy, grid.dt)
    return pack(bodies, grid, frames, fields, units, w, np.where(energy > 0, energy, 1.0))


def is_free(bodies: Bodies) -> bool:
    """Whether nothing acts on the bodies, or what has no axis."""
    return bodies.scene.potential is None or bodies.scene.potential.axis_W is None


def free_fields(bodies: Bodies, frames: Frames) -> Fields:
    """Return what stands for the field of free bodies: the momentum, of which the size is the only number."""
    L = into_axes(bodies.w_WB_B0, frames.R_BP) * frames.moments
    l_W = (bodies.R_WB0 @ (frames.R_BP @ L[..., None]))[..., 0]
    size = np.linalg.norm(L, axis=1)
    scale = potential.scale() if (potential := bodies.scene.potential) else 0.0
    axis = np.where(size[:, None] > 0, l_W, (0.0, 0.0, 1.0))
    return Fields(kernels("taylor").Free(0.0), size[:, None], slice(0), axis, np.full(len(L), scale))


def pack(bodies: Bodies, grid: Grid, frames: Frames, fields: Fields, units: Units, w: Array, energy: Array) -> Start:
    """Return the start of bodies in these units: rates w (n, 3), rad/s, in their own axes, and energies (n,), J."""
    one = np.ones(len(bodies))
    moments, J = (each / units.moment[:, None] for each in (frames.moments, frames.J))
    L, energy = w * units.time[:, None] * moments, energy / units.energy
    numbers = fields.numbers.copy()
    numbers[:, fields.energies] /= units.energy[:, None]
    if is_free(bodies):
        numbers = np.linalg.norm(L, axis=1)[:, None]
    elif isinstance(fields.like, kernels("fields").Uniform):
        numbers[frames.spinning, :2] = 0.0
    R_WD = axes_about_many(fields.axis_W)
    R_DP = np.swapaxes(R_WD, 1, 2) @ bodies.R_WB0 @ frames.R_BP
    loose = np.column_stack([one, one, ~frames.spinning])
    scales = np.column_stack([energy, np.sqrt(2 * energy * moments.max(axis=1))])
    rates = np.column_stack([1 / units.time, 1 / units.time, J[:, 2] / moments[:, 2] / units.time])
    h = grid.dt / units.time
    rows = [J, 1 / J, numbers, loose, scales, R_DP[:, 2], R_DP[:, 0], L, h, R_WD.reshape(-1, 9), frames.R_BP.reshape(-1, 9), rates]
    states = [R_DP[:, 2], R_DP[:, 0], L / J, 0 * one]
    spin = (moments[:, 0] - moments[:, 2]) / (moments[:, 0] * moments[:, 2]) * L[:, 2] / units.time
    found = np.where(frames.spinning, spin, 0.0) if frames.spinning.any() else None
    return Start(likes(fields.like), fill(np.column_stack(rows)), fill(np.column_stack(states)), found)


def likes(field: Any) -> tuple[Any, Any]:
    """Return a `Models` and a `State` of floats in that field."""
    kernel, three = kernels("taylor_many"), (0.0, 0.0, 0.0)
    nine = (three, three, three)
    model = kernel.Models(three, three, field, three, (0.0, 0.0), three, three, three, 0.0, nine, nine, three)
    return model, kernel.State(three, three, three, 0.0)


def fill(rows: Array) -> Array:
    """Return the numbers (n, k) of n bodies as columns (k, m), m the next multiple of the bodies in a register."""
    missing = -len(rows) % kernels("lanes").REGISTER
    return np.ascontiguousarray(np.concatenate([rows, np.repeat(rows[-1:], missing, axis=0)]).T)


def turns_of(spin: Array | None, t: Array, m: int) -> Array:
    """Return cosines and sines (s, 2, m) of the angles by which spins (n,), rad/s, turn in times t (s,), s; (1, 2, m) for none."""
    if spin is None:
        return np.stack([np.ones((1, m)), np.zeros((1, m))], axis=1)
    angles = np.outer(t, np.concatenate([spin, np.zeros(m - len(spin))]))
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


def prepare_run_many(bodies: Bodies, grid: Grid, order: int) -> RunMany | None:
    """Return the run of bodies by series of an order; None where they have to run alone."""
    start = start_many(bodies, grid)
    if start is None:
        return None
    n, s, (_, m) = len(bodies), grid.n_samples, start.states.shape
    enter, turns = kernels("taylor_many").enter, turns_of(start.spin, grid.t, m)
    R_WB0, w_WB_B0 = from_quaternion(to_quaternion(bodies.R_WB0)), bodies.w_WB_B0

    def run() -> Block:
        states, R_WB, w_WB_B = start.states.copy(), np.empty((m, s, 3, 3)), np.empty((m, s, 3))
        samples = R_WB.reshape(-1), w_WB_B.reshape(-1)
        for bodies_now, steps_now in divide(m, grid.n_steps, order):
            enter(order, start.like, start.columns, states, turns, *bodies_now, *steps_now, grid.n_steps, grid.every, *samples)
        R_WB[:n, 0], w_WB_B[:n, 0] = R_WB0, w_WB_B0
        return Block(R_WB[:n], w_WB_B[:n], states[-1, :n] == 0)

    return run


def divide(m: int, n_steps: int, order: int) -> Any:
    """Yield bodies and steps, first and last, that take about `PIECE` together."""
    width = kernels("lanes").REGISTER
    piece = int(PIECE / (15e-9 + 0.6e-9 * order**2))
    steps = min(n_steps, max(1, piece // width))
    count = max(1, piece // (steps * width)) * width
    for first in range(0, m, count):
        for done in range(0, n_steps, steps):
            yield (first, min(m, first + count)), (done, min(n_steps, done + steps))
