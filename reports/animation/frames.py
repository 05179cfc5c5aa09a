"""Trajectories as frames on one clock, which the page and the video draw."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from conservative.attitude import Array, angle_between, to_quaternion
from conservative.errors import BadInput
from conservative.invariants import sizes
from conservative.trajectory import Trajectory

TURN = 0.35
"""Mean angle between two frames, rad: the player interpolates on great circles, which are shorter ways only below pi."""
FRAMES = (200, 2000)
"""Smallest and largest number of frames; 60 bytes each in the page."""
SECONDS = 10
"""Time that a motion takes at the default speed, s, to within the steps of 1, 2, 5, 10."""
THINNEST = 0.04
"""Shortest side of a box relative to its longest: a planar body, or moments that no mass distribution has."""


@dataclass(frozen=True, eq=False)
class Clock:
    """Times of the frames (n,), s, and speeds in simulated seconds per second."""

    times: Array

    @property
    def duration(self) -> float:
        """Time of the last frame, s."""
        return float(self.times[-1])

    @property
    def speeds(self) -> list[float]:
        """Five speeds; the middle one is the default."""
        middle = round(3 * math.log10(self.duration / SECONDS))
        return [float(f"{(1, 2, 5)[k % 3]}e{k // 3}") for k in range(middle - 2, middle + 3)]

    @property
    def speed(self) -> float:
        """The default speed."""
        return self.speeds[2]


@dataclass(frozen=True, eq=False)
class Panel:
    """Frames of one trajectory; fewer than the clock has if the run ended early.

    Attributes
    ----------
    label, outcome
        Title, and the failure of the run (empty if it reached its end).
    size, tip
        Sides of the inertia box (3,) and end of the rod (3,) in principal axes; the box has a half diagonal of 1.
    R_WP, L_W
        Attitudes of the principal axes (n, 3, 3), and angular momentum relative to its initial size (n, 3), world axes.
    sizes
        Largest drift so far of each invariant, and largest attitude error so far, rad, (n,).
    ended
        Time of the last sample, s.
    """

    label: str
    outcome: str
    size: Array
    tip: Array
    R_WP: Array
    L_W: Array
    sizes: dict[str, Array]
    ended: float

    def data(self) -> dict[str, Any]:
        """Return the data for the player, rounded to a thousandth of the picture."""
        return {
            "size": self.size.round(4).tolist(),
            "tip": self.tip.round(4).tolist(),
            "q": to_quaternion(self.R_WP).round(4).ravel().tolist(),
            "L": np.clip(self.L_W, -9, 9).round(3).ravel().tolist(),
            "sizes": {name: [float(f"{min(value, 1e300):.1e}") for value in values] for name, values in self.sizes.items()},
            "ended": self.ended,
        }


def make_panels(trajectories: Sequence[Trajectory], labels: Sequence[str], truth: int | None) -> tuple[Clock, list[Panel]]:
    """Return the clock and the panels of trajectories, see `element`."""
    if not trajectories or not all(map(len, trajectories)):
        raise BadInput("trajectories", repr(list(trajectories)), "trajectories with at least one sample")
    if len(labels) != len(trajectories):
        raise BadInput("labels", list(labels), f"one label for each of {len(trajectories)} trajectories")
    duration = max(float(each.t[-1]) for each in trajectories) or trajectories[0].scene.t_end
    rate = min(float(np.linalg.norm(each.w_WB_B, axis=1).mean()) for each in trajectories)
    frames = max(FRAMES[0], math.ceil(rate * duration / TURN) + 1)
    if frames > FRAMES[1]:
        longest = FRAMES[1] * TURN / rate
        raise BadInput(
            "t_end", f"{duration:g} s, in which the body turns {rate * duration:.0f} rad", f"at most {longest:.3g} s"
        )
    clock = Clock(np.linspace(0.0, duration, frames))
    exact = None if truth is None else trajectories[truth]
    return clock, [_panel(each, label, clock, exact) for each, label in zip(trajectories, labels, strict=True)]


def _panel(trajectory: Trajectory, label: str, clock: Clock, truth: Trajectory | None) -> Panel:
    from scipy.spatial.transform import Rotation

    t, body = trajectory.t, trajectory.scene.body
    times = clock.times[clock.times <= t[-1] + 1e-9 * clock.duration]
    before = np.clip(np.searchsorted(t, times + 1e-9 * clock.duration) - 1, 0, None)  # a sample at the time itself counts
    after = np.minimum(before + 1, len(t) - 1)
    share = np.clip((times - t[before]) / np.where(after > before, t[after] - t[before], 1.0), 0.0, 1.0)
    start, stop = Rotation.from_matrix(trajectory.R_WB[before]), Rotation.from_matrix(trajectory.R_WB[after])
    R_WB = (start * Rotation.from_rotvec(share[:, None] * (start.inv() * stop).as_rotvec())).as_matrix()
    L = trajectory.momentum_W
    reference = float(np.linalg.norm(L[0])) or float(np.linalg.norm(L, axis=1).max()) or 1.0
    drifts = {f"{each.name} drift": sizes(trajectory.drift(each)) for each in trajectory.scene.invariants}
    drifts = {name: values for name, values in drifts.items() if not np.isnan(values).any()}  # balances a method does not give
    if truth is not None and truth is not trajectory:
        drifts["attitude error"] = _errors(trajectory, truth)
    J = body.moments
    size = np.sqrt(np.maximum(J.sum() - 2 * J, THINNEST**2 * J.max()))  # squares of the sides, up to a factor
    size = np.maximum(size, THINNEST * size.max())
    size *= 2 / np.linalg.norm(size)
    com_B = getattr(trajectory.scene.potential, "com_B", None)
    axis = trajectory.scene.w_WB_B0 @ body.R_BP
    tip = np.eye(3)[np.argmax(np.abs(axis))] if com_B is None else np.asarray(com_B) @ body.R_BP
    return Panel(
        label,
        "" if trajectory.ok else str(trajectory.outcome),
        size,
        1.25 * tip / np.linalg.norm(tip),
        R_WB @ body.R_BP,
        L[before] / reference,
        {name: np.maximum.accumulate(values)[before] for name, values in drifts.items()},
        float(t[-1]),
    )


def _errors(trajectory: Trajectory, truth: Trajectory) -> Array:
    """Return the attitude error at each sample (n,), rad. A truth with other times is interpolated (spline, order 4)."""
    from scipy.spatial.transform import Rotation, RotationSpline

    n = len(trajectory)
    if n <= len(truth) and np.allclose(trajectory.t, truth.t[:n], rtol=1e-12, atol=0):
        return angle_between(truth.R_WB[:n], trajectory.R_WB)
    if trajectory.t[-1] > truth.t[-1] * (1 + 1e-9):
        raise BadInput("truth", f"a motion until {truth.t[-1]:g} s", f"one until {trajectory.t[-1]:g} s")
    spline = RotationSpline(truth.t, Rotation.from_matrix(truth.R_WB))
    return angle_between(spline(np.minimum(trajectory.t, truth.t[-1])).as_matrix(), trajectory.R_WB)
