"""Gauss collocation for a body with a fixed point in uniform gravity or without a field.

Unknowns are the momentum L and the vertical gamma = R' e_z, both in principal axes (for a free body gamma is the direction of
the world momentum): a closed system of six,

    L' = (L + r) x w + gamma x c,    gamma' = gamma x w,    w = J^-1 L,

with the momentum r of a rotor and the quadratic invariants energy L.w/2 + c.gamma, (L + r).gamma and
gamma.gamma, which collocation at Gauss points keeps at any step. The rest of the attitude is one angle about the vertical, a
quadrature. With the minimal rotation M that takes gamma to a unit vector a fixed in the body, and a constant rotation C that
takes a to e_z,

    R = Rz(phi) C M(gamma),    phi' = w.(gamma + a) / (1 + gamma.a),    R1 = Rz(phi1 - phi0) R0 M(gamma0)' M(gamma1).

Each step has its own a, the gamma at its middle: the divisor stays near 2, and nothing depends on the axes of the body or the
direction of time. The kernel works in units that make L of size one.

The equations are solved by sweeps, from a guess that continues the last step's polynomial, to round-off. A tolerance of 1e-9 of
the momentum would save nearly half of the sweeps, but the remaining error is not symmetric in time, so that the error of the
attitude would grow as the square of the time. `taylor.shortest_move` removes the rounding errors that the invariants gather.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from . import entry, kernel, small
from .compiler.lanes import FOUR, lane_of, load, save, splat
from .compiler.signals import call_handlers
from .compiler.traced import trace
from .compiler.vector import accumulate, add, cross, dot, fuse, product, scale, subtract, times, vertical
from .fields import whole
from .protocol import Output, Result, Workspace, deliver, find_ends, record
from .taylor import shortest_move

FAILURE = "the step is too long for the iteration"
"""Reason that a step fails."""
PAUSE = 2**18
"""Sweeps between two calls of handlers of signals."""
MOST_SWEEPS = 120
"""Largest number of sweeps of a step."""
EARLY, SLOWEST = 4, 0.64
"""A step fails if, after the first few sweeps, two sweeps shrink the square of the change by less than this factor."""
ENOUGH, STAGNATION = 1e-32, 4e-30
"""Sweeps end if the square of the change of the next one is likely to be below `ENOUGH`, or if changes no longer shrink and
their square is below `STAGNATION`, which is round-off."""
ROUND_OFF = 2.0**-51
"""Largest defect of an invariant, relative to its scale, that counts as none."""
LONGEST = 2.0**64
"""Length at which a quaternion is divided by this power of two, which rounds nothing."""


class Model(NamedTuple):
    """The closed system, principal axes, with momenta in units of `unit` kg m^2/s.

    `J_inverse` is 1/J, and `moment` the moment c of the field. `loose` has 1 for each component of L that changes, otherwise 0.
    L, gamma and q are the start, with the attitude q relative to axes whose third one is vertical; the quaternion `left` turns
    these axes into world axes. `rotor` is the momentum of the rotor, which L does not contain, or None.
    """

    unit: float
    J_inverse: Any
    moment: Any
    loose: Any
    L: Any
    gamma: Any
    q: Any
    left: Any
    rotor: Any


class Coefficients(NamedTuple):
    """Number of stages s; A, E by columns, b and its low part; step h, s. The matrices are from `gauss_legendre`: A for the
    stages of a step, E for a guess of the next stages. They are padded with zeros to a multiple of four stages.
    """

    s: int
    A: Any
    E: Any
    b: Any
    b_low: Any
    h: float


@small
def rates(J_inverse, rotor, c, L, g):
    """(L', gamma') of four states."""
    w = (J_inverse[0] * L[0], J_inverse[1] * L[1], J_inverse[2] * L[2])
    # -w, so that differences of products are fused sums too
    v = (-J_inverse[0] * L[0], -J_inverse[1] * L[1], -J_inverse[2] * L[2])
    if rotor is not None:
        L = (L[0] + splat(rotor[0]), L[1] + splat(rotor[1]), L[2] + splat(rotor[2]))
    x = fuse(L[1], w[2], fuse(L[2], v[1], fuse(splat(-c[1]), g[2], c[2] * g[1])))
    y = fuse(L[2], w[0], fuse(L[0], v[2], fuse(splat(-c[2]), g[0], c[0] * g[2])))
    z = fuse(L[0], w[1], fuse(L[1], v[0], fuse(splat(-c[0]), g[1], c[1] * g[0])))
    return (x, y, z), (fuse(g[1], w[2], g[2] * v[1]), fuse(g[2], w[0], g[0] * v[2]), fuse(g[0], w[1], g[1] * v[0]))


@small
def load_six(Z, width, i):
    """L and gamma of the four stages from i on."""
    L = (load(Z, i, FOUR), load(Z, width + i, FOUR), load(Z, 2 * width + i, FOUR))
    return L, (load(Z, 3 * width + i, FOUR), load(Z, 4 * width + i, FOUR), load(Z, 5 * width + i, FOUR))


@small
def put_six(Z, width, i, L, g):
    """Store what `load_six` loads."""
    save(Z, i, L[0])
    save(Z, width + i, L[1])
    save(Z, 2 * width + i, L[2])
    save(Z, 3 * width + i, g[0])
    save(Z, 4 * width + i, g[1])
    save(Z, 5 * width + i, g[2])


@small
def combine(M, s, width, i, F, at):
    """Return the sums over j of a_ij times the rates of stage j, for the four stages from i on.

    Rates are stored from F[at] on. M (stages, width) has the column j of the matrix in row j.
    """
    d0 = d1 = d2 = d3 = d4 = d5 = splat(0.0)
    for j in range(s):
        a, k = load(M, j * width + i, FOUR), at + j
        d0 = fuse(a, load(F, k, 1), d0)
        d1 = fuse(a, load(F, k + width, 1), d1)
        d2 = fuse(a, load(F, k + 2 * width, 1), d2)
        d3 = fuse(a, load(F, k + 3 * width, 1), d3)
        d4 = fuse(a, load(F, k + 4 * width, 1), d4)
        d5 = fuse(a, load(F, k + 5 * width, 1), d5)
    return (d0, d1, d2), (d3, d4, d5)


@small
def shift(u, h, d):
    """Return u + h d for three floats u and three fours d."""
    return (fuse(h, d[0], splat(u[0])), fuse(h, d[1], splat(u[1])), fuse(h, d[2], splat(u[2])))


@small
def add_squares(a, b, total):
    """Return total + |a - b|^2 for three fours."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return fuse(x, x, fuse(y, y, fuse(z, z, total)))


@small
def sweep(M, s, h, J_inverse, rotor, c, L0, g0, F, old, new, Z):
    """Compute Z = (L0, g0) + h M f with the rates f from F[old] on, and write the rates at Z from F[new] on.

    Z has six rows of stages, their number a multiple of four. Return the square of the change of Z.
    """
    width, step, square = Z.shape[0] // 6, splat(h), splat(0.0)
    for i in range(0, width, FOUR):
        dL, dg = combine(M, s, width, i, F, old)
        L, g = shift(L0, step, dL), shift(g0, step, dg)
        n, v = rates(J_inverse, rotor, c, L, g)
        # F has two halves, so that all stages see the rates of the last sweep, in any order of the loop.
        put_six(F, width, new + i, n, v)
        before = load_six(Z, width, i)
        square = add_squares(g, before[1], add_squares(L, before[0], square))
        put_six(Z, width, i, L, g)
    return sum_lanes(square)


@small
def solve_stages(A, s, h, J_inverse, rotor, c, L, g, F, old, Z):
    """Iterate Z = (L, g) + h A f(Z) from the rates at F[old].

    Return where the rates at Z are in F, the number of sweeps, the square of the last change and whether it is round-off.
    """
    before = earlier = 0.0
    new = Z.shape[0] - old
    for sweeps in range(1, MOST_SWEEPS + 1):
        square = sweep(A, s, h, J_inverse, rotor, c, L, g, F, old, new, Z)
        old, new = new, old
        # The change at least halves. If it goes on so, the square of the next one is square^2 / before.
        fast = 4.0 * square < before
        if (fast and square * square <= ENOUGH * before) or (not fast and square < STAGNATION):
            return old, sweeps, square, True
        # Eigenvalues of the iteration come in pairs, so that changes rise and fall: two sweeps are compared with two.
        if sweeps > EARLY and not square < SLOWEST * earlier:
            return old, sweeps, square, False
        earlier, before = before, square
    return old, MOST_SWEEPS, before, False


@small
def hold_rates(J_inverse, rotor, c, L, g, F, width):
    """Write the rates of one state to F for all stages."""
    n, v = rates(J_inverse, rotor, c, (splat(L[0]), splat(L[1]), splat(L[2])), (splat(g[0]), splat(g[1]), splat(g[2])))
    for i in range(0, width, FOUR):
        put_six(F, width, i, n, v)


@small
def middle(s, Z):
    """A vector along gamma at the middle of the step: gamma of the stage there, or the mean of the two stages next to it."""
    width = Z.shape[0] // 6
    i, j = 3 * width + (s - 1) // 2, 3 * width + s // 2
    return (0.5 * (Z[i] + Z[j]), 0.5 * (Z[width + i] + Z[width + j]), 0.5 * (Z[2 * width + i] + Z[2 * width + j]))


@small
def carry_attitude(q, carry, a, size, g0, g1):
    """A quaternion, longer than q, of R M(g0)' M(g1), as a compensated sum; a is of length `size`.

    With a of unit length the quaternion of M(g0)' M(g1) is along (1 + g0.a + g1.a + g0.g1, (g1 - g0) x (g0 + a)).
    """
    v = cross(subtract(g1, g0), add(scale(size, g0), a))
    v = scale(1.0 / (size + dot(add(g0, g1), a) + size * dot(g0, g1)), v)
    d = product(q, (0.0, v[0], v[1], v[2]))
    w, cw = accumulate(q[0], carry[0], d[0])
    x, cx = accumulate(q[1], carry[1], d[1])
    y, cy = accumulate(q[2], carry[2], d[2])
    z, cz = accumulate(q[3], carry[3], d[3])
    if max(max(abs(w), abs(x)), max(abs(y), abs(z))) > LONGEST:
        s = 1.0 / LONGEST
        return (s * w, s * x, s * y, s * z), (s * cw, s * cx, s * cy, s * cz)
    return (w, x, y, z), (cw, cx, cy, cz)


@small
def minimal_rotation(g, a):
    """Quaternion, not normalised, of the minimal rotation that takes the unit vector g to a."""
    n = cross(g, a)
    return (1.0 + dot(g, a), n[0], n[1], n[2])


@kernel
def attitude(left, phi, q, gamma):
    """Quaternion, not normalised, of the rotations R, Rz(phi) and `left`, one after the other.

    R is the rotation of q, with its round-off corrected so that it takes gamma to e_z.
    """
    z = product(left, (math.cos(0.5 * phi), 0.0, 0.0, math.sin(0.5 * phi)))
    return product(z, product(q, minimal_rotation(gamma, vertical(q))))


@small
def integrate_turn(h, b, a, size, J_inverse, Z):
    """Integral of phi' over the step; a is of length `size`."""
    width = Z.shape[0] // 6
    total = splat(0.0)
    for i in range(0, width, FOUR):
        w = (
            J_inverse[0] * load(Z, i, FOUR),
            J_inverse[1] * load(Z, width + i, FOUR),
            J_inverse[2] * load(Z, 2 * width + i, FOUR),
        )
        g = (load(Z, 3 * width + i, FOUR), load(Z, 4 * width + i, FOUR), load(Z, 5 * width + i, FOUR))
        above = w[0] * (size * g[0] + splat(a[0])) + w[1] * (size * g[1] + splat(a[1])) + w[2] * (size * g[2] + splat(a[2]))
        total = total + load(b, i, FOUR) * above / (splat(size) + (a[0] * g[0] + a[1] * g[1] + a[2] * g[2]))
    return h * sum_lanes(total)


@small
def sum_lanes(v):
    """Sum of four floats."""
    return (lane_of(v, 0) + lane_of(v, 2)) + (lane_of(v, 1) + lane_of(v, 3))


@small
def weigh(b, b_low, F, at):
    """Sum of b_j times the rates from F[at] on, as six floats."""
    width = b.shape[0]
    zero = splat(0.0)
    n, v = (zero, zero, zero), (zero, zero, zero)
    for i in range(0, width, FOUR):
        # The low parts first: added to the sum of the high parts they would be rounded away.
        x, y = load_six(F, width, at + i)
        n, v = add_weighted(load(b_low, i, FOUR), x, n), add_weighted(load(b_low, i, FOUR), y, v)
    for i in range(0, width, FOUR):
        x, y = load_six(F, width, at + i)
        n, v = add_weighted(load(b, i, FOUR), x, n), add_weighted(load(b, i, FOUR), y, v)
    return (sum_lanes(n[0]), sum_lanes(n[1]), sum_lanes(n[2])), (sum_lanes(v[0]), sum_lanes(v[1]), sum_lanes(v[2]))


@small
def add_weighted(b, x, total):
    """Return total + b x for three fours."""
    return (fuse(b, x[0], total[0]), fuse(b, x[1], total[1]), fuse(b, x[2], total[2]))


@small
def add_carried(v, carry, d):
    """Return v + d as a compensated sum of vectors."""
    x, cx = accumulate(v[0], carry[0], d[0])
    y, cy = accumulate(v[1], carry[1], d[1])
    z, cz = accumulate(v[2], carry[2], d[2])
    return (x, y, z), (cx, cy, cz)


@small
def values(J_inverse, rotor, c, L, g):
    """Energy and vertical momentum, in the units of the model."""
    return 0.5 * dot(L, times(J_inverse, L)) + dot(c, g), dot(whole(rotor, L), g)


move = trace(shortest_move)
"""`taylor.shortest_move` as kernels call it."""


@small
def remove_round_off(J_inverse, rotor, c, loose, kept, size, L, L_carry, g, g_carry):
    """Bring energy and momentum back to `kept` and the length of gamma to 1, if they differ by more than `ROUND_OFF`."""
    now = values(J_inverse, rotor, c, L, g)
    e, m, longer = kept[0] - now[0], kept[1] - now[1], 0.5 - 0.5 * dot(g, g)
    if abs(e) <= ROUND_OFF * size and max(abs(m), abs(longer)) <= ROUND_OFF:
        return L, L_carry, g, g_carry
    w, T = times(J_inverse, L), cross(g, c)
    # Energy and momentum are linear in gamma, so its new length changes them by longer c.gamma and longer L.gamma.
    dL, turn, _ = move(loose, (size, 1.0), w, whole(rotor, L), T, e - longer * dot(c, g), m - longer * now[1], g)
    L, L_carry = add_carried(L, L_carry, dL)
    g, g_carry = add_carried(g, g_carry, add(scale(longer, g), cross(g, turn)))
    return L, L_carry, g, g_carry


@kernel
def march(model, coefficients, workspace):
    """Take the steps (`protocol`). A step fails if its sweeps do not converge; the size is the change of the last sweep."""
    unit, J_inverse, c, loose, L, gamma, q, left, rotor = model
    s, A, E, b, b_low, h = coefficients
    n_steps, every, pause, q_out, L_out = workspace
    width = b.shape[0]
    # F has two halves. The rates of the last sweep begin at `at`, the other half at 6 * width - at.
    F, Z, at = np.zeros(12 * width), np.zeros(6 * width), 0
    none = (0.0, 0.0, 0.0)
    L_carry, g_carry, q_carry, phi, phi_carry = none, none, (0.0, 0.0, 0.0, 0.0), 0.0, 0.0
    kept = values(J_inverse, rotor, c, L, gamma)
    size = 0.5 * dot(L, times(J_inverse, L)) + math.sqrt(dot(c, c))
    store(0, left, phi, q, gamma, unit, L, q_out, L_out)
    # The first step has no polynomial to continue. Its guess has the rates of the start in all stages.
    hold_rates(J_inverse, rotor, c, L, gamma, F, width)
    guess, row, work, square, until_pause = A, 0, 0, 0.0, pause
    for step in range(1, n_steps + 1):
        sweep(guess, s, h, J_inverse, rotor, c, L, gamma, F, at, 6 * width - at, Z)
        at, sweeps, square, good = solve_stages(A, s, h, J_inverse, rotor, c, L, gamma, F, 6 * width - at, Z)
        work += sweeps
        if not good:
            return Result(step - 1, (step - 1) * s, work, None, math.sqrt(square), False)
        guess = E
        a = middle(s, Z)
        length = math.sqrt(dot(a, a))
        phi, phi_carry = accumulate(phi, phi_carry, integrate_turn(h, b, a, length, J_inverse, Z))
        before = gamma
        dL, dg = weigh(b, b_low, F, at)
        # The momentum about an axis of symmetry is constant. Its round-off over the small moment of a rod would be a rate.
        dL = times(loose, dL)
        L, L_carry = add_carried(L, L_carry, scale(h, dL))
        gamma, g_carry = add_carried(gamma, g_carry, scale(h, dg))
        L, L_carry, gamma, g_carry = remove_round_off(J_inverse, rotor, c, loose, kept, size, L, L_carry, gamma, g_carry)
        q, q_carry = carry_attitude(q, q_carry, a, length, before, gamma)
        if step % every == 0 or step == n_steps:
            row += 1
            # The carry of `accumulate` is by how much the sum is too large.
            store(row, left, phi - phi_carry, q, gamma, unit, L, q_out, L_out)
        until_pause -= sweeps
        if until_pause <= 0 < pause:
            until_pause = pause
            call_handlers()
    return Result(n_steps, n_steps * s, work, None, math.sqrt(square), False)


MODEL_END, COEFFICIENTS_END, WORKSPACE_END = find_ends(Model, Coefficients)


@entry
def enter(*loose):
    """`march` as Python calls it (`protocol`)."""
    model, coefficients = Model(*loose[:MODEL_END]), Coefficients(*loose[MODEL_END:COEFFICIENTS_END])
    workspace = Workspace(*loose[COEFFICIENTS_END:WORKSPACE_END])
    return deliver(march(model, coefficients, workspace), workspace, Output(*loose[WORKSPACE_END:]))


@kernel
def store(row, left, phi, q, gamma, unit, L, q_out, L_out):
    """Write a state."""
    record(row, attitude(left, phi, q, gamma), scale(unit, L), q_out, L_out)
