"""Conformance test of a program: the conventions of PROTOCOL.md on a free and a heavy body, repeatability, and honest times.

If the samples are not those of the motion, combinations of known mistakes are tried, and the one that explains the samples best
is named. A combination has to explain them ten times better for each of its mistakes. The short run tells a constant delay from
the error of a method of order 1, which is small after a few steps.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import lru_cache
from itertools import product
from time import perf_counter
from typing import Any

import numpy as np

from conservative import registry
from conservative.attitude import Array, angle_between, from_quaternion, rotation_about, to_quaternion
from conservative.body import RigidBody
from conservative.errors import IntegrationFailed
from conservative.grid import Grid
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.programs import Program
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..engine import mass_model, principal_axes
from ..samples import States, to_body_axes
from ..worker.client import Worker
from .environment import worker_of
from .plain_numbers import describe, read_states
from .programs import program_class

WEIGHT, COM = 3.1, (0.3, -0.2, 0.5)
FREE = Scene("free body", RigidBody((2.1, 3.3, 4.2)), rotation_about((1, -1, 0.3), 1.1), (0.9, -1.1, 0.7), 1.0)
HEAVY = replace(FREE, name="heavy body", potential=UniformGravity(WEIGHT, COM))
SHORT = Grid(0.005, 4)
GRIDS = (SHORT, *(Grid(0.01 / part, 100 * part, 10 * part) for part in (1, 2, 4)))
FLOOR = 1e-6
"""Smaller errors are not compared: they may be those of single precision."""
PACE = 0.2
"""Wall time of the calls in a measurement, s."""

READING: dict[str, Callable[[Scene], dict[str, Any]]] = {
    "": lambda scene: {},
    "It reads `q0` as x, y, z, w: the scalar comes first": lambda scene: {
        "R_WB0": from_quaternion(np.roll(to_quaternion(scene.R_WB0), 1))
    },
    "It reads the initial attitude transposed: v_W = R0 v_F": lambda scene: {"R_WB0": scene.R_WB0.T},
    "It reads `w0` in world axes: `w0` is in F": lambda scene: {"w_WB_B0": scene.R_WB0.T @ scene.w_WB_B0},
    "It reads `w0_W` in body axes: `w0_W` is in W": lambda scene: {"w_WB_B0": scene.R_WB0 @ scene.w_WB_B0},
    "It reads rates in deg/s: they are in rad/s": lambda scene: {"w_WB_B0": np.deg2rad(scene.w_WB_B0)},
    "Its inertia is inverted: J w' = (J w) x w with J = `moments`": lambda scene: {"body": RigidBody(1 / scene.body.moments)},
    "It has no gyroscopic torque: J w' = (J w) x w of a free body": lambda scene: {"body": RigidBody((3, 3, 3))},
    "Gravity points up: it is along minus the third axis of W": lambda scene: {
        "potential": scene.potential and UniformGravity(WEIGHT, np.negative(COM))
    },
    'It ignores gravity: use it, or answer "unsupported" if `free` is false': lambda scene: {"potential": None},
    "Its inertia is about the centre of mass: `moments` are about the fixed point": lambda scene: {
        "body": RigidBody(mass_model(principal_axes(scene)).body.moments)  # type: ignore[union-attr]
    },
}
ATTITUDES: dict[str, Callable[[Array], Array]] = {
    "": lambda values: values,
    "`q` is x, y, z, w: the scalar comes first": lambda values: np.concatenate(
        [np.roll(values[..., :4], 1, -1), values[..., 4:]], -1
    ),
    "The attitudes are transposed: v_W = R v_F": lambda values: (
        values * (1, -1, -1, -1, 1, 1, 1) if values.shape[-1] == 7 else values[..., [0, 3, 6, 1, 4, 7, 2, 5, 8, 9, 10, 11]]
    ),
}
RATES = {"": 1.0, "Rates are in deg/s: answer in rad/s": math.pi / 180}
AXES = {"": False, "Rates in W are named `w`, or rates in F `w_W`: `w` is in F": True}
TIMES: dict[str, tuple[float, int, int]] = {
    "": (1, 0, 0),
    "Samples are half a step late: answer the state after `steps` steps": (1, -1, -1),
    "Samples are half a step early: answer the state after `steps` steps": (1, 1, 1),
    "Samples are one step late: answer the state after `steps` steps": (1, -2, -2),
    "Samples are one step early: answer the state after `steps` steps": (1, 2, 2),
    "Rates are half a step late: answer both at the time of the attitude": (1, 0, -1),
    "Rates are half a step early: answer both at the time of the attitude": (1, 0, 1),
    "It reads `dt` in ms: it is in s": (1e-3, 0, 0),
}
"""Unit of dt, and how much later attitudes and rates are, in half steps."""


@lru_cache(maxsize=256)
def _motion(scene: Scene, dt: float, n_steps: int) -> Trajectory:
    return registry.method("taylor").solve(scene, Grid(dt, n_steps))


def _distance(scene: Scene, grid: Grid, seen: tuple[Array, Array], unit: float = 1, late_R: int = 0, late_w: int = 0) -> float:
    """Return the largest error of attitude, rad, or of rates, relative, without the first sample."""
    truth = _motion(scene, unit * grid.dt / 2, 2 * grid.n_steps + 2)
    place = 2 * grid.steps[1:].astype(int)
    angles = angle_between(truth.R_WB[place + late_R], seen[0][1:])
    rates = np.linalg.norm(truth.w_WB_B[place + late_w] - seen[1][1:], axis=-1) / np.linalg.norm(FREE.w_WB_B0)
    worst = float(np.max([angles, rates]))
    return worst if math.isfinite(worst) else math.inf


def _read(states: States, attitude: str = "", rates: str = "", axes: str = "") -> tuple[Array, Array]:
    """Return attitudes and rates in body axes, without the named mistakes."""
    values = ATTITUDES[attitude](states.values)
    values = np.concatenate([values[..., :-3], RATES[rates] * values[..., -3:]], -1)
    corrected = replace(states, values=values, rates_in_world=states.rates_in_world != AXES[axes])
    R_WB, w_WB_B, _ = to_body_axes(np.empty(values.shape[1]), corrected, np.eye(3)[None])
    return R_WB[0], w_WB_B[0]


def find_mistakes(scene: Scene, answers: dict[Grid, States]) -> tuple[str, ...]:
    """Return the mistakes that explain the samples of the short and of the last run; () if nothing does better than none."""
    seen = {
        names: [(grid, _read(answers[grid], *names)) for grid in (SHORT, GRIDS[-1])]
        for names in product(ATTITUDES, RATES, AXES)
    }
    best, found = math.inf, ()
    scenes = {reading: replace(scene, **change(scene)) for reading, change in READING.items()}
    for reading, when, names in product(READING, TIMES, seen):
        mistakes = tuple(filter(None, (reading, *names, when)))
        cost = 10.0 ** len(mistakes)
        for grid, samples in seen[names]:
            cost *= max(FLOOR, _distance(scenes[reading], grid, samples, *TIMES[when]))
        if cost < best:
            best, found = cost, mistakes
    return found


def check(program: Program) -> Iterator[tuple[bool, str]]:
    """Yield whether each part of the test was passed, and its result as a sentence.

    Raises
    ------
    UnusableProgram
        The program does not start, or does not speak the protocol.
    EngineCrashed, EngineTimeout
        It failed in a measurement of its time.
    """
    method = program_class(program)()
    worker, run = worker_of(method.environment), 0
    yield True, f"hello: {method.maker}"
    for scene in (FREE, HEAVY):
        axes, answers = principal_axes(scene), dict[Grid, States]()
        try:
            for grid in GRIDS:
                run = worker.ask("prepare", adapter="", settings=method.settings, **describe(axes, grid))["run"]
                answers[grid] = read_states(worker.ask("run", run=run), (grid.n_samples,))
            again = read_states(worker.ask("run", run=run), (grid.n_samples,))
        except NotImplementedError as error:
            yield scene is HEAVY, f"{scene.name}: unsupported ({error})"
            if scene is FREE:
                return
            break
        except IntegrationFailed as failure:
            yield False, f"{scene.name}: {failure.outcome}"
            return
        errors = [_distance(scene, grid, _read(answers[grid])) for grid in GRIDS]
        if mistakes := find_mistakes(scene, answers) if errors[-1] > FLOOR else ():
            yield from ((False, f"{scene.name}: {mistake}") for mistake in mistakes)
            return
        right = errors[-1] < 100 * FLOOR or (errors[1] > 2 * errors[-1] and errors[-1] < 0.5)
        text = f"{scene.name}: error {errors[1]:.1e} at dt = {GRIDS[1].dt} s, {errors[-1]:.1e} at {grid.dt} s"
        yield right, text if right else f"{text}: it does not fall with dt, and no known mistake explains it"
        if not right:
            return
        same = np.array_equal(again.values, answers[grid].values)
        yield same, f"{scene.name}: a second run has {'the same' if same else 'other samples: start from `q0` and `w0`'}"
    yield _check_time(worker, run)


def _check_time(worker: Worker, run: int) -> tuple[bool, str]:
    calls, wall, seconds = 1, 0.0, 0.0
    while wall < PACE and calls < 1e6:
        calls, start = 4 * calls, perf_counter()
        seconds = float(worker.ask("time", run=run, calls=calls)["seconds"])
        wall = perf_counter() - start
    text = f"time: {seconds:.2g} s for {calls} calls, within {wall:.2g} s"
    if wall < PACE:
        return False, f"{text}: `time` has to make `calls` runs"
    if seconds < 0.5 * wall:
        return False, f"{text}: `seconds` is the wall time of all calls together"
    return seconds <= wall, text if seconds <= wall else f"{text}: `seconds` is in s, and only of the calls"
