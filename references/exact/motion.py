"""A motion prepared for evaluation, and the simplest one: a turn about a fixed axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from conservative.attitude import Array

from .clock import Clock, rotation_clock
from .digits import mp
from .start import Start, as_array, from_halves, norm


class ClosedForm(Protocol):
    """What evaluates: attitudes and rates at times."""

    def at(self, t: Array) -> tuple[Array, Array]:
        """Return `R_WB` (n, 3, 3) and `w_WB_B` (n, 3) at t (n,)."""


_BLOCK = 16384
"""Samples evaluated together: what fits into a cache."""


def in_blocks(motion: ClosedForm, t: Array) -> tuple[Array, Array]:
    """Return `R_WB` (n, 3, 3) and `w_WB_B` (n, 3) at any number of times."""
    R_WB, w_WB_B = np.empty((len(t), 3, 3)), np.empty((len(t), 3))
    for begin in range(0, len(t), _BLOCK):
        block = slice(begin, begin + _BLOCK)
        R_WB[block], w_WB_B[block] = motion.at(t[block])
    return R_WB, w_WB_B


@dataclass(frozen=True, eq=False)
class SteadyTurn:
    """A turn about an axis fixed in body and world, or rest."""

    axis_B: Array
    half_turn: Clock
    R_WB0: Array
    w_WB_B: Array

    def at(self, t: Array) -> tuple[Array, Array]:
        """Return `R_WB` (n, 3, 3) and `w_WB_B` (n, 3)."""
        half = self.half_turn.phasor(t)
        x, y, z = self.axis_B
        turn = from_halves(half.real + 1j * z * half.imag, (x + 1j * y) * half.imag)
        return self.R_WB0 @ turn, np.broadcast_to(self.w_WB_B, (*t.shape, 3)).copy()


def steady_turn(start: Start) -> SteadyTurn:
    """Return the motion of a start whose rates stay as they are."""
    w = start.rates(mp.eye(3))
    speed = norm(w)
    axis = np.array([float(x / speed) for x in w]) if speed > 0 else np.array([0.0, 0.0, 1.0])
    return SteadyTurn(axis, rotation_clock(mp.mpf(0), speed / 2), as_array(start.attitude), start.w_WB_B0)
