"""Discrete Moser-Veselov steps of many free bodies: the arithmetic of `moser_veselov`, with each body in a lane.

`prepare_lanes` makes two columns per body: one of constants and one of the state. The number of columns is a multiple of WIDTH;
the last body fills the rest.
"""

from __future__ import annotations

import math

import numpy as np

from . import entry, kernel, small
from .compiler.lanes import WIDTH, load_rows, save, save_rows
from .compiler.vector import choose, dot, fill_like, product
from .moser_veselov import Shift, State, own_quaternion, start, take_steps, whole_shift
from .polhode import Polhode, Step, exact_step, normalise, polhode, polhode_axes, preprocessed_step
from .protocol import record_lanes

GIVEN = 24
"""Numbers that a body is given by: `gather`."""
SHIFT, LEFT, RATES, AXES, FINISHED = 0, 15, 19, 22, 31
"""First rows: of `Shift`, the turn in front, amplitudes of the rate, the polhode's axes in body axes, and 0 or 1."""
ROWS, STATE_ROWS = 32, 5
SLOWEST = 1e-60
"""Limit of |w| dt below which bodies that turn are left to be run alone: squares of squares would be no floats."""


@kernel
def gather(first, moments, R_BP, R_WB0, w_WB_B0, time, room):
    """Fill rows of lanes: moments, R_BP, R_WB0 and w_WB_B0 of bodies from number `first` on.

    `moments` and `R_BP` are of all bodies or of one for all. Rates are in units of 1 / time, moments in any.
    """
    for lane in range(WIDTH):
        i = min(first + lane, len(R_WB0) - 1)
        own = min(i, len(moments) - 1)
        for j in range(3):
            room[j * WIDTH + lane] = moments[own, j]
            room[(21 + j) * WIDTH + lane] = w_WB_B0[i, j] * time
            for k in range(3):
                room[(3 + 3 * j + k) * WIDTH + lane] = R_BP[own, j, k]
                room[(12 + 3 * j + k) * WIDTH + lane] = R_WB0[i, j, k]


@kernel
def quaternion(x, y, z):
    """Return the unit quaternion of the matrix with these columns, computed from its largest component."""
    # The rule of `attitude.to_quaternion`. That one is for NumPy, needs no numba, and divides: the last bits differ.
    wx, wy, wz = y[2] - z[1], z[0] - x[2], x[1] - y[0]
    xy, xz, yz = x[1] + y[0], x[2] + z[0], y[2] + z[1]
    largest, q1, q2, q3 = 1.0 + x[0] + y[1] + z[2], 1.0 + x[0] - y[1] - z[2], 1.0 - x[0] + y[1] - z[2], 1.0 - x[0] - y[1] + z[2]
    q = (largest, wx, wy, wz)
    q, largest = choose(q1 > largest, (wx, q1, xy, xz), q), max(largest, q1)
    q, largest = choose(q2 > largest, (wy, xy, q2, yz), q), max(largest, q2)
    q = choose(q3 > largest, (wz, xz, yz, q3), q)
    n = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (n * q[0], n * q[1], n * q[2], n * q[3])


@kernel
def turn(R, a):
    """Return the direction of an axis, rotated by the matrix with rows R."""
    return (
        R[0] * a[2] + R[1] * a[3] + R[2] * a[4],
        R[3] * a[2] + R[4] * a[3] + R[5] * a[4],
        R[6] * a[2] + R[7] * a[3] + R[8] * a[4],
    )


@kernel
def step_of_order(p, h, order, room):
    """`preprocessed_step` of each body, one after the other: it branches on their numbers."""
    save_rows(room, 0, WIDTH, p)
    for i in range(WIDTH):
        a = room[i::WIDTH]
        alone = Polhode(a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9], a[10], a[11], a[12], a[13])
        step = preprocessed_step(alone, h, order)
        for j in range(7):
            a[j] = step[j]
    return Step(*load_rows(room, 0, WIDTH, 7, WIDTH))


@entry
def prepare_lanes(moments, R_BP, R_WB0, w_WB_B0, time, dt, order, limits, table, states):
    """Fill `table` (ROWS, columns) and `states` (STATE_ROWS, columns) for steps dt of an order, 0 for the exact one.

    Bodies are given as `gather` takes them; dt is in units `time`. `limits` are for |w| dt, nu dt and cn: bodies
    beyond them, or without a step, get 0 in the row FINISHED.
    """
    columns, flat, room = table.shape[1], table.reshape(-1), np.empty(GIVEN * WIDTH)
    for first in range(0, columns, WIDTH):
        gather(first, moments, R_BP, R_WB0, w_WB_B0, time, room)
        J, R = load_rows(room, 0, WIDTH, 3, WIDTH), load_rows(room, 3 * WIDTH, WIDTH, 9, WIDTH)
        A, w = load_rows(room, 12 * WIDTH, WIDTH, 9, WIDTH), load_rows(room, 21 * WIDTH, WIDTH, 3, WIDTH)
        x, y, z = polhode_axes(
            (J[0], (w[0] * R[0] + w[1] * R[3] + w[2] * R[6]) * J[0], R[0], R[3], R[6]),
            (J[1], (w[0] * R[1] + w[1] * R[4] + w[2] * R[7]) * J[1], R[1], R[4], R[7]),
            (J[2], (w[0] * R[2] + w[1] * R[5] + w[2] * R[8]) * J[2], R[2], R[5], R[8]),
        )
        p = polhode(x[0], y[0], z[0], x[1], y[1], z[1])
        h = fill_like(dt, p.l)
        step = normalise(exact_step(p, h) if order == 0 else step_of_order(p, dt, order, room))
        k = whole_shift(p, step)
        at, left = start(k, p, quaternion(turn(A, x), turn(A, y), turn(A, z)))
        rates = (p.A1 / (p.J1 * time), p.A2 / (p.J2 * time), p.A3 / (p.J3 * time))
        axes = (x[2], y[2], z[2], x[3], y[3], z[3], x[4], y[4], z[4])
        # There is a step below the limits whose squares stay in the range of floats.
        angle = math.sqrt(dot(w, w)) * h
        possible = (angle == 0.0) | ((angle > SLOWEST) & (angle < limits[0]))
        # The last condition: r0 is finite. The difference of infinity or nan with itself is nan.
        possible = possible & (abs(p.nu) * h < limits[1]) & (limits[2] < step.C) & (step.r0 - step.r0 == 0.0)
        finished = choose(possible, 1.0, 0.0 * h)
        save_rows(flat, first + SHIFT * columns, columns, k)
        save_rows(states.reshape(-1), first, columns, at)
        save_rows(flat, first + LEFT * columns, columns, left)
        save_rows(flat, first + RATES * columns, columns, rates)
        save_rows(flat, first + AXES * columns, columns, axes)
        save(flat, first + FINISHED * columns, finished)


@small
def store_state(flat, columns, k, at, first, row, samples, R_flat, w_flat):
    """Write sample number `row` of the bodies of a number, in body axes."""
    w, x, y, z = product(load_rows(flat, first + LEFT * columns, columns, 4, WIDTH), own_quaternion(k, at))
    s = 2.0 / (w * w + x * x + y * y + z * z)
    r0 = (1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y))
    r1 = (s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x))
    r2 = (s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y))
    axes = load_rows(flat, first + AXES * columns, columns, 9, WIDTH)
    amplitudes = load_rows(flat, first + RATES * columns, columns, 3, WIDTH)
    a, b, c = axes[0:3], axes[3:6], axes[6:9]
    rates = (amplitudes[0] * at.c, amplitudes[1] * at.s, amplitudes[2] * at.d)
    rows = (dot(r0, a), dot(r0, b), dot(r0, c), dot(r1, a), dot(r1, b), dot(r1, c), dot(r2, a), dot(r2, b), dot(r2, c))
    record_lanes(first, row, samples, rows, R_flat)
    record_lanes(first, row, samples, (dot(rates, a), dot(rates, b), dot(rates, c)), w_flat)


@entry
def march_lanes(table, states, done, last, n_steps, every, R_WB, w_WB_B):
    """Take the steps of all bodies from number `done` to `last` of `n_steps`, and store the samples that fall among them.

    R_WB (columns, s, 3, 3) and w_WB_B (columns, s, 3), rad/s, in body axes, get the start, every `every`-th step, and the last.
    """
    columns, flat = table.shape[1], table.reshape(-1)
    R_flat, w_flat, samples = R_WB.reshape(-1), w_WB_B.reshape(-1), R_WB.shape[1]
    for first in range(0, columns, WIDTH):
        k = Shift(*load_rows(flat, first + SHIFT * columns, columns, 15, WIDTH))
        at = State(*load_rows(states.reshape(-1), first, columns, STATE_ROWS, WIDTH))
        # Row 0 is the start, which the first call stores.
        row, here = (done // every + 1 if done > 0 else 0), done
        while here < last or row == 0:
            sample = min(row * every, n_steps)
            end = min(sample, last)
            at = take_steps(k, at, here, end)
            here = end
            if here == sample:
                store_state(flat, columns, k, at, first, row, samples, R_flat, w_flat)
                row += 1
        save_rows(states.reshape(-1), first, columns, at)
