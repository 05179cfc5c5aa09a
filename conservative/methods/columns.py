"""Arrays and units of kernels with lanes: columns that fill whole registers, numbers of order one.

Moments of inertia are in units of the largest of each body, and times in units of the step, both rounded to powers of two.
Thresholds therefore have the same meaning for bodies of any size. The conversion does not round, so results are identical to
results in SI units, bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..attitude import Array
from ..batch import Batch
from ..deferred_imports import kernels
from ..grid import Grid
from ..potentials.uniform_gravity import UniformGravity
from .many import Block, pause

PIECE = 0.03
"""Approximate duration of a call of compiled code, s. Threads can be stopped between two calls."""
LINE = 8
"""Doubles in a cache line."""


def find_unit_of_time(grid: Grid) -> float:
    """Return the unit of time, s: the power of two in which the step is 0.5 to 1."""
    return math.ldexp(1.0, math.frexp(grid.dt)[1])


def find_units_of_moments(moments: Array) -> Array:
    """Return units (n,), kg m^2: the powers of two in which the largest of the moments (n, 3) of each body is 0.5 to 1."""
    return np.ldexp(1.0, np.frexp(moments.max(axis=1))[1])


def stack_columns(parts: Sequence[Array], width: int) -> Array:
    """Return the rows of the parts (n, .) of n bodies as columns (., m), one part under the other.

    m is the next multiple of `width`; the last body is repeated.
    """
    n = len(parts[0])
    columns, row = np.empty((sum(part.shape[1] for part in parts), -(-n // width) * width)), 0
    for part in parts:
        columns[row : row + part.shape[1], :n] = part.T
        row += part.shape[1]
    columns[:, n:] = columns[:, n - 1 : n]
    return columns


def make_room(n: int, m: int) -> Array:
    """Return an empty array (n, m) that is aligned to cache lines, because a load across two lines takes twice as long."""
    room = np.empty(n * m + LINE)
    first = -(room.ctypes.data // room.itemsize) % LINE
    return room[first : first + n * m].reshape(n, m)


def moments_of_gravity(bodies: Batch, R_BP: Array) -> Array:
    """Return weight times centre of mass (n, 3), N m, of bodies in `UniformGravity`, in the axes `R_BP` (n, 3, 3)."""
    potential: Any = bodies.scene.potential
    return np.stack(potential.fields(bodies.parameters, R_BP), axis=1)


def in_gravity_or_free(bodies: Batch) -> bool:
    """Return whether kernels with lanes support the field of the bodies, which have no rotor."""
    return bodies.scene.body.rotor_momentum is None and isinstance(bodies.scene.potential, UniformGravity | None)


def take_pieces(n_steps: int, cost: float, take: Callable[[int, int], object]) -> None:
    """Call `take(done, last)` until n_steps are done, in pieces of about `PIECE`; `cost` is the time of a step, s.

    `pause` can end the run between two pieces.
    """
    piece, done = max(1, int(PIECE / cost)), 0
    while done < n_steps:
        last = min(n_steps, done + piece)
        take(done, last)
        done = last
        pause()


def turn_samples(grid: Grid, q: Array, L: Array, turn: tuple[Array, Array | None, Array], places: Any, n: int) -> Block:
    """Return the samples of n bodies in body axes. Only the k bodies with the indices `places` (k,) have samples.

    Attitudes q (m, s, 4) and momenta L (m, s, 3), m >= k, are in the kernel's axes. `turn` converts them, as in
    `PrincipalStart`: J_inverse (k, 3), which turns L into rates, rad/s; spin (k, 2) or None; R_BP (k, 3, 3).
    """
    s, (J_inverse, spin, R_BP) = grid.n_samples, turn
    R_WB, w_WB_B = np.full((n, s, 3, 3), np.nan), np.full((n, s, 3), np.nan)
    kernels("samples").of_many(grid.t, q, L, J_inverse, spin, np.require(R_BP, float, ("C", "W")), places, R_WB, w_WB_B)
    return Block(R_WB, w_WB_B, np.isin(np.arange(n), places))
