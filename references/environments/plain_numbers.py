"""Scenes as plain numbers, which engines get, and trajectories from the numbers that they return. PROTOCOL.md has both."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from conservative.attitude import to_quaternion
from conservative.batch import Batch
from conservative.errors import IntegrationFailed
from conservative.features import Feature, Features, features_of
from conservative.grid import Grid
from conservative.methods.many import Block
from conservative.methods.units import SI, find_units
from conservative.potentials.gravity_gradient import GravityGradient
from conservative.potentials.point_to_point import LinearSpring, PointAttraction
from conservative.potentials.turning import Turning, static_part
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from ..engine import EngineAxes, mass_model, principal_axes
from ..samples import MATRIX, QUATERNION, States, to_body_axes
from ..worker.client import EngineCrashed, is_number

SHARED = ("free", "dt", "n_steps", "every", "steps")
"""Numbers that all bodies of a run have in common."""

FIELDS: dict[Any, tuple[str, ...]] = {
    Turning: (),
    UniformGravity: (),
    LinearSpring: ("point", "anchor", "stiffness", "rest_length"),
    PointAttraction: ("point", "anchor", "strength"),
    GravityGradient: ("gradient", "direction"),
}
"""Fields that the numbers describe, and names of the numbers in their `kernel_field`. Uniform gravity is in the mass model."""

FEATURES: dict[Any, Features] = {
    kind: frozenset({Feature.TURNING}) if kind is Turning else features_of(kind) for kind in FIELDS
}
"""Features of these fields."""


def describe_field(axes: EngineAxes) -> dict[str, Any]:
    """Return the numbers of all fields; numbers of a field that the scene does not have are 0."""
    potential: Any = axes.scene.potential
    numbers: dict[str, Any] = {name: np.zeros(3) for name in ("point", "anchor", "direction", "turn")}
    numbers |= {"stiffness": 0.0, "rest_length": 0.0, "strength": 0.0, "gradient": np.zeros((3, 3))}
    if isinstance(potential, Turning):
        numbers["turn"] = potential.orbit.rate * potential.orbit.normal_W
    static = static_part(potential)
    if names := FIELDS.get(type(static)):
        numbers |= zip(names, (np.array(value)[()] for value in static.kernel_field(axes.R_BF)), strict=True)
    return numbers


def describe(axes: EngineAxes, grid: Grid) -> dict[str, Any]:
    """Return a scene and a grid as the numbers of a `prepare` request, in SI units."""
    mass = mass_model(axes)
    assert mass is not None  # checked by `unsupported`
    w0_W, x0 = axes.R_WF0 @ axes.w0, axes.R_WF0 @ mass.com
    flight = axes.scene.flight
    return {
        "moments": axes.J,
        "q0": axes.q0,
        "R0": axes.R_WF0,
        "w0": axes.w0,
        "w0_W": w0_W,
        "x0": x0,
        "v0": np.cross(w0_W, x0),
        "mass": mass.mass,
        "com": mass.com,
        "gravity": mass.gravity,
        **describe_field(axes),
        "moments_com": mass.body.moments,
        "q_com": to_quaternion(mass.body.R_BP),
        "inertia_com": mass.body.inertia,
        "free": axes.scene.free,
        "dt": grid.dt,
        "n_steps": grid.n_steps,
        "every": grid.every,
        "steps": grid.steps.astype(int),
        **({} if axes.scene.body.rotor_momentum is None else {"rotor": axes.rotor}),
        **({"p_WB0": flight.p_WB0, "v_WB0": flight.v_WB0} if flight else {}),
    }


def take_axes(bodies: Batch, grid: Grid, unsupported: Callable[[Scene], str | None]) -> list[EngineAxes] | None:
    """Return each body's initial state in principal axes; None if one is not supported, or not of order one in SI units."""
    scenes = [bodies.take(i) for i in range(len(bodies))]
    if not scenes or any(unsupported(scene) or find_units(scene, grid.dt) != SI for scene in scenes):
        return None
    return [principal_axes(scene) for scene in scenes]


def describe_many(axes: Sequence[EngineAxes], grid: Grid) -> dict[str, Any]:
    """Return the numbers of n scenes of one kind. Those named in `rows` have a row for each scene."""
    return join_numbers([describe(axis, grid) for axis in axes])


def join_numbers(every: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the numbers of a run of n bodies, from the numbers of each body."""
    shared = {name: value for name, value in every[0].items() if name in SHARED}
    rows = {name: np.array([numbers[name] for numbers in every]) for name in every[0] if name not in SHARED}
    return {**shared, **rows, "rows": list(rows)}


def read_states(answer: Mapping[str, Any], shape: tuple[int, ...]) -> States:
    """Return the samples of n bodies, shape (n, s), or of one, (s,). Raise `EngineCrashed` if an answer has other shapes."""
    kind, name, row_shape = (QUATERNION, "q", (4,)) if "q" in answer else (MATRIX, "R", (3, 3))
    try:
        attitudes, rates = (np.asarray(answer[field], float) for field in (name, "w" if "w" in answer else "w_W"))
    except (TypeError, ValueError):
        raise EngineCrashed("its samples are not arrays: their rows have different lengths") from None
    if attitudes.shape != (*shape, *row_shape) or rates.shape != (*shape, 3):
        raise EngineCrashed(f"it returned attitudes {attitudes.shape} and rates {rates.shape}, not {shape} samples")
    values = np.concatenate([attitudes.reshape(*shape, -1), rates], axis=-1)
    return States(kind, values.reshape(-1, *values.shape[-2:]), rates_in_world="w" not in answer)


Answer = Mapping[str, Any] | IntegrationFailed
"""The answer of an engine to a request for a run, or its failure."""


def read_many(axes: Sequence[EngineAxes], grid: Grid) -> Callable[[Answer], Block]:
    """Return a function that converts an answer for n bodies into samples in body axes; it raises a failure."""
    R_BF = np.array([axis.R_BF for axis in axes])

    def read(answer: Answer) -> Block:
        if isinstance(answer, IntegrationFailed):
            raise answer
        R_WB, w_WB_B, finite = to_body_axes(grid.t, read_states(answer, (len(R_BF), grid.n_samples)), R_BF)
        return Block(R_WB, w_WB_B, finite == grid.n_samples)

    return read


def _count(answer: Mapping[str, Any], name: str) -> int | None:
    """Return a count of an answer for one body; arrays are of many bodies."""
    value = answer.get(name)
    if value is not None and not (is_number(value) and value == int(value)):
        raise EngineCrashed(f"it answers `{name}`: {repr(value)[:100]}; expected a whole number of 0 or more")
    return None if value is None else int(value)


def read_one(axes: EngineAxes, grid: Grid, label: str) -> Callable[[Answer], Trajectory]:
    """Return a function that converts an answer into a trajectory in body axes, which has no samples after a failure."""

    def read(answer: Answer) -> Trajectory:
        if isinstance(answer, IntegrationFailed):
            return Trajectory(axes.scene, np.empty(0), np.empty((0, 3, 3)), np.empty((0, 3)), label, Counters(0), answer)
        steps, evaluations = (_count(answer, name) for name in ("steps", "evaluations"))
        work = Counters(grid.n_steps if steps is None else steps, evaluations=evaluations)
        reason, frame = answer.get("reason") or "the state is not finite", None
        if axes.scene.flight:
            try:
                frame = np.asarray(answer["p"], float), np.asarray(answer["v"], float)
            except (TypeError, ValueError):
                raise EngineCrashed("its `p` and `v` are not arrays: their rows have different lengths") from None
            if any(part.shape != (grid.n_samples, 3) for part in frame):
                raise EngineCrashed(f"it returned positions {frame[0].shape} and velocities {frame[1].shape} in free flight")
        return axes.trajectory(grid, label, read_states(answer, (grid.n_samples,)), work, reason, frame=frame)

    return read
