"""The steps of `moser_veselov` for many bodies at once: every lane is a free body of its own.

`advance` is the loop body of `moser_veselov.march` as a function of numbers that may be floats or lanes (`lanes_llvm`).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from . import kernel, small
from .lanes import fuse, load, save
from .moser_veselov import RESCALE
from .vector import product


class Shift(NamedTuple):
    """What one step of one polhode is made of: of a whole shift C1, S1, C D, S D, m S^2; m, mc; y0 to y3; L/l's amplitudes."""

    C1: Any
    S1: Any
    CD1: Any
    SD1: Any
    mS1: Any
    m: Any
    mc: Any
    y0: Any
    y0s: Any
    y1: Any
    y2: Any
    y3: Any
    a1: Any
    a2: Any
    a3: Any


FIELDS = 15


class State(NamedTuple):
    """Phase on the polhode and the complex number z of the attitude."""

    s: Any
    c: Any
    d: Any
    z_re: Any
    z_im: Any


@small
def whole_shift(p, step, a):
    """The constants of a step, by the addition theorem from two halves; `a` are the amplitudes of L/l."""
    S, C, D, m, mc = step.S, step.C, step.D, p.m, p.mc
    below = 1.0 / (1.0 - m * S * S * S * S)
    S1, C1, D1 = 2.0 * S * C * D * below, (C * C - S * S * D * D) * below, (D * D - m * S * S * C * C) * below
    y0 = step.r0 * below
    y = (y0, y0 * m * S * S, step.r1 / (2.0 * C), step.r2 / (2.0 * C * D), step.r3 / (2.0 * D))
    return Shift(C1, S1, C1 * D1, S1 * D1, m * S1 * S1, m, mc, y[0], y[1], y[2], y[3], y[4], a[0], a[1], a[2])


@small
def advance(k, at):
    """One step; numbers are floats or lanes."""
    s, c, d, z_re, z_im = at
    r = 1.0 / (1.0 - k.mS1 * (s * s))
    s1, c1 = fuse(s, k.CD1, k.S1 * (c * d)) * r, fuse(c, k.C1, -(k.SD1 * (s * d))) * r
    f = 1.5 - 0.5 * fuse(s1, s1, c1 * c1)
    s1, c1 = s1 * f, c1 * f
    d1 = math.sqrt(k.mc + k.m * (c1 * c1))
    q0, q1, q2, q3 = k.y0 + k.y0s * (s * s1), k.y1 * (c + c1), k.y2 * (s + s1), k.y3 * (d + d1)
    x, y, up = k.a1 * c, k.a2 * s, 1.0 + k.a3 * d
    re, im = fuse(q0, up, fuse(x, q2, -(y * q1))), fuse(q3, up, fuse(y, q2, x * q1))
    return State(s1, c1, d1, fuse(z_re, re, -(z_im * im)), fuse(z_re, im, z_im * re))


@small
def rescale(at):
    """The same attitude with |z| = 1."""
    n = 1.0 / math.sqrt(fuse(at.z_re, at.z_re, at.z_im * at.z_im))
    return State(at.s, at.c, at.d, at.z_re * n, at.z_im * n)


@small
def own_quaternion(k, at):
    """The quaternion against axes along the momentum."""
    x, y, up = k.a1 * at.c, k.a2 * at.s, 1.0 + k.a3 * at.d
    return (at.z_re * up, at.z_re * y + at.z_im * x, at.z_im * y - at.z_re * x, at.z_im * up)


@small
def initial_left(k, p, q):
    """The constant turn in front of `own_quaternion`, for the attitude q at the start."""
    x, y, up = k.a1 * p.c, k.a2 * p.s, 1.0 + k.a3 * p.d
    n = 1.0 / (x * x + y * y + up * up)
    return product(q, (n * up, -n * y, n * x, n * 0.0))


@kernel
def march_single(constants, states, n_steps, every, out):
    """As `march_lanes`, one body after the other, by the same functions of floats: for comparison; out (n, samples, 5)."""
    for i in range(constants.shape[1]):
        c = constants[:, i]
        k = Shift(c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8], c[9], c[10], c[11], c[12], c[13], c[14])
        at = State(states[0, i], states[1, i], states[2, i], states[3, i], states[4, i])
        row = 0
        for j in range(5):
            out[i, 0, j] = at[j]
        until_rescale, until_sample = RESCALE, every
        for step in range(1, n_steps + 1):
            at = advance(k, at)
            until_rescale -= 1
            if until_rescale == 0:
                until_rescale = RESCALE
                at = rescale(at)
            until_sample -= 1
            if until_sample == 0 or step == n_steps:
                until_sample = every
                row += 1
                for j in range(5):
                    out[i, row, j] = at[j]


def _make_march(width):
    @kernel
    def march_lanes(constants, states, n_steps, every, out):
        """Take steps of all bodies, `width` at a time.

        constants (15, n) and states (5, n) are those of `Shift` and `State`, n a multiple of `width`; `out` (blocks, samples,
        5, width) gets the states of the start, every `every`-th step and the last.
        """
        n = constants.shape[1]
        flat, state_flat, out_flat = constants.reshape(-1), states.reshape(-1), out.reshape(-1)
        samples = out.shape[1]
        for block in range(n // width):
            i = block * width
            k = Shift(
                load(flat, i, width),
                load(flat, n + i, width),
                load(flat, 2 * n + i, width),
                load(flat, 3 * n + i, width),
                load(flat, 4 * n + i, width),
                load(flat, 5 * n + i, width),
                load(flat, 6 * n + i, width),
                load(flat, 7 * n + i, width),
                load(flat, 8 * n + i, width),
                load(flat, 9 * n + i, width),
                load(flat, 10 * n + i, width),
                load(flat, 11 * n + i, width),
                load(flat, 12 * n + i, width),
                load(flat, 13 * n + i, width),
                load(flat, 14 * n + i, width),
            )
            at = State(
                load(state_flat, i, width),
                load(state_flat, n + i, width),
                load(state_flat, 2 * n + i, width),
                load(state_flat, 3 * n + i, width),
                load(state_flat, 4 * n + i, width),
            )
            to = block * samples * 5 * width
            for j in range(5):
                save(out_flat, to + j * width, at[j])
            until_rescale, until_sample = RESCALE, every
            for step in range(1, n_steps + 1):
                at = advance(k, at)
                until_rescale -= 1
                if until_rescale == 0:
                    until_rescale = RESCALE
                    at = rescale(at)
                until_sample -= 1
                if until_sample == 0 or step == n_steps:
                    until_sample = every
                    to += 5 * width
                    for j in range(5):
                        save(out_flat, to + j * width, at[j])

    return march_lanes


march_four, march_eight = _make_march(4), _make_march(8)
