"""Attitudes and rates in body axes out of what lanes of free bodies store: (s, c, d, z) of `lanes_moser_veselov`."""

from __future__ import annotations

import numpy as np

from . import entry, small
from .lanes import load, save
from .lanes_moser_veselov import State
from .vector import dot, product

WIDTH = 8


@small
def rotation(q):
    """Rows of the matrix of a quaternion of any length."""
    w, x, y, z = q
    s = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        (1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)),
        (s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)),
        (s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)),
    )


@entry
def free_samples(out, amplitudes, rates, left, R_BS, R_WB, w_WB_B):
    """Fill R_WB (n, samples, 3, 3) and w_WB_B (n, samples, 3) from out (blocks, samples, 5, WIDTH).

    amplitudes (3, n) are of L/l, rates (3, n) of w, left (4, n) the turn in front; R_BS (9, n) are the axes of each polhode.
    """
    blocks, samples = out.shape[:2]
    n = left.shape[1]
    flat, R_flat, w_flat = out.reshape(-1), R_WB.reshape(-1), w_WB_B.reshape(-1)
    af, rf, lf, bf = amplitudes.reshape(-1), rates.reshape(-1), left.reshape(-1), R_BS.reshape(-1)
    room = np.empty(12 * WIDTH)
    for block in range(blocks):
        i = block * WIDTH
        a = (load(af, i, WIDTH), load(af, i + n, WIDTH), load(af, i + 2 * n, WIDTH))
        v = (load(rf, i, WIDTH), load(rf, i + n, WIDTH), load(rf, i + 2 * n, WIDTH))
        turn = (load(lf, i, WIDTH), load(lf, i + n, WIDTH), load(lf, i + 2 * n, WIDTH), load(lf, i + 3 * n, WIDTH))
        for sample in range(samples):
            x = (block * samples + sample) * 5 * WIDTH
            at = State(
                load(flat, x, WIDTH),
                load(flat, x + WIDTH, WIDTH),
                load(flat, x + 2 * WIDTH, WIDTH),
                load(flat, x + 3 * WIDTH, WIDTH),
                load(flat, x + 4 * WIDTH, WIDTH),
            )
            X, Y, up = a[0] * at.c, a[1] * at.s, 1.0 + a[2] * at.d
            own = (at.z_re * up, at.z_re * Y + at.z_im * X, at.z_im * Y - at.z_re * X, at.z_im * up)
            R = rotation(product(turn, own))
            w = (v[0] * at.c, v[1] * at.s, v[2] * at.d)
            for k in range(3):
                row = (
                    load(bf, i + 3 * k * n, WIDTH),
                    load(bf, i + (3 * k + 1) * n, WIDTH),
                    load(bf, i + (3 * k + 2) * n, WIDTH),
                )
                save(room, k * WIDTH, dot(R[0], row))
                save(room, (3 + k) * WIDTH, dot(R[1], row))
                save(room, (6 + k) * WIDTH, dot(R[2], row))
                save(room, (9 + k) * WIDTH, dot(w, row))
            for lane in range(WIDTH):
                to = (i + lane) * samples + sample
                for k in range(9):
                    R_flat[9 * to + k] = room[k * WIDTH + lane]
                for k in range(3):
                    w_flat[3 * to + k] = room[(9 + k) * WIDTH + lane]
