"""Symplectic steps: rotations of four kinds, and kicks, which add h T to the momentum L at a fixed attitude.

EXACT rotations of the free body need no polhode and no angle of its own. Let k = 1/J, g = (k3 - k2, k1 - k3, k2 - k1), J2 the
intermediate moment, and

    alpha = g1 (g3 L2^2 - g2 L3^2)      beta = g3 (g1 L2^2 - g2 L1^2)
    s' = C D,  C' = -alpha s D,  D' = -beta s C

so that s = sn(nu t)/nu, C = cn, D = dn with nu^2 = alpha, m nu^2 = beta. By the addition theorem of Jacobi's functions, L after
h is a rational function of L and (s, C, D). It conserves energy and |L| for any s, because C^2 = 1 - alpha s^2 and
D^2 = 1 - beta s^2. No sign and no axis has to be chosen, and neither the separatrix nor a symmetric body is a special case.

The quaternion of the step has the form of DMV steps (`moser_veselov`): its vector is K (L0 + L1), K diagonal and affine in k.
The constants belong to the step that is symmetric about L2 = 0, where L = (A1, 0, A3). They follow from the momentum at its
end, (A1 C, g2 A1 A3 s, A3 D), and the angle f about the momentum in half of it. Time and angle are integrals without elliptic
functions over y = s / (1 + C), with u = 1 + alpha y^2:

    W^2 = u^2 - 4 beta y^2      t = int 2 dy / W      phi = int 2 u dy / (W (l u + A3 W))
    f = k3 l t + (g2 L1^2 - g1 L2^2) phi

The integrands are even and have no singularity where |y| is below about 1/nu, with nu^2 the larger of alpha and beta.
Gauss's quadrature with eight nodes, of which four are evaluated, is therefore exact to round-off for nu h < 1/2; longer
rotations are made in parts.

With the momentum r of a rotor, the kinetic energy (L - r)'J^-1(L - r)/2 also has the part -L.J^-1 r, whose exact flow turns the
body at a constant rate: half of it is taken before the exact rotation, half after it.

AXES: rotations about the axes 3, 2, 1, 2, 3, as if the body had no other rate. With a rotor each has the rate (L_i - r_i)/J_i.

ENDS, MIDDLE: discrete Moser-Veselov (DMV) steps, q1 = q0 (1, c) / sqrt(1 + c.c). The Cayley vector c solves

    J c + c x (J c) = (h/2) (1 + c.c) l,  l = L0 + (h/2) T0          L1 = Cay(2 c)' l + (h/2) T1

ENDS makes kicks of these T0 and T1. In the MIDDLE the potential is evaluated at the attitude q0 (1, a), c = 2 a / (1 - a.a).
By the virtual work of the torque T there, T0 = T + a x T and T1 = T - a x T, whose sum in world axes is 2 T: the momentum about
the field's axis is conserved. As L1 is l turned back, no error of the solver changes a momentum.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from . import entry, kernel, small
from .compiler.signals import call_handlers, end_of_block
from .compiler.vector import add, apply, cross, dot, fuse, invert, scale, subtract, times, turn
from .elliptic import sine_and_cosine
from .fields import at_time, body_torque, own, whole
from .protocol import Output, Result, Workspace, deliver, find_ends, record
from .reduced import add_momentum, turn_attitude

FAILURE = "no solution for c on the branch that begins at a step of length 0, or a free rotation of more than 1,000 rad"
"""Reason that a step fails."""
EXACT, AXES, ENDS, MIDDLE = range(4)
PAUSE = 2**16
"""Stages between two calls of handlers of signals."""
MOST_PARTS, MOST_CORRECTIONS = 1000.0, 50
"""Largest number of parts of a free rotation, and of corrections of an implicit step."""
ROUND_OFF, NEARLY, TINY = 1e-32, 1e-26, 1e-40
"""The solver stops at the first square of a relative correction, or where those below the second no longer shrink. The third is
added to |c|^2 for a body at rest."""
NODES = tuple((float(x), float(weight)) for x, weight in zip(*np.polynomial.legendre.leggauss(8), strict=True) if x > 0)
"""Positive nodes and their weights of Gauss's quadrature with eight nodes on [-1, 1]."""


class Model(NamedTuple):
    """Moments, kg m^2, and their inverses, field or None, attitude and momentum, kg m^2/s, at the start.

    Principal axes; the second moment is the intermediate one. `kind` belongs to the rotations. `rotor` is the momentum of the
    rotor, kg m^2/s, which L does not contain, or None. The steps are steps of the whole momentum L + rotor.
    """

    J: Any
    J_inverse: Any
    field: Any
    q: Any
    L: Any
    kind: int
    rotor: Any


class Coefficients(NamedTuple):
    """Lengths (n,) of rotations and of the kicks after them, times of the kicks in a step, and its length, all in s."""

    rotations: Any
    kicks: Any
    nodes: Any
    h: float


@small
def torque(field, t, q):
    """Return the torque, N m, at a time, s; 0 for a free body."""
    return (0.0, 0.0, 0.0) if field is None else body_torque(at_time(field, t), q)


@small
def half_step(half, alpha, beta, l, A3):  # noqa: E741
    """Return y and phi after half a step: from the series of y, and a correction by Newton's method with quadratures."""
    # y'' = b y + a y^3, from y = t/2 at 0
    b, a = 0.5 * alpha - beta, 0.5 * alpha * alpha
    y1 = b / 12.0
    y3 = b * y1 + 0.125 * a
    y5 = (0.05 * b * y3 + 0.75 * a * y1) / 42.0
    t = half * half
    y = half * (0.5 + t * (y1 + t * (0.05 * y3 + t * y5)))
    time, phi, square = 0.0, 0.0, y * y
    # The integrands are even, so the positive nodes on [-y, y], with their weights, give the integral from 0 to y.
    for i in range(4):
        node, weight = NODES[i]
        up = 1.0 + alpha * square * (node * node)
        W = math.sqrt(up * up - 4.0 * beta * square * (node * node))
        below = l * up + A3 * W
        r = 2.0 * weight * y / (W * below)
        time, phi = time + r * below, phi + r * up
    up = 1.0 + alpha * square
    W = math.sqrt(up * up - 4.0 * beta * square)
    # dt = 2 dy / W and dphi = u dt / (l u + A3 W), at the end of the half step
    late = half - time
    phi += late * up / (l * up + A3 * W)
    y += 0.5 * late * W
    return y, phi


@small
def rotate_exactly(h, k, q, q_carry, L, L_carry):
    """Return attitude and momentum of a free body after h, as compensated sums; |w| h < 2 and nu h < 1/2."""
    g1, g2, g3 = k[2] - k[1], k[0] - k[2], k[1] - k[0]
    share = -g1 / g2 if g2 != 0.0 else 0.5  # (k2 - k3) / (k1 - k3); any number for a sphere
    l = math.sqrt(dot(L, L))  # noqa: E741
    if l == 0.0:
        return q, q_carry, L, L_carry
    x, y2, z = L[0] * L[0], L[1] * L[1], L[2] * L[2]
    A1_squared, A3 = x + share * y2, math.sqrt(z + (1.0 - share) * y2)
    alpha, beta = g1 * (g3 * y2 - g2 * z), g3 * (g1 * y2 - g2 * x)
    half = 0.5 * h
    y, phi = half_step(half, alpha, beta, l, A3)
    square = y * y
    up = 1.0 + alpha * square
    over = 1.0 / up
    s, C = 2.0 * y * over, (2.0 - up) * over
    D = math.sqrt(1.0 - beta * s * s)
    s2, CD = s * s, C * D
    over = 1.0 / (1.0 - alpha * beta * s2 * s2)
    # the whole step: sn, and cn - 1 and dn - 1 without cancellation; n is what the addition theorem divides by, less 1
    S, C1, D1 = 2.0 * s * CD * over, -2.0 * alpha * s2 * D * D * over, -2.0 * beta * s2 * C * C * over
    n = g1 * g3 * S * S * y2
    gain = scale(
        1.0 / (1.0 - n),
        (
            fuse(L[0], C1 + n, g1 * S * (1.0 + D1) * L[1] * L[2]),
            fuse(L[1], C1 + D1 + C1 * D1 + n, g2 * S * L[2] * L[0]),
            fuse(L[2], D1 + n, g3 * S * (1.0 + C1) * L[0] * L[1]),
        ),
    )
    sine, cosine = sine_and_cosine(k[2] * l * half + (g2 * x - g1 * y2) * phi)
    side = g2 * A3 * s
    front = l + A3 * D
    K1 = front * (C * sine + side * cosine) / (2.0 * C)
    K3 = (D * front * sine - A1_squared * g2 * s * (C * cosine - side * sine)) / (2.0 * D)
    r0 = (A1_squared * C * C + A3 * D * front) * cosine - A1_squared * side * C * sine
    r0 *= (1.0 + g1 * g3 * s2 * L[1] * (L[1] + gain[1])) * over
    cayley = scale(1.0 / r0, times((K1, share * K1 + (1.0 - share) * K3, K3), add(add(L, L), gain)))
    L, L_carry = add_momentum(L, L_carry, gain)
    q, q_carry = turn_attitude(cayley, q, q_carry)
    return q, q_carry, L, L_carry


@small
def rotate_about_axis(axis, h, k, rotor, q, L):
    """Return attitude and momentum after a rotation about a principal axis, as if the body had no other rates."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    s, c = sine_and_cosine(0.5 * h * k[axis] * (L[axis] if rotor is None else L[axis] - rotor[axis]))
    sine, cosine = 2.0 * s * c, 1.0 - 2.0 * s * s
    u, v = cosine * L[i] + sine * L[j], cosine * L[j] - sine * L[i]
    a, b, d, e = q[0], q[1 + axis], q[1 + i], q[1 + j]
    a, b, d, e = c * a - s * b, c * b + s * a, c * d + s * e, c * e - s * d
    if axis == 0:
        return (a, b, d, e), (L[0], u, v)
    if axis == 1:
        return (a, e, b, d), (v, L[1], u)
    return (a, d, e, b), (u, v, L[2])


@small
def turn_with_rotor(h, k, rotor, q, q_carry, L, L_carry):
    """Return attitude and momentum after h of the part -L.J^-1 r of the energy: a constant rate -J^-1 r of the body."""
    rate = times(k, rotor)
    speed = math.sqrt(dot(rate, rate))
    s, c = sine_and_cosine(0.5 * h * speed)
    a = scale(-s / (c * speed), rate)
    turned = cross(a, L)
    gain = scale(2.0 / (1.0 + dot(a, a)), subtract(cross(a, turned), turned))
    q, q_carry = turn_attitude(a, q, q_carry)
    L, L_carry = add_momentum(L, L_carry, gain)
    return q, q_carry, L, L_carry


@small
def correct(h, J, l, c):  # noqa: E741
    """Return the correction of c by Newton's method for a fixed l, and one over the determinant."""
    Jc, one = times(J, c), 1.0 + dot(c, c)
    rest = subtract(add(Jc, cross(c, Jc)), scale(0.5 * h * one, l))
    k0 = (J[0] - h * c[0] * l[0], c[2] * J[0] - Jc[2] - h * c[0] * l[1], Jc[1] - c[1] * J[0] - h * c[0] * l[2])
    k1 = (Jc[2] - c[2] * J[1] - h * c[1] * l[0], J[1] - h * c[1] * l[1], c[0] * J[1] - Jc[0] - h * c[1] * l[2])
    k2 = (c[1] * J[2] - Jc[1] - h * c[2] * l[0], Jc[0] - c[0] * J[2] - h * c[2] * l[1], J[2] - h * c[2] * l[2])
    rows, over = invert((k0, k1, k2))
    return apply(rows, rest), over


@small
def solve(h, t, J, J_inverse, field, middle, q, L):
    """Return (c, L0 with half the kick, the other half of the kick, corrections, size of the last, whether it is a solution).

    In the middle the torque depends on c. It is one correction old, so that corrections shrink by a factor of about
    (h times the rate of the field's oscillations)^2 / 8. L includes the first half of the kick if the torques are at the ends.
    """
    c = scale(0.5 * h, times(J_inverse, L))
    l, kick, square, over, corrections = L, (0.0, 0.0, 0.0), math.inf, 1.0, 0  # noqa: E741
    while corrections < MOST_CORRECTIONS:
        if middle:
            a = scale(1.0 / (1.0 + math.sqrt(1.0 + dot(c, c))), c)
            half = turn(q, a)
            T = torque(field, t + 0.5 * h, (q[0] + half[0], q[1] + half[1], q[2] + half[2], q[3] + half[3]))
            side = cross(a, T)
            l, kick = add(L, scale(0.5 * h, add(T, side))), scale(0.5 * h, subtract(T, side))  # noqa: E741
        move, over = correct(h, J, l, c)
        c = subtract(c, move)
        corrections += 1
        last, square = square, dot(move, move) / (dot(c, c) + TINY)
        if square <= ROUND_OFF or (last <= NEARLY and square >= last):
            break
    return c, l, kick, corrections, math.sqrt(square), square <= NEARLY and over > 0.0


@small
def rotate(kind, h, t, J, k, rotor, field, q, q_carry, L, L_carry):
    """Return attitude and momentum after a rotation from time t, s; corrections, size of the last, and whether it exists."""
    if kind == AXES:
        q, L = rotate_about_axis(2, 0.5 * h, k, rotor, q, L)
        q, L = rotate_about_axis(1, 0.5 * h, k, rotor, q, L)
        q, L = rotate_about_axis(0, h, k, rotor, q, L)
        q, L = rotate_about_axis(1, 0.5 * h, k, rotor, q, L)
        q, L = rotate_about_axis(2, 0.5 * h, k, rotor, q, L)
        return q, q_carry, L, L_carry, 0, 0.0, True
    if kind == EXACT:
        w, (g1, g2, g3) = times(k, L), (k[2] - k[1], k[0] - k[2], k[1] - k[0])
        x, y, z = L[0] * L[0], L[1] * L[1], L[2] * L[2]
        nu_squared = max(g1 * (g3 * y - g2 * z), g3 * (g1 * y - g2 * x))
        # So that nu h < 1/2 and |w| h < 2 in each part, as `rotate_exactly` requires. The number can be nan.
        parts = 1.0 + abs(h) * math.sqrt(4.0 * nu_squared + 0.25 * dot(w, w))
        if not parts < MOST_PARTS:
            return q, q_carry, L, L_carry, 0, parts, False
        if rotor is not None:
            q, q_carry, L, L_carry = turn_with_rotor(0.5 * h, k, rotor, q, q_carry, L, L_carry)
        for _ in range(int(parts)):
            q, q_carry, L, L_carry = rotate_exactly(h / int(parts), k, q, q_carry, L, L_carry)
        if rotor is not None:
            q, q_carry, L, L_carry = turn_with_rotor(0.5 * h, k, rotor, q, q_carry, L, L_carry)
        return q, q_carry, L, L_carry, 0, 0.0, True
    c, l, kick, corrections, size, solved = solve(h, t, J, k, field, kind == MIDDLE, q, L)  # noqa: E741
    turned = cross(c, l)
    gain = add(subtract(l, L), scale(2.0 / (1.0 + dot(c, c)), subtract(cross(c, turned), turned)))
    q, q_carry = turn_attitude(c, q, q_carry)
    L, L_carry = add_momentum(L, L_carry, add(gain, kick))
    return q, q_carry, L, L_carry, corrections, size, solved


@kernel
def march(model, coefficients, workspace):
    """Take the steps (`protocol`)."""
    J, k, field, q, L, kind, rotor = model
    rotations, kicks, nodes, h = coefficients
    n_steps, every, pause, q_out, L_out = workspace
    stages = len(rotations)
    pause = max(1, pause // stages) if pause > 0 else 0
    q_carry, L_carry = (0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    record(0, q, L, q_out, L_out)
    L = whole(rotor, L)
    row, until_sample, done, corrections, size = 0, every, 0, 0, 0.0
    T = torque(field, 0.0, q)
    while done < n_steps:
        last = end_of_block(done, n_steps, pause)
        for step in range(done + 1, last + 1):
            for stage in range(stages):
                part, t = rotations[stage], (step - 1) * h + nodes[stage]
                if part != 0.0:
                    q, q_carry, L, L_carry, more, size, solved = rotate(
                        kind, part, t - part, J, k, rotor, field, q, q_carry, L, L_carry
                    )
                    corrections += more
                    if not solved:
                        return Result(step - 1, (step - 1) * stages, corrections, None, size, False)
                if kicks[stage] != 0.0:
                    if part != 0.0:  # otherwise attitude and time are as in the last kick
                        T = torque(field, t, q)
                    L, L_carry = add_momentum(L, L_carry, scale(kicks[stage], T))
            until_sample -= 1
            if until_sample == 0 or step == n_steps:
                until_sample = every
                row += 1
                record(row, q, own(rotor, L), q_out, L_out)
        done = last
        if done < n_steps:
            call_handlers()
    return Result(n_steps, n_steps * stages, corrections, None, size, False)


MODEL_END, COEFFICIENTS_END, WORKSPACE_END = find_ends(Model, Coefficients)


@entry
def enter(*loose):
    """`march` as Python calls it (`protocol`)."""
    model, coefficients = Model(*loose[:MODEL_END]), Coefficients(*loose[MODEL_END:COEFFICIENTS_END])
    workspace = Workspace(*loose[COEFFICIENTS_END:WORKSPACE_END])
    return deliver(march(model, coefficients, workspace), workspace, Output(*loose[WORKSPACE_END:]))
