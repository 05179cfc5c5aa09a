"""A scene as plain numbers, which is what engines are given, and a trajectory of what they hand back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from conservative.attitude import from_quaternion, to_quaternion
from conservative.errors import IntegrationFailed
from conservative.method import Grid
from conservative.trajectory import Counters, Trajectory

from ..engine import Axes, mass_model
from .failures import EngineCrashed


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
