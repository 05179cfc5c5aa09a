"""Conformance test of a program: the conventions of PROTOCOL.md on a free and a heavy body, repeatability, and honest times.

The mistakes that explain the samples best are named. The short run tells a constant delay from an error of order 1.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
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
from conservative.references.engine import principal_axes
from conservative.references.environments.environment import worker_of
from conservative.references.environments.plain_numbers import describe, read_states
from conservative.references.environments.programs import UnusableProgram, program_class
from conservative.references.samples import States, to_body_axes
from conservative.references.worker.client import EndlessAnswer, EngineTimeout, Worker, time_limit
from conservative.references.worker.program import WARM_UP
from conservative.scene import Scene

J, R0, W0 = np.array((2.1, 3.3, 4.2)), rotation_about((1, -1, 0.3), 1.1), np.array((0.9, -1.1, 0.7))
WEIGHT, COM = 3.1, np.array((0.3, -0.2, 0.5))
FREE = Scene("free body", RigidBody(J), R0, W0, 1.0)
HEAVY = replace(FREE, name="heavy body", potential=UniformGravity(WEIGHT, COM))
GRIDS = (Grid(0.005, 4), *(Grid(0.01 / part, 100 * part, 10 * part) for part in (1, 2, 4)))
CENTRAL = RigidBody(describe(principal_axes(HEAVY), GRIDS[0])["moments_com"])
FLOOR, PACE = 1e-6, 0.2
"""Smallest errors that are compared, above those of single precision, and wall time of the calls in a measurement, s."""
RESOLVED = {"f64": 1e-13, "f32": 1e-4}
"""Smallest errors that show an order, above round-off in each precision."""
PATIENCE = 30.0
"""Time in s that the program may take to start, and for each answer."""
ANSWERS = "answer each request once, in one line that ends with a newline (or one binary message), and flush stdout"
TO_Y_UP = rotation_about((1, 0, 0), -math.pi / 2)
"""Turns coordinates with the third axis up into those with the second axis up: (x, y, z) to (x, z, -y)."""
SAME = np.eye(3)
GRAVITY_ALONG_Y = "Gravity is along minus the second axis of W: the third axis of W is up"
TURNS = {  # of the world that attitudes are relative to
    GRAVITY_ALONG_Y: TO_Y_UP,
    "The second axis of its world is up: attitudes are relative to W, whose third axis is up": TO_Y_UP,
    "Its world is W turned the wrong way, by 90 degrees: attitudes are relative to W": TO_Y_UP.T,
}
READING: dict[str, dict[str, Any]] = {
    "": {},
    **{reading: {} for reading in TURNS},
    GRAVITY_ALONG_Y: {"R_WB0": TO_Y_UP.T @ R0},
    "It reads `q0` as x, y, z, w: the scalar comes first": {"R_WB0": from_quaternion(np.roll(to_quaternion(R0), 1))},
    "It reads the initial attitude transposed: v_W = R0 v_F": {"R_WB0": R0.T},
    "It reads `w0` in world axes: `w0` is in F": {"w_WB_B0": R0.T @ W0},
    "It reads rates in deg/s: they are in rad/s": {"w_WB_B0": np.deg2rad(W0)},
    "Its inertia is inverted: J w' = (J w) x w with J = `moments`": {"body": RigidBody(1 / J)},
    "It has no gyroscopic torque: J w' = (J w) x w of a free body": {"body": RigidBody((3, 3, 3))},
    "Gravity points up: it is along minus the third axis of W": {"potential": UniformGravity(WEIGHT, -COM)},
    'It ignores gravity: use it, or answer "unsupported" if `free` is false': {"potential": None},
    "Its inertia is about the centre of mass: `moments` are about the fixed point": {"body": CENTRAL},
}
SCALAR_LAST = "`q` is x, y, z, w: the scalar comes first"
TRANSPOSED = "The attitudes are transposed, or the quaternions conjugated: v_W = R v_F"
Y_UP = "Vectors are x, z, -y, with the second axis up: answer in W and F, whose third axis is up"
ATTITUDES = ("", SCALAR_LAST, TRANSPOSED, Y_UP)
W_IN_W = "`w` has rates in W, or `w_W` has rates in F: `w` is in F, `w_W` is in W"
RATES = {"": 1.0, W_IN_W: 1.0, "Rates are in deg/s: answer in rad/s": math.pi / 180}
TIMES: dict[str, tuple[float, int, int]] = {  # unit of dt, and how much later attitudes and rates are, in half steps
    "": (1, 0, 0),
    "Samples are half a step late: answer the state after `steps` steps": (1, -1, -1),
    "Rates are half a step late: answer both at the time of the attitude": (1, 0, -1),
    "It reads `dt` in ms: it is in s": (1e-3, 0, 0),
}
_solve = lru_cache(maxsize=256)(registry.method("taylor").solve)


def _distance(scene: Scene, grid: Grid, seen: tuple[Array, Array], when: str = "", turn: Array = SAME) -> float:
    unit, late_R, late_w = TIMES[when]
    truth = _solve(scene, Grid(unit * grid.dt / 2, 2 * grid.n_steps + 2))
    place = 2 * grid.steps[1:].astype(int)
    rates = np.linalg.norm(truth.w_WB_B[place + late_w] - seen[1][1:], axis=-1) / np.linalg.norm(W0)
    return float(np.nan_to_num(np.max([angle_between(turn @ truth.R_WB[place + late_R], seen[0][1:]), rates]), nan=math.inf))


def _read(states: States, attitude: str = "", rates: str = "") -> tuple[Array, Array]:
    values, in_world = states.values, states.rates_in_world != (rates == W_IN_W)
    if attitude == SCALAR_LAST and values.shape[-1] == 7:
        values = values[..., [3, 0, 1, 2, 4, 5, 6]]
    alone = replace(states, values=values, rates_in_world=False)
    R, w = (each[0] for each in to_body_axes(np.empty(values.shape[1]), alone, SAME[None])[:2])
    if attitude == TRANSPOSED:
        R = R.swapaxes(1, 2)
    elif attitude == Y_UP:
        R, w = TO_Y_UP.T @ R @ TO_Y_UP, w @ TO_Y_UP
    return R, RATES[rates] * ((w[:, None] @ R)[:, 0] if in_world else w)


def find_mistakes(scene: Scene, answers: dict[Grid, States]) -> tuple[str, ...]:
    """Return the mistakes that explain the samples of the short and of the last run; () if nothing does better than none."""
    runs = [(grid, answers[grid]) for grid in (GRIDS[0], GRIDS[-1])]
    seen = {names: [(grid, _read(states, *names)) for grid, states in runs] for names in product(ATTITUDES, RATES)}
    scenes = {reading: replace(scene, **values) for reading, values in READING.items()}
    costs = {}
    for reading, when, names in product(READING, TIMES, seen):
        turn = TURNS.get(reading, SAME)
        errors = [_distance(scenes[reading], grid, samples, when, turn) for grid, samples in seen[names]]
        mistakes = tuple(filter(None, (reading, *names, when)))
        costs[mistakes] = math.prod(max(FLOOR, error) for error in errors) * 10 ** len(mistakes)  # each has to explain much
    return min(costs, key=lambda mistakes: costs[mistakes])


def examine(scene: Scene, answers: dict[Grid, States]) -> tuple[list[float], tuple[str, ...], bool]:
    """Return the error of each run, the mistakes that explain them, and whether the errors fall with dt."""
    errors = [_distance(scene, grid, _read(answers[grid])) for grid in GRIDS]
    mistakes = find_mistakes(scene, answers) if errors[-1] > FLOOR else ()
    return errors, mistakes, errors[-1] <= 100 * FLOOR or 2 * errors[-1] < errors[1] < 1


def check(program: Program) -> Iterator[tuple[bool, str]]:
    """Yield whether each part of the test was passed, and its result as a sentence that names what to change."""
    part, remedy = "hello", "build it or change it as PROTOCOL.md describes"
    try:
        with time_limit(PATIENCE):
            method = program_class(program, PATIENCE)()
            worker, run = worker_of(method.environment), 0
            greeting = worker.greet()
            yield True, f"hello: {greeting.get('program')}, version {greeting['version']}"
            for scene in (FREE, HEAVY):
                part, answers = scene.name, dict[Grid, States]()
                try:
                    for grid in GRIDS:
                        run = worker.ask("prepare", settings=method.settings, **describe(principal_axes(scene), grid))["run"]
                        answers[grid] = read_states(worker.ask("run", run=run), (grid.n_samples,))
                    again = read_states(worker.ask("run", run=run), (grid.n_samples,))
                except NotImplementedError as failure:
                    yield scene is HEAVY, f"{scene.name}: unsupported ({failure})"
                    if scene is HEAVY:
                        break
                    return
                if not np.array_equal(again.values, answers[grid].values, equal_nan=True):
                    yield False, f"{scene.name}: a second run has other samples: start from `q0` and `w0`"
                    return
                errors, mistakes, falls = examine(scene, answers)
                text = f"error {errors[1]:.1e} at dt = {GRIDS[1].dt} s, {errors[-1]:.1e} at {grid.dt} s"
                if not falls:
                    mistakes = mistakes or (f"{text}: it does not fall with dt, and no known mistake explains it",)
                yield from ((False, f"{scene.name}: {mistake}") for mistake in mistakes)
                if mistakes:
                    return
                yield True, f"{scene.name}: {text}; a second run has the same samples"
                if scene is FREE and method.order is not None and errors[-1] > RESOLVED[method.precision]:
                    order = math.log(errors[1] / errors[-1], GRIDS[1].dt / grid.dt)
                    told = f'"engine": {{"order": {order:.0f}}} belongs in the answer to `hello`'
                    right = abs(order - method.order) < 0.5
                    yield right, f"order: {order:.2f}" + f", not {method.order}: {told}" * (not right)
            part = "time"
            yield _check_time(worker, run)
    except (UnusableProgram, IntegrationFailed) as failure:
        cause = getattr(failure, "cause", failure)
        remedy = ANSWERS if isinstance(cause, (EngineTimeout, EndlessAnswer)) else remedy
        problem = getattr(cause, "reason", getattr(failure, "problem", getattr(failure, "outcome", "")))
        yield False, f"{part}: {problem}: {remedy}"
        return


def _check_time(worker: Worker, run: int) -> tuple[bool, str]:
    """Return whether measured times of a run are honest, and a sentence with the time of a request beside its work."""
    calls, wall, seconds = 1, 0.0, 0.0
    while (wall < PACE or seconds < 0.5 * wall < 5 * PACE) and calls < 1e6:  # a busy machine may delay an answer
        calls, start = 4 * calls, perf_counter()
        seconds = float(worker.ask("time", run=run, calls=calls)["seconds"])
        wall = perf_counter() - start
    rest = math.inf  # of a request, beside the call
    for _ in range(20):
        start = perf_counter()
        inside = float(worker.ask("time", run=run, calls=1)["seconds"])
        rest = min(rest, perf_counter() - start - inside)
    problem = ": `seconds` is the wall time of all calls together" if seconds < 0.5 * wall else ""
    problem = ": `seconds` is in s, and only of the calls" if seconds > wall else problem
    problem = ": `time` has to make `calls` runs" if wall < PACE else problem
    more = f". A request takes {1e6 * rest:.0f} µs more, which no measured time contains"
    more += ": call the run without measuring it only at the first `time` of a run" * (rest > 0.5 * WARM_UP)
    size = f"{calls} runs of {GRIDS[-1].n_steps} steps, and {wall:.2g} s with the exchange"
    return not problem, f"time: {seconds:.2g} s for {size}{problem or more}"
