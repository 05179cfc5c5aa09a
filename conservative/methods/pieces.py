"""Steps that end where a load is not smooth: at its break points a step is divided, and each part sees one side of a jump.

A run consists of pieces between break points: whole steps, and parts of a step before and after a point. Each is a run of the
kernel with its own start, step and clock (`conservative.potentials.load.Loaded`). The samples stay those of the grid.

A part of a step is divided into more steps, the shorter the steps of the grid are. Otherwise runs with different steps would be
the same between two points that are close, and their difference would say nothing about their errors.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..attitude import Array
from ..grid import Grid

SAME = 1e-9
"""A break point that is closer to the end of a step, in steps, is at that end."""

MOST_PARTS = 64
"""Largest number of steps into which a part of a step is divided."""


class Piece(NamedTuple):
    """Steps of length h from a time t, both s, after `done` whole steps of the grid: `n` steps.

    They are whole steps of the grid, or parts of one; the piece ends when `after` whole steps are done. `window` has the break
    points before and after it, s.
    """

    t: float
    h: float
    done: int
    after: int
    n: int
    window: tuple[float, float]


def list_pieces(grid: Grid, breaks: Sequence[float]) -> list[Piece]:
    """Return the pieces of a run with break points, s, in order; each has its samples after its last step, or after all."""
    dt, n, pieces = grid.dt, grid.n_steps, list[Piece]()
    done, t, before = 0, 0.0, -math.inf
    inside = sum(0 < each < n * dt for each in breaks)
    parts = min(MOST_PARTS, max(1, math.ceil(n / (inside + 1) * (1 - SAME))))  # steps between points: thrice the work at most

    def divide(end: float, after: int) -> None:
        pieces.append(Piece(t, (end - t) / parts, done, after, parts, window))

    for point in (*breaks, math.inf):
        place = min(point / dt, n + 1.0)
        window, nearest = (before, point), round(place)
        last = nearest if abs(place - nearest) <= SAME else math.floor(place)
        if t > done * dt:  # within a step
            end, after = ((done + 1) * dt, done + 1) if last > done else (point, done)
            divide(end, after)
            done, t = after, end
        for steps in _split(done, min(last, n), grid):
            pieces.append(Piece(done * dt, dt, done, done + steps, steps, window))
            done += steps
            t = done * dt
        if done >= n:
            break
        if point > t and place - last > SAME:
            divide(point, done)
            t = point
        before = point
    return pieces


def _split(first: int, last: int, grid: Grid) -> list[int]:
    """Return numbers of steps from `first` to `last`: samples are at the end of each, or evenly spaced from its start."""
    every, parts = grid.every, []
    if first < last and first % every:
        parts.append(min(last, first + every - first % every) - first)
    whole = (last - first - sum(parts)) // every * every
    return [each for each in (*parts, whole, last - first - sum(parts) - whole) if each > 0]


def march_pieces(
    pieces: Sequence[Piece],
    kernel: Any,
    model: Any,
    find_coefficients: Callable[[float], Any],
    grid: Grid,
    pause: int,
    q: Array,
    L: Array,
) -> tuple[int, int, int, int | None, float, bool]:
    """Take the steps of all pieces as `enter` of a kernel takes those of a run, and fill the samples q and L."""
    state, supplied = (model.q, model.L), np.zeros(4)
    two_q, two_L, every = np.empty((2, 4)), np.empty((2, 7)), grid.every
    stages, corrections, evaluations, size = 0, 0, None, 0.0
    q[0], L[0, :3], L[0, 3:] = model.q, model.L, 0.0
    for t, h, done, after, n, window in pieces:
        start = model._replace(q=state[0], L=state[1], field=model.field._replace(clock=(t, *window)))
        many, row = after - done >= every and (after - done) % every == 0 and n == after - done, done // every
        to = (q[row : row + n // every + 1], L[row : row + n // every + 1]) if many else (two_q, two_L)
        found = kernel.enter(*start, *find_coefficients(h), n, every if many else n, pause, *to)
        stages, corrections, size = stages + found[1], corrections + found[2], found[4]
        evaluations = None if found[3] is None else (evaluations or 0) + found[3]
        if found[0] < n:
            return done + (found[0] if n == after - done else 0), stages, corrections, evaluations, size, found[5]
        to[1][:, 3:] += supplied
        supplied = to[1][-1, 3:].copy()
        state = tuple(to[0][-1].tolist()), tuple(to[1][-1, :3].tolist())
        if after > done and not many and (after % every == 0 or after == grid.n_steps):
            q[-(-after // every)], L[-(-after // every)] = two_q[1], two_L[1]
    return grid.n_steps, stages, corrections, evaluations, size, False
