"""Every deliberately wrong method fails exactly the checks listed for it, and every right method passes all of them.

Each control is a generator of states (R_WB, L_B). The right one is the map of `Reduced`, by fixed-point iteration:

    w* = J^-1 (L0 + L1)/2     R1 = R0 Cay(dt w*)     L1 = Cay(dt w*)' (L0 + dt R0' tau*)
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between, cayley, from_quaternion, hat, orthonormality, rotation_about, to_quaternion
from conservative.potentials.potential import torque_W
from conservative.scenes.transforms import in_body_frame

SWEEPS, STAGNATION = 60, 1e-16
States = Iterator[tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Control(cv.Method):
    """A method made from a generator of states."""

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
        return cv.Bounds(np.inf, np.inf)  # the checks below decide

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
    """Return R0' tau*, in body axes at the start of the step."""
    if scene.free:
        return np.zeros(3)
    V_star = scene.potential.finite_derivative(R0, R1)
    return -R0.T @ np.cross((R0 + R1) / 2, V_star, axisa=0, axisb=0, axisc=0).sum(axis=1)


def torque_B(scene, R):
    return np.zeros(3) if scene.free else R.T @ torque_W(scene.potential, R)


def stepped(scene, dt, R, L, momentum, torque=finite_torque_B, mean=lambda R, turn, L, L1: (L + L1) / 2):
    """Return the state after a step of the right map with another momentum update or torque."""
    L1, turn = L, np.eye(3)
    for _ in range(SWEEPS):
        turn, last = cayley(dt * scene.body.inverse @ mean(R, turn, L, L1)), L1
        L1 = momentum(turn, L, dt * torque(scene, R, R @ turn))
        if np.abs(L1 - last).max() < STAGNATION * np.abs(L1).max():
            break
    return R @ turn, L1


def carried(turn, L, impulse):
    return turn.T @ (L + impulse)


def built_right(scene, dt, momentum=carried) -> States:
    R, L = start(scene)
    while True:
        yield R, L
        R, L = stepped(scene, dt, R, L, momentum)


def no_gyroscopic_term(scene, dt) -> States:
    """Leave the momentum as it is in the body."""
    return built_right(scene, dt, lambda turn, L, impulse: L + impulse)


def wrong_coriolis_sign(scene, dt) -> States:
    """Turn the momentum the other way."""
    return built_right(scene, dt, lambda turn, L, impulse: turn @ (L + impulse))


def explicit(scene, dt, R, L):
    """Return the state after a step of the explicit midpoint rule for L and a turn by its middle rate."""
    inverse = scene.body.inverse
    middle = L + dt / 2 * (np.cross(L, inverse @ L) + torque_B(scene, R))
    half_way = R @ cayley(dt / 2 * inverse @ L)
    return R @ cayley(dt * inverse @ middle), L + dt * (np.cross(middle, inverse @ middle) + torque_B(scene, half_way))


def clamped_momentum(scene, dt) -> States:
    """Take an explicit step, then set |L| back to its initial value."""
    R, L = start(scene)
    size = np.linalg.norm(L)
    while True:
        yield R, L
        R, L = explicit(scene, dt, R, L)
        L = L * (size / np.linalg.norm(L))


def projected_energy(scene, dt) -> States:
    """Take an explicit step, then scale L so that the energy has its initial value."""
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
    """Update the momentum correctly, but the quaternion by explicit Euler without normalisation."""
    q = to_quaternion(scene.R_WB0)
    for _, L in built_right(scene, dt):
        yield from_quaternion(q), L
        w = scene.body.inverse @ L
        rate = np.concatenate([[-q[1:] @ w], q[0] * w + np.cross(q[1:], w)]) / 2
        q = q + dt * rate


def late_torque(scene, dt) -> States:
    """Apply the impulse of each step in the next one."""
    R, L = start(scene)
    impulse = dt * torque_B(scene, R)
    while True:
        yield R, L
        before, last = R, impulse
        R, L = stepped(scene, dt, R, L, carried, lambda *_, last=last: last / dt)
        impulse = dt * finite_torque_B(scene, before, R)


def product_of_means(scene, dt) -> States:
    """Take the mean momentum as G(qbar) pbar instead of the mean of G(q) p, in three unknowns."""

    def mean(R, turn, L, L1):
        # p = 1/2 Q hat(L) gives G(q) p = -L. For the means it is half the skew part of the product of both matrices.
        P = (R + R @ turn).T / 2 @ (R @ hat(L) + R @ turn @ hat(L1)) / 4
        return np.array([P[2, 1] - P[1, 2], P[0, 2] - P[2, 0], P[1, 0] - P[0, 1]])

    R, L = start(scene)
    while True:
        yield R, L
        R, L = stepped(scene, dt, R, L, carried, mean=mean)


STATES = json.loads((Path(__file__).parents[1] / "data" / "reference_states.json").read_text())["cases"]
ROUND_OFF = 1e-11
SCENES = {"free": cv.scenes.brick_flip(disturbance=0.7), "top": cv.scenes.asymmetric_top()}
DT = {"free": 0.02, "top": 0.05}
STEPS = 60
RIGHT = (
    cv.Reduced(),
    cv.Reduced(4),
    cv.Convected(tol=1e-13),
    cv.Gauss(4),
    Control(built_right),
)


@cache
def run(method, kind):
    return cv.integrate(SCENES[kind], DT[kind], method, t_end=STEPS * DT[kind])


def drift(method, kind, name):
    trajectory = run(method, kind)
    invariant = next(each for each in trajectory.scene.invariants if each.name == name)
    value = invariant.evaluate(trajectory.R_WB, trajectory.w_WB_B)
    return np.abs(value - value[0]).max() / invariant.scale


def order(method, kind):
    """Return the order observed after 1 s (free) or 10 s (top), or the claimed order if errors are round-off."""
    case, scene = {
        "free": ("brick_flip", cv.scenes.brick_flip()),
        "top": ("asymmetric_heavy_top", cv.scenes.asymmetric_top()),
    }[kind]
    state = STATES[case]["states"][0]
    truth = from_quaternion(np.array([float(number) for number in state["q"]]))
    end = float(state["t"])
    errors = [angle_between(truth, cv.integrate(scene, end / n, method, t_end=end).R_WB[-1]) for n in (100, 200)]
    return np.log2(errors[0] / errors[1]) if errors[1] > ROUND_OFF else method.order


def reversal(method, kind):
    """Return the angle to the initial attitude after a run forth and back, rad."""
    forth = run(method, kind)
    u, _, v = np.linalg.svd(forth.R_WB[-1])  # the nearest rotation: a wrong method may have lost orthonormality
    back = forth.scene.rename("back", R_WB0=u @ v, w_WB_B0=-forth.w_WB_B[-1])
    return angle_between(forth.R_WB[0], cv.integrate(back, DT[kind], method, t_end=STEPS * DT[kind]).R_WB[-1])


CHECKS = {
    "energy": lambda m: all(drift(m, kind, "energy") < ROUND_OFF for kind in SCENES),
    "momentum": lambda m: drift(m, "free", "momentum") < ROUND_OFF,
    "vertical momentum": lambda m: drift(m, "top", "vertical momentum") < ROUND_OFF,
    "orthonormality": lambda m: all(orthonormality(run(m, kind).R_WB).max() < ROUND_OFF for kind in SCENES),
    "order, free": lambda m: order(m, "free") > m.order - 0.1,
    "order, top": lambda m: order(m, "top") > m.order - 0.1,
    "reversal": lambda m: all(reversal(m, kind) < ROUND_OFF for kind in SCENES),
}

CAUGHT_BY = {
    no_gyroscopic_term: {"momentum", "vertical momentum", "order, free", "order, top", "reversal"},
    wrong_coriolis_sign: {"momentum", "vertical momentum", "order, free", "order, top", "reversal"},
    clamped_momentum: {"energy", "momentum", "vertical momentum", "order, top", "reversal"},
    projected_energy: {"momentum", "vertical momentum", "reversal"},
    drifting_quaternion: set(CHECKS),
    late_torque: {"energy", "vertical momentum", "order, top", "reversal"},
    product_of_means: {"energy"},
}
"""Checks that each wrong method fails. Every check catches a fault."""


def list_failed(method):
    return {name for name, passes in CHECKS.items() if not passes(method)}


@pytest.mark.parametrize("states", CAUGHT_BY, ids=lambda states: states.__name__)
def test_a_wrong_method_is_caught(states):
    assert list_failed(Control(states)) == CAUGHT_BY[states]


@pytest.mark.parametrize("method", RIGHT, ids=lambda method: method.name)
def test_a_right_method_passes_every_check(method):
    assert list_failed(method) == set()


def test_the_control_built_right_is_the_map_of_reduced():
    for kind, scene in SCENES.items():
        scene = in_body_frame(scene, rotation_about((1, 2, 3), 0.7), "turned")
        ours, plain = (
            cv.integrate(scene, DT[kind], method, t_end=STEPS * DT[kind]) for method in (cv.Reduced(), Control(built_right))
        )
        assert angle_between(ours.R_WB, plain.R_WB).max() < 1e-12  # measured 2e-15
