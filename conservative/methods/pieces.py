"""Steps that end where a load is not smooth: at its break points a step is divided, and each part sees one side of a jump.

A run consists of pieces between break points: whole steps, and parts of a step before, between and after points. Each is a run
of the kernel with its own start, step and clock (`conservative.potentials.load.Loaded`). The samples stay on the grid: a
piece says whether its steps are whole, and which samples it fills, because its length does not show this: a part of a step can
be as long as a step.

A part of a step is divided into more steps, the shorter the steps of the grid are. Otherwise runs with different steps would be
the same between two points that are close, and their difference would say nothing about their errors.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..attitude import Array
from ..deferred_imports import kernels
from ..grid import ROUNDING, Grid

MOST_PARTS = 64
"""Largest number of steps into which a part of a step is divided."""


class Piece(NamedTuple):
    """A run of n steps of length h from a time t, both s, after `done` whole steps of the grid.

    `whole` is True for steps of the grid, and False for parts of one. `window` has the break points before and after it, s.
    `rows` are the samples that it fills, at equal distances up to its end. If they are several, it starts at the sample before.
    """

    t: float
    h: float
    n: int
    window: tuple[float, float]
    done: int
    whole: bool
    rows: range


def list_pieces(grid: Grid, breaks: Array) -> list[Piece]:
    """Return the pieces of a run with increasing break points above 0, s, in order."""
    dt, n, every, pieces = grid.dt, grid.n_steps, grid.every, list[Piece]()
    parts, done, t, before = count_parts(grid, count_inside(grid, breaks)), 0, 0.0, -math.inf

    def rows_at(step: int) -> range:
        row = -(-step // every)
        return range(row, row + (step % every == 0 or step == n))

    for point in (*breaks.tolist(), math.inf):
        place, window = min(point / dt, n + 1.0), (before, point)
        nearest = round(place)
        at_end = abs(place - nearest) <= ROUNDING * place
        last = nearest if at_end else math.floor(place)
        if t > done * dt and last > done:  # the rest of a step
            end = (done + 1) * dt
            pieces.append(Piece(t, (end - t) / parts, parts, window, done, False, rows_at(done + 1)))
            done, t = done + 1, end
        for steps in _split(done, min(last, n), every):
            even = done % every == steps % every == 0
            rows = range(done // every + 1, (done + steps) // every + 1) if even else rows_at(done + steps)
            pieces.append(Piece(done * dt, dt, steps, window, done, True, rows))
            done += steps
            t = done * dt
        if done >= n:
            break
        if not at_end:
            pieces.append(Piece(t, (point - t) / parts, parts, window, done, False, range(0)))
            t = point
        before = point
    return pieces


def count_parts(grid: Grid, inside: int) -> int:
    """Return the number of steps into which each part of a step is divided, with `inside` break points in the run."""
    return min(MOST_PARTS, math.ceil(grid.n_steps / (inside + 1)))  # a run has fewer than four times the steps of the grid


def count_most_steps(grid: Grid, breaks: Array) -> int:
    """Return the largest number of steps that a run can take: the steps of the grid, and two parts for each break point, s."""
    inside = count_inside(grid, breaks)
    return grid.n_steps + 2 * inside * count_parts(grid, inside)


def count_inside(grid: Grid, breaks: Array) -> int:
    """Return the number of increasing break points, s, before the end of a run."""
    return int(np.searchsorted(breaks, grid.n_steps * grid.dt))


def _split(first: int, last: int, every: int) -> list[int]:
    """Return numbers of steps from `first` to `last`: up to the first sample, from there to the last one, and the rest."""
    if first >= last:
        return []
    begin = min(last, -(-first // every) * every) - first
    whole = (last - first - begin) // every * every
    return [count for count in (begin, whole, last - first - begin - whole) if count > 0]


def march_pieces(
    pieces: Sequence[Piece],
    kernel: Any,
    model: Any,
    find_coefficients: Callable[[float], Any],
    grid: Grid,
    pause: int,
    q: Array,
    L: Array,
    axes: Array,
    R_WB: Array,
    w_WB_B: Array,
) -> tuple[int, int, int, int | None, float, bool, int]:
    """Take the steps of all pieces as `enter` of a kernel takes the steps of a run, and fill the samples."""
    result = _march(pieces, kernel, model, find_coefficients, grid, pause, q, L)
    n = grid.count_samples(result[0])
    return (*result, kernels("samples").fill(grid.t[:n], 1, n, q, L, axes, R_WB[:n], w_WB_B[:n]))


def no_output() -> tuple[Array, Array, Array]:
    """Return the `Output` of a kernel whose samples are not converted."""
    return np.zeros(kernels("samples").END), np.empty((0, 3, 3)), np.empty((0, 3))


def _march(
    pieces: Sequence[Piece],
    kernel: Any,
    model: Any,
    find_coefficients: Callable[[float], Any],
    grid: Grid,
    pause: int,
    q: Array,
    L: Array,
) -> tuple[int, int, int, int | None, float, bool]:
    """Take the steps of all pieces, and fill the samples q and L."""
    nothing = no_output()
    state, supplied, ends = (model.q, model.L), np.zeros(4), (np.empty((2, 4)), np.empty((2, 7)))
    stages, corrections, evaluations, size = 0, 0, None, 0.0
    q[0], L[0, :3], L[0, 3:] = model.q, model.L, 0.0
    for t, h, n, window, done, whole, rows in pieces:
        start = model._replace(q=state[0], L=state[1], field=model.field._replace(clock=(t, *window)))
        # A kernel also writes its start, which is a sample only if several follow at equal distances.
        several = len(rows) > 1
        to_q, to_L = (samples[rows.start - 1 : rows.stop] for samples in (q, L)) if several else ends
        every = n // len(rows) if several else n
        # The fields of `Result`: steps done, stages, corrections, evaluations, size, elsewhere.
        result = kernel.enter(*start, *find_coefficients(h), n, every, pause, to_q, to_L, *nothing)
        stages, corrections, size = stages + result[1], corrections + result[2], result[4]
        evaluations = None if result[3] is None else (evaluations or 0) + result[3]
        to_L[: 1 + result[0] // every, 3:] += supplied
        if result[0] < n:
            return done + result[0] * whole, stages, corrections, evaluations, size, result[5]
        supplied = to_L[-1, 3:].copy()
        state = tuple(to_q[-1].tolist()), tuple(to_L[-1, :3].tolist())
        if len(rows) == 1:
            q[rows.start], L[rows.start] = to_q[1], to_L[1]
    return grid.n_steps, stages, corrections, evaluations, size, False
