"""Attitudes: they are not the integral of rates that are right. A rule of low order made them, or they drift."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from conservative.attitude import Array, from_quaternion, hat, to_quaternion

from .mistake import Mistake, Number

Effect = Callable[[Array, Array, Array], Array]
"""From rates (n, 3) at the start and the end of steps, rad/s, body axes, and their lengths (n,), s, to matrices.

Matrices (n, 4, 4) act on quaternions, and (n, 3, 3) multiply rotation matrices.
"""


@dataclass(frozen=True)
class Rule(Mistake):
    """A rule that integrates attitudes from rates. With `world` its rates in body axes are taken for rates in world axes."""

    kind: ClassVar[str] = "attitudes"
    matrices: Effect
    world: bool = False


@dataclass(frozen=True)
class Drift(Mistake):
    """Attitudes that turn away from the right ones at a constant rate, beginning at the start.

    `about` says in which axes the rate is constant: those of the body, those of the world, or those of the rates, to which it
    is added. With an `axis` the only number is the rate about it.
    """

    kind: ClassVar[str] = "attitudes"
    about: str
    axis: tuple[float, float, float] | None = None

    def rate(self, numbers: Array) -> Array:
        """Return the rate (3,), rad/s, for numbers."""
        return np.asarray(numbers, float) if self.axis is None else numbers[0] * np.array(self.axis)


BODY, WORLD, BIASED = "body", "world", "rates"
"""Axes in which the rate of a drift is constant."""


def _linear(w: Array, h: Array) -> Array:
    """Return the matrices (n, 4, 4) of q + h/2 q w."""
    x, y, z = (w * h[:, None] / 2).T
    ones = np.ones_like(x)
    rows = (ones, -x, -y, -z), (x, ones, z, -y), (y, -z, ones, x), (z, y, -x, ones)
    return np.stack([np.stack(row, -1) for row in rows], 1)


def _exponential(w: Array, h: Array) -> Array:
    """Return the matrices (n, 4, 4) of the exponential map."""
    angle = np.linalg.norm(w, axis=1) * h
    size = np.sinc(angle / (2 * np.pi))
    return _linear(w * size[:, None], h) - (1 - np.cos(angle / 2))[:, None, None] * np.eye(4)


def _other_side(M: Array) -> Array:
    """Return the matrices that multiply from the left instead of the right: the vector part's block is transposed."""
    out = M.copy()
    out[:, 1:, 1:] = np.swapaxes(M[:, 1:, 1:], 1, 2)
    return out


def _in_place(w: Array, h: Array) -> Array:
    """Return the matrices of the first-order step, whose components are updated one after another, from new ones."""
    increments, out = _linear(w, h) - np.eye(4), np.broadcast_to(np.eye(4), (len(h), 4, 4)).copy()
    for row in range(4):
        out[:, row] += (increments[:, row : row + 1] @ out)[:, 0]
    return out


def _atan(w: Array, h: Array) -> Array:
    """Return the matrices (n, 4, 4) of a rotation by the arc tangent of the angle, to which R + h R [w] is repaired."""
    angle = np.linalg.norm(w, axis=1) * h
    return _exponential(w * (np.arctan(angle) / np.where(angle == 0, 1.0, angle))[:, None], h)


UPDATES: dict[str, tuple[str, Callable[[Array, Array], Array]]] = {
    "attitude by normalisation": ("the first-order step q + h/2 q w, normalised,", _linear),
    "attitude by rotation": ("a rotation", _exponential),
    "attitude in place": (
        "the first-order step of the quaternion, whose components are updated in place, one after another,",
        _in_place,
    ),
    "attitude not repaired": (
        "the first-order step R + h R [w], whose loss of orthonormality is not repaired,",
        lambda w, h: np.eye(3) + hat(w * h[:, None]),
    ),
    "attitude made orthonormal": ("the first-order step R + h R [w], made orthonormal,", _atan),
}
RATES: dict[str, tuple[str, Callable[[Array, Array], Array]]] = {
    "old rates": ("by the rates of the start of the step (coning error)", lambda a, b: a),
    "new rates": ("by the rates of the end of the step", lambda a, b: b),
    "mean rates": ("by the mean of the rates of both ends (coning error)", lambda a, b: (a + b) / 2),
}
SHORT = {"attitude by rotation, old rates": "stale rates", "attitude by normalisation, new rates": "attitude by normalisation"}
"""Keys that differ from update and rates."""
IN_WORLD = ("attitude by normalisation", "attitude by rotation")
"""Updates that programs also apply to the wrong side: with rates in body axes as if they were in world axes."""


def _rule(update: str, rates: str, world: bool) -> Rule:
    (how, matrices), (which, choose) = UPDATES[update], RATES[rates]
    key = f"{update}, {rates}"
    key = SHORT.get(key, key) + " on the wrong side" * world
    what = f"{how} {which}" + ", which are in body axes, as if they were in world axes" * world
    text = f"The rates are right, but the attitudes are not their integral: they follow {what}, with a step of {{step:.4g}} s"

    def effect(a: Array, b: Array, h: Array) -> Array:
        made = matrices(choose(a, b), h)
        return _other_side(made) if world else made

    remedy = "turn by the exponential map, by the mean of the rates of both ends"
    if world:
        remedy = "q' = q w / 2 with rates in body axes"
    return Rule(key, text, effect, world, numbers=(Number("step", unit="s"),), remedy=remedy)


RULES = tuple(
    _rule(update, rates, world) for update in UPDATES for rates in RATES for world in (False, True)[: 1 + (update in IN_WORLD)]
)


_DRIFT = tuple(Number(f"drift_{i}", unit="rad/s") for i in (1, 2, 3))
_AT = "({drift_1:.4g}, {drift_2:.4g}, {drift_3:.4g}) rad/s"
DRIFTS = (
    Drift(
        "heading drift",
        "The rates are right, but the attitudes drift about the vertical axis by {drift:.4g} rad/s",
        WORLD,
        (0.0, 0.0, 1.0),
        numbers=(Number("drift", unit="rad/s"),),
    ),
    Drift(
        "drift in body axes",
        f"The rates are right, but the attitudes turn away from them by {_AT} about an axis of the body",
        BODY,
        numbers=_DRIFT,
    ),
    Drift(
        "drift in world axes",
        f"The rates are right, but the attitudes turn away from them by {_AT} about an axis of the world",
        WORLD,
        numbers=_DRIFT,
    ),
    Drift(
        "drift of a bias",
        f"The rates are right, but the attitudes are the integral of rates with a bias of {_AT}",
        BIASED,
        numbers=_DRIFT,
    ),
)


def integrate(rule: Effect, R0: Array, w: Array, h: Array, parts: int) -> Array:
    """Return attitudes (n, 3, 3) by a rule from the first, at every `parts`-th of the rates w (m, 3), rad/s, steps h, s."""
    matrices = rule(w[:-1], w[1:], h)
    if matrices.shape[1] == 3:  # rotation matrices are repaired only when they are compared
        products = [R0]
        for matrix in matrices:
            products.append(products[-1] @ matrix)
        U, _, V = np.linalg.svd(np.array(products[::parts]))
        return U @ V
    q, kept = to_quaternion(R0), []
    for number, matrix in enumerate(matrices):
        if number % parts == 0:
            kept.append(q)
        q = matrix @ q
        q = q / np.sqrt(q @ q)
    return from_quaternion(np.array([*kept, q]))


def align(R: Array, to: Array, right: bool) -> Array:
    """Return attitudes (n, 3, 3) with the constant rotation in the world, or in the body (`right`), that fits others best."""
    U, _, V = np.linalg.svd((np.swapaxes(R, 1, 2) @ to if right else to @ np.swapaxes(R, 1, 2)).sum(axis=0))
    return R @ (U @ V) if right else (U @ V) @ R
