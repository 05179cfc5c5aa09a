"""Many bodies as kernels with lanes take them: in columns of whole registers, and in units in which all are of order one.

Moments of inertia are in units of the largest of each body, times in units of the step, both rounded to powers of two. So
thresholds mean the same for bodies of any size, and nothing is rounded: results are those in SI units, bit
for bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..attitude import Array
from ..batch import Batch
from ..deferred_imports import kernels
from ..grid import Grid
from ..potentials.uniform_gravity import UniformGravity
from .many import Block, pause

PIECE = 0.03
"""About how long a call of compiled code may take, s: between two of them, threads can be stopped."""
LINE = 8
"""Numbers in a line of the processor's first cache."""


def find_unit_of_time(grid: Grid) -> float:
    """Return a power of two, s, that the step is 0.5 to 1 times as long as."""
    return math.ldexp(1.0, math.frexp(grid.dt)[1])


def find_units_of_moments(moments: Array) -> Array:
    """Return powers of two (n,), kg m^2, that the largest of the moments (n, 3) of each body is 0.5 to 1 times as large as."""
    return np.ldexp(1.0, np.frexp(moments.max(axis=1))[1])


def fill_columns(rows: Array, width: int) -> Array:
    """Return the rows (n, 3) of n bodies, of any units and length, as columns (3, m), filled up with the last body.

    m is the next multiple of `width`.
    """
    missing = -len(rows) % width
    return np.ascontiguousarray(np.concatenate([rows, np.repeat(rows[-1:], missing, axis=0)]).T)


def make_room(n: int, m: int) -> Array:
    """Return room (n, m) for numbers, dimensionless, that begins where a line of the processor's cache does.

    Loading what lies across two lines costs as much as two loads.
    """
    room = np.empty(n * m + LINE)
    first = -(room.ctypes.data // room.itemsize) % LINE
    return room[first : first + n * m].reshape(n, m)


def moments_of_gravity(bodies: Batch, R_BP: Array) -> Array:
    """Return weight times centre of mass (n, 3), N m, in axes (n, 3, 3), of bodies in `UniformGravity`."""
    potential: Any = bodies.scene.potential
    weight, com_B = (np.asarray(bodies.parameters.get(name, getattr(potential, name))) for name in ("weight", "com_B"))
    moment_B = np.broadcast_to(weight[..., None] * com_B, (len(bodies), 3))
    return np.asarray((moment_B[:, None, :] @ R_BP)[:, 0, :])


def in_gravity_or_free(bodies: Batch) -> bool:
    """Whether the field of the bodies is one that lanes know."""
    return isinstance(bodies.scene.potential, UniformGravity | None)


def take_pieces(n_steps: int, cost: float, take: Callable[[int, int], object]) -> None:
    """Call `take(done, last)` until n_steps are done, in pieces that take about `PIECE` where a step costs so much, s.

    Between two of them `pause` can end it.
    """
    piece, done = max(1, int(PIECE / cost)), 0
    while done < n_steps:
        last = min(n_steps, done + piece)
        take(done, last)
        done = last
        pause()


def turn_samples(grid: Grid, q: Array, L: Array, turn: tuple[Array, Array | None, Array], places: Any, n: int) -> Block:
    """Return the samples of n bodies in body axes; those of k of them are known, which are at `places` (k,) among all.

    Attitudes q (m, s, 4) and momenta L (m, s, 3), m not below k, are in the kernel's axes. `turn` is what turns them, as
    `PrincipalStart` has it of one body: J_inverse (k, 3), with which L are rates, rad/s; spin (k, 2) or None; R_BP (k, 3, 3).
    """
    s, (J_inverse, spin, R_BP) = grid.n_samples, turn
    R_WB, w_WB_B = np.full((n, s, 3, 3), np.nan), np.full((n, s, 3), np.nan)
    kernels("samples").of_many(grid.t, q, L, J_inverse, spin, np.require(R_BP, float, ("C", "W")), places, R_WB, w_WB_B)
    return Block(R_WB, w_WB_B, np.isin(np.arange(n), places))
