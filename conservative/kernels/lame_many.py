"""The steps of `lame` for many tops at once, each a lane: same arithmetic, one loop.

Constants of the steps are found one body after the other, as they are a thing of twofold arithmetic and of decisions. Steps of
tops can have different numbers of parts: a lane with fewer waits for its neighbours, and nothing of it changes meanwhile.
"""

from __future__ import annotations

from . import entry, small
from .lame import Model, Part, advance, divide_step, unit_vertical
from .lanes import WIDTH, load, load_rows, save_columns, save_rows
from .vector import choose

PARTS, CONSTANTS, ROWS = 20, 22, 32
"""Numbers of a body: constants, of which those of `Part` are in front of the number of parts of a step and of the moment across
the axis, then attitude (4), vertical (3), rates across the axis (2), and momentum along it. The number of parts, all of the
constants, and all."""


@entry
def prepare(J, kappa, q, L, h, table):
    """Fill the table (ROWS, m) of n bodies, m not below n: moments J (n,), kappa (n,), q (n, 4) and L (n, 3) as in `Model`.

    The columns that are left repeat the last body.
    """
    n = len(J)
    for i in range(n):
        q0, L0 = (q[i, 0], q[i, 1], q[i, 2], q[i, 3]), (L[i, 0], L[i, 1], L[i, 2])
        parts, part = divide_step(Model(J[i], kappa[i], q0, L0), h)
        gamma = unit_vertical(q0)
        state = q0 + gamma + (L0[0] / J[i], L0[1] / J[i], L0[2])
        for row, x in enumerate((*part[:], float(parts), J[i], *state)):
            table[row, i] = x
    for i in range(n, table.shape[1]):
        for row in range(ROWS):
            table[row, i] = table[row, n - 1]


@small
def take_step(c, parts, least, most, q, gamma, w0, w1):
    """Take a step of so many parts, which differ from lane to lane: `least` of them at least, `most` at most."""
    for part in range(most):
        q1, gamma1, v0, v1 = advance(c, q, gamma, w0, w1)
        if part < least:
            q, gamma, w0, w1 = q1, gamma1, v0, v1
        else:
            left = parts > float(part)
            q, gamma, w0, w1 = choose(left, q1, q), choose(left, gamma1, gamma), choose(left, v0, w0), choose(left, v1, w1)
    return q, gamma, w0, w1


@entry
def march(table, done, last, n_steps, every, q_out, L_out):
    """Take the steps after `done` up to `last` of n_steps: of all bodies of the table of `prepare`, WIDTH at a time.

    Samples go to q_out (n, samples, 4) and L_out (n, samples, 3).
    """
    n, flat = table.shape[1], table.reshape(-1)
    q_flat, L_flat, samples = q_out.reshape(-1), L_out.reshape(-1), q_out.shape[1]
    for i in range(0, n, WIDTH):
        c = Part(*load_rows(flat, i, n, PARTS, WIDTH))
        parts, J = load(flat, i + PARTS * n, WIDTH), load(flat, i + (PARTS + 1) * n, WIDTH)
        least, most = table[PARTS, i], table[PARTS, i]
        for lane in range(1, WIDTH):
            least, most = min(least, table[PARTS, i + lane]), max(most, table[PARTS, i + lane])
        state = load_rows(flat, i + CONSTANTS * n, n, 10, WIDTH)
        q, gamma, w0, w1, L2 = state[:4], state[4:7], state[7], state[8], state[9]
        row, until_sample = done // every, every - done % every
        for step in range(done + 1, last + 1):
            q, gamma, w0, w1 = take_step(c, parts, int(least), int(most), q, gamma, w0, w1)
            until_sample -= 1
            if until_sample == 0 or step == n_steps:
                until_sample = every
                row += 1
                to = i * samples + row
                save_columns(q_flat, 4 * to, 4 * samples, q)
                save_columns(L_flat, 3 * to, 3 * samples, (J * w0, J * w1, L2))
        save_rows(flat, i + CONSTANTS * n, n, q + gamma + (w0, w1, L2))
