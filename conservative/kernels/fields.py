"""Fields in compiled code: named tuples of numbers in principal axes, whose functions are traced for each type of field.

`conservative.potentials.field` says which functions a field has. A kernel is compiled once per type; for `None`, the free body,
no torque is compiled. Newton's method relies on the derivatives that fields return: it expects quadratic convergence.
"""

from __future__ import annotations

import numpy as np

from . import small
from .compiler.lanes import load_rows, save_rows
from .compiler.traced import trace
from .compiler.vector import accumulate, add, dot, subtract


@trace
def finite_torque(field, q, a):
    """Return T = Q0' tau* in N m and its derivative by a (three columns).

    tau* = sum_j qbar_j x (-V*_j) is the torque of the finite derivative over the step from the attitude Q0 of the quaternion q
    to Q0 Cay(2 a) (method of the paper, 23 and 27b, in three unknowns).
    """
    return field.finite_torque(q, a)


@small
def whole(rotor, L):
    """Return the momentum L of a body plus the momentum of its rotor, which is None without one."""
    return L if rotor is None else add(L, rotor)


@small
def own(rotor, L):
    """Return the momentum L of a body minus the momentum of its rotor, which is None without one."""
    return L if rotor is None else subtract(L, rotor)


@trace
def energy(field, q):
    """Return V in J at the attitude of the quaternion q, whose length does not matter."""
    return field.energy(q)


@trace
def body_torque(field, q):
    """Return the torque in N m, principal axes, at the attitude of the quaternion q, whose length does not matter."""
    return field.body_torque(q)


@trace
def torque(field, q, w):
    """Return the torque of field and loads in N m at rates w, rad/s."""
    T = field.body_torque(q)
    return add(T, field.load(q, w)) if hasattr(field, "load") else T


@trace
def at_step(field, t, h):
    """Return the field as it is for a step of length h from t, both s."""
    return field.at_step(t, h) if hasattr(field, "at_step") else field


@trace
def rotor_at(field, rotor, t):
    """Return the momentum of the rotor at a time t, s: `rotor`, or the momentum of the field's motor."""
    return field.wheel(t) if hasattr(field, "wheel") and field.motor else rotor


@trace
def step_rotor(field, rotor, t, h):
    """Return the momentum of the rotor during a step of length h from t, s, the mean of its ends, and half of its change.

    The latter is () without a motor. With the mean r, L + r0 - r and L + r1 - r take the places of L at both ends.
    """
    if not (hasattr(field, "wheel") and field.motor):
        return rotor, ()
    r0, r1 = field.wheel(t), field.wheel(t + h)
    return tuple(0.5 * (a + b) for a, b in zip(r0, r1, strict=True)), tuple(0.5 * (b - a) for a, b in zip(r0, r1, strict=True))


@trace
def react(L, carry, half):
    """Return the momentum L, a compensated sum, after the reaction of a motor in half a step; unchanged without one."""
    if not half:
        return L, carry
    pairs = [accumulate(a, c, -b) for a, c, b in zip(L, carry, half, strict=True)]
    return tuple(x for x, _ in pairs), tuple(c for _, c in pairs)


@trace
def body_momentum(field, whole_momentum, t):
    """Return the momentum minus the momentum of a rotor with a motor at a time t, s; unchanged without one."""
    if not (hasattr(field, "wheel") and field.motor):
        return whole_momentum
    return subtract(whole_momentum, field.wheel(t))


@trace
def with_motor(field, L, t):
    """Return the momentum plus the momentum of a rotor with a motor at a time t, s; unchanged without one."""
    return add(L, field.wheel(t)) if hasattr(field, "wheel") and field.motor else L


@trace
def no_supply(field):
    """Return the sums of work and impulse of the loads (4), and their rounding errors (4), as zeros; () without loads."""
    return (0.0,) * 8 if hasattr(field, "load") else ()


@trace
def supply(field, h, q, a, supplied):
    """Return the sums `supplied` with work and impulse of a step from the quaternion q."""
    return add_supply(supplied, 1.0, field.supply(h, q, a)) if supplied else supplied


@trace
def supply_rate(field, q, w):
    """Return power, W, and torque, N m, world axes, of the loads at rates w, rad/s; () without loads."""
    return field.supply_rate(q, w) if hasattr(field, "load") else ()


@trace
def add_supply(supplied, factor, gained):
    """Return compensated sums with `factor` times work and impulse `gained`."""
    pairs = [accumulate(a, c, factor * b) for a, c, b in zip(supplied[:4], supplied[4:], gained, strict=False)]
    return (*(total for total, _ in pairs), *(carry for _, carry in pairs))


@trace
def shift_invariants(kept, axis, turn, supplied):
    """Return energy, J, or Jacobi integral, and momentum about the axis, kg m^2/s, with what the loads supplied."""
    if not supplied:
        return kept
    impulse = supplied[1:4]
    gained = supplied[0] if turn is None else supplied[0] - dot(turn, impulse)
    return kept[0] + gained, kept[1] if axis is None else kept[1] + dot(axis, impulse)


@trace
def at_time(field, t):
    """Return the field as it is at a time t, s."""
    return field.at_time(t) if hasattr(field, "at_time") else field


@trace
def _finite_derivative(field, q0, q1):
    """Return V*, column by column, and its derivative by q1, row by row: as c d' and D B, or as the field returns them."""
    q0, q1 = (q0[:3], q0[3:6], q0[6:]), (q1[:3], q1[3:6], q1[6:])
    if hasattr(field, "all_finite_derivatives"):
        return field.all_finite_derivatives(q0, q1)
    (c, d), (D, B) = field.finite_derivative(q0, q1), field.finite_slope(q0, q1)
    V_star = tuple(x * y for y in d for x in c)
    return V_star, tuple(D[j][k] * B[i][m] for j in range(3) for i in range(3) for k in range(3) for m in range(3))


@small
def finite_derivative(field, q0, q1):
    """Return V* (9,) in J between base vectors q0 and q1 (9,), and its derivative by q1 (9, 9)."""
    V_star, dV_star = np.empty(9), np.empty(81)
    derivatives = _finite_derivative(field, load_rows(q0, 0, 1, 9, 1), load_rows(q1, 0, 1, 9, 1))
    save_rows(V_star, 0, 1, derivatives[0])
    save_rows(dV_star, 0, 1, derivatives[1])
    return V_star, dV_star.reshape(9, 9)
