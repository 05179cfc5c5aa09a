"""Methods built wrong on purpose, in plain NumPy, and one built right: `test_negative_controls.py` tries its checks on them.

Each is a generator of states (R_WB, L_B), one a step. The right one is the map of `Reduced`, solved by fixed-point iteration:

    w* = J^-1 (L0 + L1)/2     R1 = R0 Cay(dt w*)     L1 = Cay(dt w*)' (L0 + dt R0' tau*)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import conservative as cv
from conservative.attitude import cayley, from_quaternion, hat, to_quaternion
from conservative.potentials.potential import torque_W

SWEEPS, STAGNATION = 60, 1e-16
States = Iterator[tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Control(cv.Method):
    """A method from a generator of states."""

    states: Callable[[cv.Scene, float], States]

    family: ClassVar[str] = "control"
    role: ClassVar[str] = "ours"

    @property
    def name(self):
        return self.states.__name__

    @property
    def order(self):
        return 2

    def bounds(self, scene, grid):
        return cv.Bounds(np.inf, np.inf)  # what is wrong with it is for the checks to say

    def prepare(self, scene, grid):
        def run():
            states = self.states(scene, grid.dt)
            R, L = (np.array(part) for part in zip(*(next(states) for _ in range(grid.n_steps + 1)), strict=True))
            keep = grid.steps.astype(int)
            return cv.Trajectory(scene, grid.t, R[keep], L[keep] @ scene.body.inverse, self.label)

        return run


def start(scene):
    return scene.R_WB0, scene.body.momentum(scene.w_WB_B0)


def finite_torque_B(scene, R0, R1):
    """R0' tau*, in body axes of the start of the step."""
    if scene.free:
        return np.zeros(3)
    V_star = scene.potential.finite_derivative(R0, R1)
    return -R0.T @ np.cross((R0 + R1) / 2, V_star, axisa=0, axisb=0, axisc=0).sum(axis=1)


def torque_B(scene, R):
    return np.zeros(3) if scene.free else R.T @ torque_W(scene.potential, R)


def stepped(scene, dt, R, L, momentum, torque=finite_torque_B):
    """One step of the right map but for what `momentum(turn, L, impulse)` and `torque` make of it."""
    L1 = L
    for _ in range(SWEEPS):
        turn, last = cayley(dt * scene.body.inverse @ (L + L1) / 2), L1
        L1 = momentum(turn, L, dt * torque(scene, R, R @ turn))
        if np.abs(L1 - last).max() < STAGNATION * np.abs(L1).max():
            break
    return R @ turn, L1


def carried(turn, L, impulse):
    return turn.T @ (L + impulse)


def built_right(scene, dt) -> States:
    """The control of the controls."""
    R, L = start(scene)
    while True:
        yield R, L
        R, L = stepped(scene, dt, R, L, carried)


def no_gyroscopic_term(scene, dt) -> States:
    """The momentum stays as it is in the body."""
    R, L = start(scene)
    while True:
        yield R, L
        R, L = stepped(scene, dt, R, L, lambda turn, L, impulse: L + impulse)


def wrong_coriolis_sign(scene, dt) -> States:
    """The momentum is turned the other way."""
    R, L = start(scene)
    while True:
        yield R, L
        R, L = stepped(scene, dt, R, L, lambda turn, L, impulse: turn @ (L + impulse))


def explicit(scene, dt, R, L):
    """One step of the explicit midpoint rule for L and a turn by its middle rate."""
    inverse = scene.body.inverse
    middle = L + dt / 2 * (np.cross(L, inverse @ L) + torque_B(scene, R))
    half_way = R @ cayley(dt / 2 * inverse @ L)
    return R @ cayley(dt * inverse @ middle), L + dt * (np.cross(middle, inverse @ middle) + torque_B(scene, half_way))


def clamped_momentum(scene, dt) -> States:
    """An explicit step, then |L| set back to what it was at the start."""
    R, L = start(scene)
    size = np.linalg.norm(L)
    while True:
        yield R, L
        R, L = explicit(scene, dt, R, L)
        L = L * (size / np.linalg.norm(L))


def projected_energy(scene, dt) -> States:
    """An explicit step, then L scaled so that the energy is what it was at the start."""
    R, L = start(scene)
    inverse = scene.body.inverse

    def potential(R):
        return 0.0 if scene.free else scene.potential.energy(R)

    energy = L @ inverse @ L / 2 + potential(R)
    while True:
        yield R, L
        R, L = explicit(scene, dt, R, L)
        L = L * np.sqrt(max(energy - potential(R), 0.0) / (L @ inverse @ L / 2))


def drifting_quaternion(scene, dt) -> States:
    """The right momentum, but the quaternion by explicit Euler and never normalised; its drift shows as lost orthonormality."""
    q = to_quaternion(scene.R_WB0)
    for _, L in built_right(scene, dt):
        yield from_quaternion(q), L
        w = scene.body.inverse @ L
        rate = np.concatenate([[-q[1:] @ w], q[0] * w + np.cross(q[1:], w)]) / 2
        q = q + dt * rate


def late_torque(scene, dt) -> States:
    """The impulse of each step acts in the next one."""
    R, L = start(scene)
    impulse = dt * torque_B(scene, R)
    while True:
        yield R, L
        before, last = R, impulse
        R, L = stepped(scene, dt, R, L, carried, lambda *_, last=last: last / dt)
        impulse = dt * finite_torque_B(scene, before, R)


def product_of_means(scene, dt) -> States:
    """The mean momentum taken as G(qbar) pbar instead of the mean of G(q) p, in three unknowns."""
    R, L = start(scene)
    while True:
        yield R, L
        R, L = _with_product_of_means(scene, dt, R, L)


def _with_product_of_means(scene, dt, R, L):
    # p = 1/2 Q hat(L) gives G(q) p = -L; of the means it is half the skew part of the product of both matrices.
    L1, turn = L, np.eye(3)
    for _ in range(SWEEPS):
        P = (R @ hat(L) + R @ turn @ hat(L1)) / 4
        product = (R + R @ turn).T / 2 @ P
        mean = np.array([product[2, 1] - product[1, 2], product[0, 2] - product[2, 0], product[1, 0] - product[0, 1]])
        turn, last = cayley(dt * scene.body.inverse @ mean), L1
        L1 = carried(turn, L, dt * finite_torque_B(scene, R, R @ turn))
        if np.abs(L1 - last).max() < STAGNATION * np.abs(L1).max():
            break
    return R @ turn, L1


WRONG = (
    no_gyroscopic_term,
    wrong_coriolis_sign,
    clamped_momentum,
    projected_energy,
    drifting_quaternion,
    late_torque,
    product_of_means,
)
