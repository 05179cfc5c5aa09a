"""Samples between steps: a state and a time after it, which short steps of order 8 bridge to round-off.

Each gap is crossed twice, the second time in twice as many steps, until both agree so far that the difference, which halving
the steps makes 256 times smaller, leaves nothing but round-off. Nothing is projected: such steps lose nothing.
"""

from __future__ import annotations

import math

import numpy as np

from . import entry, kernel
from .compiler.lanes import FOUR
from .compiler.signals import call_handlers
from .fields import no_supply
from .projected import near_unit, sum_supply, take_step
from .protocol import record_supply

AGREED = 2.0**-44
"""Largest difference of two crossings, relative: of the finer one a 256th is left."""
MOST = 2**20
"""Steps of a crossing at most."""
BLOCK = 2**8
"""Samples between two calls of handlers of signals."""


@kernel
def cross_gap(n, gap, t, J_inverse, rotor, field, table, q, L, room):
    """Return the state (q, L) that follows on one at t, s, after a gap, s, in n steps, and what the loads supplied in it."""
    (weights, columns, starts, nodes), (scaled, slopes) = table, room
    h, supplied = gap / n, no_supply(field)
    for i in range(len(weights)):
        # Those of the step itself are multiplied afterwards, as in `projected.take_step`.
        scaled[i] = h * weights[i] if i < starts[-2] else weights[i]
    for step in range(n):
        q, L = take_step(h, t + step * h, J_inverse, rotor, field, scaled, columns, starts, nodes, q, L, slopes)
        q, supplied = near_unit(q), sum_supply(h, weights, columns, starts, slopes, supplied)
    return q, L, supplied


@kernel
def difference(q0, L0, q1, L1, size):
    """Return the largest difference of two states, momenta relative to `size`; nan if a value is nan."""
    total = 0.0
    for i in range(4):
        total += abs(q1[i] - q0[i])
    for i in range(3):
        total += abs(L1[i] - L0[i]) / size
    return total


@entry
def move(J_inverse, rotor, field, weights, columns, starts, nodes, size, longest, t, gaps, q, L):
    """Move the states q (n, 4), of length one, and L (n, 3), kg m^2/s, principal axes, at t (n,), s, on by gaps (n,), s.

    With loads, L has four more columns, filled with the work, J, and the impulse, N m s, world axes, of the gap.

    First steps are at most `longest`, s; momenta are relative to `size`, kg m^2/s. Returns how many states were moved: all, or
    those before the first for which the crossings do not agree.
    """
    table, room = (weights, columns, starts, nodes), (np.empty(len(weights)), np.empty(3 * FOUR * (len(starts) - 2)))
    for i in range(len(t)):
        if i % BLOCK == BLOCK - 1:
            call_handlers()
        if gaps[i] == 0.0:
            continue
        # The smaller float first: an integer of a float beyond its range is undefined in machine code.
        n = max(1, int(min(math.ceil(gaps[i] / longest), 1.0 * MOST)))
        q0, L0 = (q[i, 0], q[i, 1], q[i, 2], q[i, 3]), (L[i, 0], L[i, 1], L[i, 2])
        coarse, off = cross_gap(n, gaps[i], t[i], J_inverse, rotor, field, table, q0, L0, room), math.inf
        # also if the difference is nan
        while not off <= AGREED:
            n *= 2
            if n > MOST:
                return i
            fine = cross_gap(n, gaps[i], t[i], J_inverse, rotor, field, table, q0, L0, room)
            off = difference(coarse[0], coarse[1], fine[0], fine[1], size)
            coarse = fine
        q[i, 0], q[i, 1], q[i, 2], q[i, 3] = coarse[0]
        L[i, 0], L[i, 1], L[i, 2] = coarse[1]
        record_supply(i, coarse[2], L)
    return len(t)
