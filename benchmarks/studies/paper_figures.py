"""The data of the paper's figures 1 and 2, integrated anew."""

from __future__ import annotations

from functools import cache

import numpy as np
import pandas as pd

from conservative import registry
from conservative.attitude import Array
from conservative.integration import integrate
from conservative.scene import Scene
from conservative.trajectory import Trajectory

METHODS = ("convected", "reduced")
TOP_STEPS = (0.01, 0.005, 0.0025)
ANALYTICAL = "analytical"


@cache
def _trajectory(scene: str, method: str, dt: float) -> Trajectory:
    return integrate(registry.scene(scene), dt, registry.method(method))


def body_rates() -> pd.DataFrame:
    """Return figure 1(a), columns t (s), component, rate (rad/s): body rates of the brick, dt = 0.01, eps = 1e-8."""
    trajectory = _trajectory("brick_flip", "convected", 0.01)
    wide = pd.DataFrame(trajectory.w_WB_B, columns=["ω1", "ω2", "ω3"]).assign(t=trajectory.t)
    return wide.melt("t", var_name="component", value_name="rate")


def conservation() -> pd.DataFrame:
    """Return figures 1(b), 1(c), columns t (s), method, energy and momentum: errors of energy and |L|, relative, signed."""
    return pd.concat([_errors(_trajectory("brick_flip", method, 0.01), method) for method in METHODS], ignore_index=True)


def _errors(trajectory: Trajectory, method: str) -> pd.DataFrame:
    length = np.linalg.norm(trajectory.momentum_W, axis=1)
    columns = {
        "energy": trajectory.energy / trajectory.energy[0] - 1,
        "momentum": length / length[0] - 1,
    }
    return pd.DataFrame({"t": trajectory.t, "method": method, **columns})


def centre_of_mass() -> pd.DataFrame:
    """Return figures 2(b), 2(c), columns t (s), run, x1, x2 (m): centre of mass of the top for two steps, and exact."""
    runs = [(f"Δt = {dt:g} s", _trajectory("lagrange_top", "convected", dt)) for dt in TOP_STEPS[:2]]
    runs.append((ANALYTICAL, _trajectory("lagrange_top", "exact", TOP_STEPS[1])))
    return pd.concat([_positions(trajectory, name) for name, trajectory in runs], ignore_index=True)


def _positions(trajectory: Trajectory, name: str) -> pd.DataFrame:
    x = com_W(trajectory.scene, trajectory.R_WB)
    return pd.DataFrame({"t": trajectory.t, "run": name, "x1": x[:, 0], "x2": x[:, 1]})


def com_W(scene: Scene, R_WB: Array) -> Array:
    """Return the centre of mass (..., 3), m, world axes, of a scene in uniform gravity."""
    return np.asarray(R_WB @ scene.potential.com_B)  # type: ignore[union-attr]


def position_errors() -> pd.DataFrame:
    """Return the errors of the top's centre of mass after the whole number of steps next to one period of precession.

    Columns dt (s), t (s), x1 (m), the error of the coordinate that figure 2(b) draws, and distance (m).
    """
    return pd.DataFrame([_position_error(dt) for dt in TOP_STEPS])


def _position_error(dt: float) -> dict[str, float]:
    ours, exact = (_trajectory("lagrange_top", method, dt) for method in ("convected", "exact"))
    step = round(ours.scene.t_end / dt)
    gap = com_W(ours.scene, ours.R_WB[step] - exact.R_WB[step])
    return {"dt": dt, "t": float(ours.t[step]), "x1": abs(float(gap[0])), "distance": float(np.linalg.norm(gap))}
