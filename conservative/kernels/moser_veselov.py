"""Discrete Moser-Veselov steps of a free body, explicit: every one is a shift along the polhode.

Symbols, in axes e1, e2, e3 of the principal frame that `polhode_axes` chooses (e2 is the intermediate axis, L never leaves the
side of +e3), for a step h:

    L = (A1 c, A2 s, A3 d)               s, c, d = sn, cn, dn of u = nu t, m = 1 - mc;  s^2 + c^2 = 1, d^2 = mc + m c^2
    S, C, D                              sn, cn, dn of HALF the shift that one step makes of u
    (r0, r1 c, r2 s, r3 d)               direction of the quaternion of one step, with s, c, d at the middle of the step
    q = z (1 + L3/l, L2/l, -L1/l, 0)     attitude against axes with e_z along the momentum, l = |L|; z is a complex number

A DMV step with inertia B, 1/B = css/J + cdd, keeps the quadrics of energy and |L|, and a map of that curve to itself without
fixed points is a shift (Moser & Veselov 1991): so the addition theorem of Jacobi's functions gives L_n+1 from L_n without
solving an equation. The Cayley vector of the step is proportional, component by component, to (c, s, d) at its middle; as the
sum of both ends is too, with 1 / (1 - m S^2 s^2) in common, it costs no square root either. Tests check both against the DMV
equations.

Many bodies take the same steps in lanes (`moser_veselov_lanes`).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from . import entry, kernel, small
from .compiler.signals import call_handlers, end_of_block
from .compiler.vector import choose, fill_like, fuse, product
from .polhode import Polhode, Step
from .protocol import Output, Result, Workspace, deliver, find_ends, record

PAUSE = 2**20
"""Steps between two calls of handlers of signals."""
RESCALE = 32
"""Steps between two rescalings of z, whose modulus changes by a factor in [1/2, 2] or so a step."""


class Model(NamedTuple):
    """The values of a `Polhode` and the initial attitude, both in this module's axes."""

    polhode: Any
    q: Any


Coefficients = Step
"""All that a step is made of."""


class Shift(NamedTuple):
    """Constants of all steps of a run.

    Of a whole shift cn, sn, cn dn, sn dn and m sn^2; m and mc; factors of a step's quaternion, y0 to y3; amplitudes of L/l.
    """

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


class State(NamedTuple):
    """The state: s, c, d and the complex number z of the attitude."""

    s: Any
    c: Any
    d: Any
    z_re: Any
    z_im: Any


@kernel
def directions(p):
    """Amplitudes of L/l; a body at rest has no direction of its own and gets e3."""
    one = fill_like(1.0, p.l)
    rests = p.l == 0.0
    size = choose(rests, one, p.l)
    return (p.A1 / size, p.A2 / size, choose(rests, one, p.A3 / size))


@kernel
def whole_shift(p, step):
    """Return the constants of all steps: one whole shift, by the addition theorem from two halves.

    1 / (1 - m S^2 s_mid^2) = (1 + m S^2 s0 s1) / (1 - m S^4), and s0 + s1 = 2 s_mid C D / (1 - m S^2 s_mid^2), and so on.
    """
    S, C, D, m = step.S, step.C, step.D, p.m
    below = 1.0 / (1.0 - m * S * S * S * S)
    S1, C1, D1 = 2.0 * S * C * D * below, (C * C - S * S * D * D) * below, (D * D - m * S * S * C * C) * below
    y0, y0s = step.r0 * below, step.r0 * below * m * S * S
    y1, y2, y3 = step.r1 / (2.0 * C), step.r2 / (2.0 * C * D), step.r3 / (2.0 * D)
    a1, a2, a3 = directions(p)
    return Shift(C1, S1, C1 * D1, S1 * D1, m * S1 * S1, m, p.mc, y0, y0s, y1, y2, y3, a1, a2, a3)


@kernel
def start(k, p, q):
    """Return the initial state, and the rotation that multiplies `own_quaternion` to give the attitude q."""
    one, zero = fill_like(1.0, p.l), fill_like(0.0, p.l)
    x, y, up = k.a1 * p.c, k.a2 * p.s, 1.0 + k.a3 * p.d
    n = 1.0 / (x * x + y * y + up * up)
    return State(p.s, p.c, p.d, one, zero), product(q, (n * up, -n * y, n * x, zero))


@small
def advance(k, at):
    """One step.

    After the addition theorem c and s are brought back to s^2 + c^2 = 1 and d is formed from c, so that energy and momentum
    cannot drift, and mc is not lost near the separatrix, where it is far below the round-off of L. Of two products that are
    added, `fuse` says which one is not rounded: the compiler would take either, in lanes the other one.
    """
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
def take_steps(k, at, done, last):
    """Return the state after `last` steps from the state after `done` steps."""
    while done < last:
        # At multiples of RESCALE: results do not depend on where samples and pauses are.
        end = min(last, done - done % RESCALE + RESCALE)
        for _ in range(end - done):
            at = advance(k, at)
        done = end
        if done % RESCALE == 0:
            n = 1.0 / math.sqrt(fuse(at.z_re, at.z_re, at.z_im * at.z_im))
            at = State(at.s, at.c, at.d, at.z_re * n, at.z_im * n)
    return at


@small
def own_quaternion(k, at):
    """Return the quaternion, of any length, of the attitude relative to axes along the momentum."""
    x, y, up = k.a1 * at.c, k.a2 * at.s, 1.0 + k.a3 * at.d
    return (
        at.z_re * up,
        fuse(at.z_re, y, at.z_im * x),
        fuse(at.z_im, y, -(at.z_re * x)),
        at.z_im * up,
    )


@kernel
def store(row, p, k, at, left, q_out, L_out):
    """Write a state: its momentum and its quaternion, turned in the world by a constant rotation."""
    record(row, product(left, own_quaternion(k, at)), (p.A1 * at.c, p.A2 * at.s, p.A3 * at.d), q_out, L_out)


@kernel
def march(model, coefficients, workspace):
    """Take the steps (`protocol`)."""
    p = Polhode(*model.polhode)
    n_steps, every, pause, q_out, L_out = workspace
    k = whole_shift(p, coefficients)
    at, left = start(k, p, model.q)
    store(0, p, k, at, left, q_out, L_out)
    row, done = 0, 0
    while done < n_steps:
        last = end_of_block(done, n_steps, pause)
        while done < last:
            sample = min((row + 1) * every, n_steps)
            end = min(sample, last)
            at = take_steps(k, at, done, end)
            done = end
            if done == sample:
                row += 1
                store(row, p, k, at, left, q_out, L_out)
        if done < n_steps:
            call_handlers()
    return Result(n_steps, n_steps, 0, None, 0.0, False)


MODEL_END, COEFFICIENTS_END, WORKSPACE_END = find_ends(Model, Coefficients)


@entry
def enter(*loose):
    """`march` as Python calls it (`protocol`)."""
    model, coefficients = Model(*loose[:MODEL_END]), Coefficients(*loose[MODEL_END:COEFFICIENTS_END])
    workspace = Workspace(*loose[COEFFICIENTS_END:WORKSPACE_END])
    return deliver(march(model, coefficients, workspace), workspace, Output(*loose[WORKSPACE_END:]))
