"""A scene as plain numbers, which is what engines are given, and a trajectory of what they hand back."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from conservative.attitude import from_quaternion, to_quaternion
from conservative.batch import Batch
from conservative.errors import IntegrationFailed
from conservative.grid import Grid
from conservative.methods.many import Block
from conservative.methods.units import SI, find_units
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from ..engine import Axes, mass_model, principal_axes
from .failures import EngineCrashed

SHARED = ("free", "dt", "n_steps", "every", "steps")
"""What all of the bodies that run at once have in common."""


def describe(axes: Axes, grid: Grid) -> dict[str, Any]:
    """Return a scene and a grid as the plain numbers that an adapter is given, all in SI units.

    The start: `q0` (4,), scalar first, and `R0` (3, 3), the attitude of the principal axes F in the world; `w0` (3,), rates in
    F, and `w0_W` (3,), in the world. The body: `moments` (3,) about what stays where it is, the fixed point or a free body's
    centre of mass; `mass`, `com` (3,) in F; about the latter `inertia_com` (3, 3) in F, which is `moments_com` (3,) in axes
    `q_com` (4,) in F; downward `gravity`; `free`, whether nothing holds it. The grid: `dt`, `n_steps`, `every`, and `steps`
    (n,), numbers of steps after which the state is kept.
    """
    mass = mass_model(axes)
    assert mass is not None  # `unsupported` has seen to it
    return {
        "moments": axes.J,
        "q0": axes.q0,
        "R0": axes.R_WF0,
        "w0": axes.w0,
        "w0_W": axes.R_WF0 @ axes.w0,
        "mass": mass.mass,
        "com": mass.com,
        "gravity": mass.gravity,
        "moments_com": mass.body.moments,
        "q_com": to_quaternion(mass.body.R_BP),
        "inertia_com": mass.body.inertia,
        "free": axes.scene.free,
        "dt": grid.dt,
        "n_steps": grid.n_steps,
        "every": grid.every,
        "steps": grid.steps.astype(int),
    }


def take_axes(bodies: Batch, grid: Grid, unsupported: Callable[[Scene], str | None]) -> list[Axes] | None:
    """Return each body's start in principal axes; None where one is not supported, or not of order one in SI units."""
    scenes = [bodies.take(i) for i in range(len(bodies))]
    if not scenes or any(unsupported(scene) or find_units(scene, grid.dt) != SI for scene in scenes):
        return None
    return [principal_axes(scene) for scene in scenes]


def describe_many(axes: Sequence[Axes], grid: Grid) -> dict[str, Any]:
    """Return the same of n scenes of one kind: what belongs to each is named in `rows`, and has n of them."""
    every = [describe(each, grid) for each in axes]
    shared = {name: value for name, value in every[0].items() if name in SHARED}
    rows = {name: np.array([each[name] for each in every]) for name in every[0] if name not in SHARED}
    return {**shared, **rows, "rows": list(rows)}


class ManySamples:
    """Makes a block of what an engine hands over of n bodies: what `Samples` takes of one, with n rows."""

    def __init__(self, axes: Sequence[Axes], grid: Grid) -> None:
        self._R_FB, self._wanted = np.array([each.R_BF.T for each in axes])[:, None], (len(axes), grid.n_samples)

    def trajectory(self, found: Mapping[str, Any]) -> Block:
        """Return the samples in body axes.

        Raises
        ------
        EngineCrashed
            They are not what the grid asks for.
        """
        R_WF = from_quaternion(np.asarray(found["q"], float).reshape(-1, 4)).reshape(*found["q"].shape[:-1], 3, 3)
        rates = np.asarray(found["w"] if "w" in found else found["w_W"], float)
        if R_WF.shape[:2] != self._wanted or rates.shape != (*self._wanted, 3):
            raise EngineCrashed(f"it returned attitudes {R_WF.shape} and rates {rates.shape}, not {self._wanted} samples")
        w = rates if "w" in found else (rates[..., None, :] @ R_WF)[..., 0, :]
        R_WB, w_WB_B = R_WF @ self._R_FB, (w[..., None, :] @ self._R_FB)[..., 0, :]
        return Block(R_WB, w_WB_B, np.isfinite(R_WB).all(axis=(1, 2, 3)) & np.isfinite(w_WB_B).all(axis=(1, 2)))

    def failure(self, failure: IntegrationFailed) -> Block:
        """Raise how the engine failed: it did so for all bodies."""
        raise failure


class Samples:
    """Makes a trajectory of what an engine hands over.

    That is attitudes `q` (n, 4), scalar first, or `R` (n, 3, 3), and rates `w` (n, 3), rad/s, in F, or `w_W` in the world;
    beside them `reason`, why there are no more samples, `steps` and `evaluations`, which it counted.
    """

    def __init__(self, axes: Axes, grid: Grid, label: str) -> None:
        self.axes, self.grid, self.label = axes, grid, label

    def trajectory(self, found: Mapping[str, Any]) -> Trajectory:
        """Return the samples in body axes.

        Raises
        ------
        EngineCrashed
            They are not what the grid asks for.
        """
        R_WF = from_quaternion(found["q"]) if "q" in found else found["R"]
        rates = found["w"] if "w" in found else found["w_W"]
        n = self.grid.n_samples
        if R_WF.shape != (n, 3, 3) or rates.shape != (n, 3):
            raise EngineCrashed(f"it returned attitudes {R_WF.shape} and rates {rates.shape}, not {n} samples")
        w = rates if "w" in found else (rates[:, None] @ R_WF)[:, 0]
        work = Counters(found.get("steps", self.grid.n_steps), evaluations=found.get("evaluations"))
        reason = found.get("reason") or "the state is not finite"
        return self.axes.trajectory(self.grid, self.label, np.asarray(R_WF, float), np.asarray(w, float), work, reason)

    def failure(self, failure: IntegrationFailed) -> Trajectory:
        """Return the trajectory without samples of a run whose engine did not answer."""
        nothing = np.empty((0, 3))
        return Trajectory(self.axes.scene, np.empty(0), np.empty((0, 3, 3)), nothing, self.label, Counters(0), failure)
