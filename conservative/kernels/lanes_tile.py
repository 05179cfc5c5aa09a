"""As `lanes_taylor`, several registers of bodies in turn, order by order: while one waits for its newest coefficients, a
processor works on the next. All numbers are in memory, which the processor's first cache holds.
"""

from __future__ import annotations

import numpy as np

from . import kernel, small
from .lanes import fill_like, load, save, some
from .lanes_taylor import ENOUGH, FAR, add_cross, add_mixed, choose_vector, correct, load3, save3, values
from .vector import add, cross, scale, times

W = 4
N = 9 * W
"""Numbers of one order."""
CONSTANTS = 18 * W
"""Room for the constants of a register of bodies: K, 1/J, moment, J, kept (2), scales (4)."""


@small
def order(c, k, n, h):
    """Form the coefficients of order n + 1 of the bodies whose coefficients are in c and whose constants in k."""
    zero = fill_like(0.0, load(c, 0, W))
    zeros = (zero, zero, zero)
    sg, sa, sw = zeros, zeros, zeros
    for i in range(1, n):
        x, y = i * N, (n - i) * N
        wi = load3(c, y + 6 * W, W, W)
        sg = add_cross(sg, load3(c, x, W, W), wi)
        sa = add_cross(sa, load3(c, x + 3 * W, W, W), wi)
        sw = add_mixed(sw, load3(c, x + 6 * W, W, W), wi)
    x = n * N
    gn, an, wn = load3(c, x, W, W), load3(c, x + 3 * W, W, W), load3(c, x + 6 * W, W, W)
    g, a, w = load3(c, 0, W, W), load3(c, 3 * W, W, W), load3(c, 6 * W, W, W)
    if n:
        sg, sa, sw = add_cross(sg, gn, w), add_cross(sa, an, w), add_mixed(sw, wn, w)
    sg, sa, sw = add_cross(sg, g, wn), add_cross(sa, a, wn), add_mixed(sw, w, wn)
    f = h * (1.0 / (n + 1))
    K, J_inverse, moment = load3(k, 0, W, W), load3(k, 3 * W, W, W), load3(k, 6 * W, W, W)
    sw = add(times(K, sw), times(J_inverse, cross(gn, moment)))
    x += N
    save3(c, x, W, scale(f, sg))
    save3(c, x + 3 * W, W, scale(f, sa))
    save3(c, x + 6 * W, W, scale(f, sw))


@small
def finish(c, k, p):
    """Add all orders to the state, project it, and store it as the start of the next step."""
    x = p * N
    g, a, w = load3(c, x, W, W), load3(c, x + 3 * W, W, W), load3(c, x + 6 * W, W, W)
    for n in range(p - 1, -1, -1):
        x = n * N
        g, a, w = add(g, load3(c, x, W, W)), add(a, load3(c, x + 3 * W, W, W)), add(w, load3(c, x + 6 * W, W, W))
    J_inverse, moment, J = load3(k, 3 * W, W, W), load3(k, 6 * W, W, W), load3(k, 9 * W, W, W)
    kept = (load(k, 12 * W, W), load(k, 13 * W, W))
    scales = (load(k, 14 * W, W), load(k, 15 * W, W), load(k, 16 * W, W), load(k, 17 * W, W))
    g, a, w, defect = correct(J, J_inverse, moment, kept, scales, g, a, w)
    left = (defect > ENOUGH) & (defect < FAR)
    if some(left):
        for _ in range(7):
            g1, a1, w1, defect = correct(J, J_inverse, moment, kept, scales, g, a, w)
            g, a, w = choose_vector(left, g1, g), choose_vector(left, a1, a), choose_vector(left, w1, w)
            left = left & (defect > ENOUGH) & (defect < FAR)
            if not some(left):
                break
    save3(c, 0, W, g)
    save3(c, 3 * W, W, a)
    save3(c, 6 * W, W, w)


@kernel
def aligned(size):
    """Room for numbers that begins where a line of the cache does: a load across two lines costs two."""
    room = np.empty(size + 8)
    first = (-room.ctypes.data // 8) % 8
    return room[first : first + size]


def make_march(tile):
    """Return the kernel for so many registers of bodies at a time."""

    @kernel
    def march_tiles(p, h, n_steps, constants, states, out):
        """As `lanes_taylor.make_march`; the number of bodies is a multiple of 4 times the tile."""
        n = constants.shape[1]
        flat, state_flat, out_flat = constants.reshape(-1), states.reshape(-1), out.reshape(-1)
        c, k = aligned(tile * N * (p + 1)).reshape(tile, N * (p + 1)), aligned(tile * CONSTANTS).reshape(tile, CONSTANTS)
        for block in range(n // (W * tile)):
            for r in range(tile):
                b = (block * tile + r) * W
                J, J_inverse = load3(flat, b, n, W), load3(flat, b + 3 * n, n, W)
                moment = load3(flat, b + 6 * n, n, W)
                s0, s1 = load(flat, b + 9 * n, W), load(flat, b + 10 * n, W)
                K = ((J[1] - J[2]) * J_inverse[0], (J[2] - J[0]) * J_inverse[1], (J[0] - J[1]) * J_inverse[2])
                g, a = load3(state_flat, b, n, W), load3(state_flat, b + 3 * n, n, W)
                w = load3(state_flat, b + 6 * n, n, W)
                kept = values(J, moment, g, w)
                kr, cr = k[r], c[r]
                save3(kr, 0, W, K)
                save3(kr, 3 * W, W, J_inverse)
                save3(kr, 6 * W, W, moment)
                save3(kr, 9 * W, W, J)
                save(kr, 12 * W, kept[0])
                save(kr, 13 * W, kept[1])
                save(kr, 14 * W, s0)
                save(kr, 15 * W, s1)
                save(kr, 16 * W, 1.0 / s0)
                save(kr, 17 * W, 1.0 / s1)
                save3(cr, 0, W, g)
                save3(cr, 3 * W, W, a)
                save3(cr, 6 * W, W, w)
            for _ in range(n_steps):
                for m in range(p):
                    for r in range(tile):
                        order(c[r], k[r], m, h)
                for r in range(tile):
                    finish(c[r], k[r], p)
            for r in range(tile):
                b = (block * tile + r) * W
                for j in range(9):
                    save(out_flat, b + j * n, load(c[r], j * W, W))
        return 0

    return march_tiles


MORE = {f"t{tile}": make_march(tile) for tile in (1, 2, 3, 4)}
