"""Steps of textbook methods, which serve as baselines.

With w = J^-1 L and the body's torque T, in principal axes, Q' = Q hat(w) and L' = L x w + T. Every method moves the attitude
by products with rotations exp(v), v in rad, so it stays a rotation. No step restores an invariant.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from . import entry, kernel, small
from .compiler.signals import call_handlers, end_of_block
from .compiler.vector import add, apply, cross, dot, in_body, inverse, product, scale, subtract, times
from .protocol import Output, Result, Workspace, deliver, find_ends, record
from .reduced import Model
from .symplectic import torque

MOST_CORRECTIONS = 100
"""Largest number of corrections of a step of generalised-alpha."""
FAILURE = f"no solution within {MOST_CORRECTIONS} corrections"
"""Reason that a step of generalised-alpha fails."""
PAUSE = 2**13
"""Steps between two calls of handlers of signals."""
MUNTHE_KAAS, CROUCH_GROSSMAN, GENERALIZED_ALPHA, BUSS, GYROSCOPIC, SPIERS, SPIERS_RATES = range(7)
ROUND_OFF, NEARLY, REST = 1e-30, 1e-20, 1e-4
"""The solver stops at the first squared correction, relative to squared accelerations and REST, or where corrections below the
second no longer shrink. Round-off is larger for long and thin bodies: it grows with the ratio of their moments."""


class Coefficients(NamedTuple):
    """The scheme; weights (stages + 1, stages) and nodes (stages,) of a tableau; alpha_m, alpha_f, beta, gamma; step h, s."""

    scheme: int
    weights: Any
    nodes: Any
    alpha: Any
    h: float


@small
def exponential(v):
    """Return the quaternion of the rotation about v by its length; below 1e-4 the first two terms are exact to round-off."""
    square = dot(v, v)
    angle = math.sqrt(square)
    c = math.cos(0.5 * angle)
    s = math.sin(0.5 * angle) / angle if square > 1e-8 else 0.5 - square / 48.0
    return c, s * v[0], s * v[1], s * v[2]


@small
def gyroscopic_tangent(J, h, w, L):
    """Return the columns of J + h d(w x J w)/dw."""
    return (
        (J[0], h * (J[0] * w[2] - L[2]), h * (L[1] - J[0] * w[1])),
        (h * (L[2] - J[1] * w[2]), J[1], h * (J[1] * w[0] - L[0])),
        (h * (J[2] * w[1] - L[1]), h * (L[0] - J[2] * w[0]), J[2]),
    )


@kernel
def runge_kutta_step(munthe_kaas, weights, nodes, h, t, J_inverse, field, q, L, slopes):
    """Return the state after a step of Munthe-Kaas or Crouch & Grossman; `slopes` (stages, 6) is worked in.

    L takes the ordinary Runge-Kutta step. Crouch & Grossman turn by one exponential per slope, Munthe-Kaas by exp(u) with
    u' = w + u x w / 2 + u x (u x w) / 12: the further terms of dexp^-1 are beyond order 4.
    """
    stages = len(nodes)
    for i in range(stages + 1):
        u, q1, L1 = (0.0, 0.0, 0.0), q, L
        for j in range(i):
            f, slope = h * weights[i, j], slopes[j]
            v = (f * slope[0], f * slope[1], f * slope[2])
            L1 = add(L1, (f * slope[3], f * slope[4], f * slope[5]))
            # u is a sum of vectors, but rotations do not commute: Crouch and Grossman's are multiplied in their order.
            if munthe_kaas:
                u = add(u, v)
            else:
                q1 = product(q1, exponential(v))
        if munthe_kaas:
            q1 = product(q, exponential(u))
        if i < stages:
            w = times(J_inverse, L1)
            slopes[i, 3], slopes[i, 4], slopes[i, 5] = add(cross(L1, w), torque(field, t + nodes[i] * h, q1))
            uw = cross(u, w)
            slopes[i, 0], slopes[i, 1], slopes[i, 2] = add(w, add(scale(0.5, uw), scale(1.0 / 12.0, cross(u, uw))))
    return q1, L1


@kernel
def alpha_step(alpha, h, t, J, field, q, w, rate, a):
    """Return (q, w, w', a) after a step of generalised-alpha, its corrections, and the relative size of the last, squared.

    The unknown is w' at the end. Newton's tangent contains the gyroscopic torque only: the field's part is smaller by h.
    """
    alpha_m, alpha_f, beta, gamma = alpha
    share, x, corrections, last, size = (1.0 - alpha_f) / (1.0 - alpha_m), rate, 0, math.inf, math.inf
    while True:
        a1 = add(scale(share, x), scale(1.0 / (1.0 - alpha_m), subtract(scale(alpha_f, rate), scale(alpha_m, a))))
        w1 = add(w, scale(h, add(scale(1.0 - gamma, a), scale(gamma, a1))))
        q1 = product(q, exponential(scale(h, add(w, scale(h, add(scale(0.5 - beta, a), scale(beta, a1)))))))
        if size <= ROUND_OFF or (last <= NEARLY and size >= last) or corrections == MOST_CORRECTIONS:
            return q1, w1, x, a1, corrections, size
        corrections += 1
        L1 = times(J, w1)
        defect = subtract(times(J, x), add(cross(L1, w1), torque(field, t + h, q1)))
        correction = apply(inverse(gyroscopic_tangent(J, gamma * h * share, w1, L1)), defect)
        x, last = subtract(x, correction), size
        size = dot(correction, correction) / (dot(x, x) + dot(w1, w1) * dot(w1, w1) + REST)


@kernel
def buss_step(h, t, J_inverse, field, q, L):
    """Return the state after Buss's step of order 3: one rotation, h w + h^2 w'/2 + h^3 (w''/6 + w x w'/12) in body axes.

    The momentum in the world is constant without a torque. His paper has no field: here the rate of the torque is a difference
    over 2 h/3, and the momentum gains Radau's quadrature of the torque, with the weights 1/4 at the start and 3/4 there.
    """
    w, T, part = times(J_inverse, L), torque(field, t, q), 2.0 / 3.0 * h
    dL = add(cross(L, w), T)
    dw = times(J_inverse, dL)
    ahead = exponential(scale(part, add(w, scale(0.5 * part, dw))))
    T_ahead = torque(field, t + part, product(q, ahead))
    ddw = times(J_inverse, add(add(cross(dL, w), cross(L, dw)), scale(1.0 / part, subtract(T_ahead, T))))
    third = add(scale(1.0 / 6.0, ddw), scale(1.0 / 12.0, cross(w, dw)))
    turned = exponential(scale(h, add(w, scale(h, add(scale(0.5, dw), scale(h, third))))))
    returned = in_body((ahead[0], -ahead[1], -ahead[2], -ahead[3]), T_ahead)
    return product(q, turned), in_body(turned, add(L, scale(0.25 * h, add(T, scale(3.0, returned)))))


@kernel
def spiers_step(rates_first, h, t, J_inverse, field, q, L):
    """Return the state after Spiers's step: a kick by the torque, then a rotation about L after one about w - s L.

    Every s gives the L' of Euler's equations. With k = w x L and s = k.(J^-1 k)/|k|^2, the energy's second derivative is 0, and
    the step is the exact motion of a body with two equal moments. L in the world is constant. With `rates_first`, L in the body
    is the same, but the body turns by h w with the rates w at the end.
    """
    L = add(L, scale(h, torque(field, t, q)))
    w = times(J_inverse, L)
    k = cross(w, L)
    square = dot(k, k)
    s = dot(k, times(J_inverse, k)) / square if square > 0.0 else 0.0  # along a principal axis any s gives the same step
    turned = exponential(scale(h, subtract(w, scale(s, L))))
    L1 = in_body(turned, L)
    if rates_first:
        return product(q, exponential(scale(h, times(J_inverse, L1)))), L1
    return product(product(q, exponential(scale(h * s, L))), turned), L1


@kernel
def march(model, coefficients, workspace):
    """Take the steps (`protocol`)."""
    J, J_inverse, field, q, L, _ = model
    scheme, weights, nodes, alpha, h = coefficients
    n_steps, every, pause, q_out, L_out = workspace
    slopes, w = np.empty((len(nodes), 6)), times(J_inverse, L)
    rate = times(J_inverse, add(cross(L, w), torque(field, 0.0, q)))
    record(0, q, L, q_out, L_out)
    a, row, corrections, until_sample, done, size = rate, 0, 0, every, 0, 0.0
    while done < n_steps:
        last = end_of_block(done, n_steps, pause)
        for step in range(done + 1, last + 1):
            t = (step - 1) * h
            if scheme <= CROUCH_GROSSMAN:
                q, L = runge_kutta_step(scheme == MUNTHE_KAAS, weights, nodes, h, t, J_inverse, field, q, L, slopes)
            elif scheme == GENERALIZED_ALPHA:
                q, w, rate, a, more, size = alpha_step(alpha, h, t, J, field, q, w, rate, a)
                L, corrections = times(J, w), corrections + more
                if not size <= NEARLY:
                    return Result(step - 1, step - 1, corrections, None, math.sqrt(size), False)
            elif scheme == BUSS:
                q, L = buss_step(h, t, J_inverse, field, q, L)
            elif scheme == GYROSCOPIC:  # as game engines do: first the rates, then the attitude with the new rates
                L = add(L, scale(h, add(cross(L, times(J_inverse, L)), torque(field, t, q))))
                q = product(q, exponential(scale(h, times(J_inverse, L))))
            else:
                q, L = spiers_step(scheme == SPIERS_RATES, h, t, J_inverse, field, q, L)
            until_sample -= 1
            if until_sample == 0 or step == n_steps:
                until_sample = every
                row += 1
                record(row, q, L, q_out, L_out)
        done = last
        if done < n_steps:
            call_handlers()
    return Result(n_steps, n_steps, corrections, None, math.sqrt(size), False)


MODEL_END, COEFFICIENTS_END, WORKSPACE_END = find_ends(Model, Coefficients)


@entry
def enter(*loose):
    """`march` as Python calls it (`protocol`)."""
    model, coefficients = Model(*loose[:MODEL_END]), Coefficients(*loose[MODEL_END:COEFFICIENTS_END])
    workspace = Workspace(*loose[COEFFICIENTS_END:WORKSPACE_END])
    return deliver(march(model, coefficients, workspace), workspace, Output(*loose[WORKSPACE_END:]))
