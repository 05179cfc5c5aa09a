"""Scenes as plain numbers, which engines get, and trajectories from the numbers that they return. PROTOCOL.md has both."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from conservative.attitude import Array, from_quaternion, to_quaternion
from conservative.batch import Batch
from conservative.errors import IntegrationFailed
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
from ..worker.client import EngineCrashed

SHARED = ("free", "dt", "n_steps", "every", "steps")
"""Numbers that all bodies of a run have in common."""

FIELDS: dict[type, tuple[str, ...]] = {
    Turning: (),
    UniformGravity: (),
    LinearSpring: ("point", "anchor", "stiffness", "rest_length"),
    PointAttraction: ("point", "anchor", "strength"),
    GravityGradient: ("gradient", "direction"),
}
"""Fields that the numbers describe, and names of the numbers in their `kernel_field`. Uniform gravity is in the mass model."""


def _describe_field(axes: EngineAxes) -> dict[str, Any]:
    """Return the numbers of all fields; those of a field that the scene does not have are 0."""
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
    return {
        "moments": axes.J,
        "q0": axes.q0,
        "R0": axes.R_WF0,
        "w0": axes.w0,
        "w0_W": axes.R_WF0 @ axes.w0,
        "mass": mass.mass,
        "com": mass.com,
        "gravity": mass.gravity,
        **_describe_field(axes),
        "moments_com": mass.body.moments,
        "q_com": to_quaternion(mass.body.R_BP),
        "inertia_com": mass.body.inertia,
        "free": axes.scene.free,
        "dt": grid.dt,
        "n_steps": grid.n_steps,
        "every": grid.every,
        "steps": grid.steps.astype(int),
    }


def take_axes(bodies: Batch, grid: Grid, unsupported: Callable[[Scene], str | None]) -> list[EngineAxes] | None:
    """Return each body's initial state in principal axes; None if one is not supported, or not of order one in SI units."""
    scenes = [bodies.take(i) for i in range(len(bodies))]
    if not scenes or any(unsupported(scene) or find_units(scene, grid.dt) != SI for scene in scenes):
        return None
    return [principal_axes(scene) for scene in scenes]


def describe_many(axes: Sequence[EngineAxes], grid: Grid) -> dict[str, Any]:
    """Return the numbers of n scenes of one kind. Those named in `rows` have a row for each scene."""
    every = [describe(each, grid) for each in axes]
    shared = {name: value for name, value in every[0].items() if name in SHARED}
    rows = {name: np.array([each[name] for each in every]) for name in every[0] if name not in SHARED}
    return {**shared, **rows, "rows": list(rows)}


def _read(answer: Mapping[str, Any], shape: tuple[int, ...]) -> tuple[Array, Array]:
    """Return attitudes (*shape, 3, 3) and rates (*shape, 3) in F. Raise `EngineCrashed` if an answer has other shapes."""
    if "q" in answer:
        q = np.asarray(answer["q"], float)
        R_WF = from_quaternion(q.reshape(-1, 4)).reshape(*q.shape[:-1], 3, 3)
    else:
        R_WF = np.asarray(answer["R"], float)
    w = np.asarray(answer["w"] if "w" in answer else answer["w_W"], float)
    if R_WF.shape != (*shape, 3, 3) or w.shape != (*shape, 3):
        raise EngineCrashed(f"it returned attitudes {R_WF.shape} and rates {w.shape}, not {shape} samples")
    return R_WF, w if "w" in answer else (w[..., None, :] @ R_WF)[..., 0, :]


class ManySamples:
    """Converts the answer of an engine for n bodies into a block of samples in body axes."""

    def __init__(self, axes: Sequence[EngineAxes], grid: Grid) -> None:
        self._R_FB, self._shape = np.array([each.R_BF.T for each in axes])[:, None], (len(axes), grid.n_samples)

    def trajectory(self, answer: Mapping[str, Any]) -> Block:
        R_WF, w = _read(answer, self._shape)
        R_WB, w_WB_B = R_WF @ self._R_FB, (w[..., None, :] @ self._R_FB)[..., 0, :]
        return Block(R_WB, w_WB_B, np.isfinite(R_WB).all(axis=(1, 2, 3)) & np.isfinite(w_WB_B).all(axis=(1, 2)))

    def failure(self, failure: IntegrationFailed) -> Block:
        raise failure


class EngineSamples:
    """Converts the answer of an engine into a trajectory in body axes."""

    def __init__(self, axes: EngineAxes, grid: Grid, label: str) -> None:
        self.axes, self.grid, self.label = axes, grid, label

    def trajectory(self, answer: Mapping[str, Any]) -> Trajectory:
        R_WF, w = _read(answer, (self.grid.n_samples,))
        work = Counters(answer.get("steps", self.grid.n_steps), evaluations=answer.get("evaluations"))
        return self.axes.trajectory(self.grid, self.label, R_WF, w, work, answer.get("reason") or "the state is not finite")

    def failure(self, failure: IntegrationFailed) -> Trajectory:
        """Return a trajectory without samples."""
        nothing = np.empty((0, 3))
        return Trajectory(self.axes.scene, np.empty(0), np.empty((0, 3, 3)), nothing, self.label, Counters(0), failure)
