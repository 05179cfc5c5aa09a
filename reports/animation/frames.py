"""Trajectories as frames on one clock, which the page and the video draw."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np

from conservative.attitude import Array, angle_between, to_quaternion
from conservative.benchmarks.studies.motion import FRAMES, MOST_FRAMES, TURN
from conservative.errors import BadInput
from conservative.invariants import Invariant, sizes
from conservative.methods.between import attitudes_at
from conservative.trajectory import Trajectory

from ..numbers import angle, bound

THINNEST = 0.04
"""Shortest side of a box relative to its longest: of a planar body, or of moments that no mass distribution has."""
MOST = 1e6
"""Largest angular momentum in the data of a panel, relative to the initial one; the arrow ends before."""
ERROR = "attitude error, rad"
LIMITS: dict[str, tuple[float, float]] = {ERROR: (1e-3, 0.1)}
"""Largest values that are good, and fair, of the attitude error; those of drifts are 1e-10 and 1e-3."""
FACES = ("#d55e00", "#f2b48a", "#0072b2", "#8fc4e8", "#e0a800", "#f7e3a1")  # +x, -x, +y, -y, +z, -z
COLOURS = {"faces": FACES, "arrow": "#009e73", "trace": "#cc3399", "outline": "#808890", "ink": "#202428"}
COLOURS |= {"sphere": "#9fb3c8", "ellipsoid": "#f4efe6"}  # of the momentum and of the energy


Values = Mapping[str, Array]
"""The largest value so far of each drift and of the attitude error, rad, at the samples of a motion (n,), by name."""


@dataclass(frozen=True, eq=False)
class Panel:
    """Frames of one trajectory, fewer than the times of the clock if the run ended early.

    Attributes
    ----------
    label, outcome
        Title, and the failure of the run (empty if it reached its end).
    size, tip
        Sides of the inertia box (3,) and end of the rod (3,) in principal axes; half a diagonal of the box is 1.
    R_WP, L_W
        Attitudes of the principal axes (n, 3, 3), and angular momentum relative to its initial size (n, 3), world axes.
    sizes
        Largest drift so far of each invariant, and largest attitude error so far, rad, (n,).
    """

    label: str
    outcome: str
    size: Array
    tip: Array
    R_WP: Array
    L_W: Array
    sizes: dict[str, Array]

    def data(self) -> dict[str, Any]:
        """Return the data for the player: rounded, and numbers as the frames from which they have a text and a grade."""
        values = {"size": self.size, "tip": self.tip, "q": np.roll(to_quaternion(self.R_WP), -1, axis=1), "L": self.L_W}
        texts = [[self.text(name, frame) for frame in range(len(self.R_WP))] for name in self.sizes]
        starts = [[next(same) for _, same in groupby(enumerate(each), lambda pair: pair[1])] for each in texts]
        shown = [[(frame, *text) for frame, text in each] for each in starts]
        return {name: value.round(4).ravel().tolist() for name, value in values.items()} | {"sizes": shown}

    def text(self, name: str, frame: int) -> tuple[str, str]:
        """Return the number of a frame in `sizes` as tables show it, rounded up, and its grade."""
        value = float(self.sizes[name][frame])
        good, fair = LIMITS.get(name, (1e-10, 1e-3))
        symbol, grade = ("✓", "good") if value <= good else ("≈", "fair") if value <= fair else ("✗", "bad")
        shown = angle(value) if name == ERROR else bound(value)
        return f"{symbol} {shown if value >= 1e-15 else '< 1e-15'}", grade


def speeds(duration: float) -> list[float]:
    """Return five speeds, simulated s per s; with the middle one, the default, a motion takes about 10 s."""
    middle = round(3 * math.log10(duration / 10))
    return [float(f"{(1, 2, 5)[k % 3]}e{k // 3}") for k in range(middle - 2, middle + 3)]


def drift_name(invariant: Invariant) -> str:
    """Return the name of the drift of an invariant in `Panel.sizes`."""
    return f"{invariant.name} drift"


def largest_values(trajectory: Trajectory, error: Array | None) -> dict[str, Array]:
    """Return the largest drift of each invariant so far, and the largest attitude error, rad, at the samples (n,), by name."""
    values = {drift_name(each): sizes(trajectory.drift(each)) for each in trajectory.scene.invariants}
    if error is not None:
        values[ERROR] = error
    return {name: np.maximum.accumulate(value) for name, value in values.items()}


def longest(trajectories: Sequence[Trajectory]) -> float:
    """Return the time, s, up to which the motions can be watched; infinity if all of it."""
    ends = []
    for each in [each for each in trajectories if each.ok] or trajectories:
        turned = np.cumsum(np.diff(each.t) * np.linalg.norm(each.w_WB_B[1:], axis=1))
        within = np.count_nonzero(turned <= 0.99 * MOST_FRAMES * TURN)  # of the angle that `make_panels` takes from a mean rate
        ends.append(math.inf if within == len(turned) else float(each.t[within]))
    return max(ends, default=math.inf)


def make_panels(
    trajectories: Sequence[Trajectory], labels: Sequence[str], truth: int | None, values: Sequence[Values | None] | None = None
) -> tuple[Array, list[Panel]]:
    """Return the times of the frames (n,), s, and the panels of trajectories, see `element`."""
    if not trajectories or not all(map(len, trajectories)):
        raise BadInput("trajectories", repr(list(trajectories)), "trajectories with at least one sample")
    if len(labels) != len(trajectories):
        raise BadInput("labels", list(labels), f"one label for each of {len(trajectories)} trajectories")
    duration = max(float(each.t[-1]) for each in trajectories) or trajectories[0].scene.t_end
    shared = min((float(each.t[-1]) for each in trajectories if each.ok), default=duration)
    if all(not each.ok or each.t[-1] - np.diff(each.t).max(initial=0.0) <= shared for each in trajectories):
        duration = shared or duration  # last steps pass it: all bodies are drawn at one time
    rate = min(float(np.linalg.norm(each.w_WB_B, axis=1).mean()) for each in trajectories)
    frames = max(FRAMES, math.ceil(rate * duration / TURN) + 1)
    if frames > MOST_FRAMES + 1:
        got = f"{duration:g} s, in which the body turns by {rate * duration:.0f} rad"
        raise BadInput("t_end", got, f"at most {MOST_FRAMES * TURN / rate:.3g} s, so that the motion can be watched")
    times, exact = np.linspace(0.0, duration, frames), None if truth is None else trajectories[truth]
    panels = []
    for each, label, known in zip(trajectories, labels, values or [None] * len(trajectories), strict=True):
        if known is None:
            known = largest_values(each, None if exact is None or each is exact else _errors(each, exact))
        panels.append(_panel(each, label, times, known))
    return times, panels


def _panel(trajectory: Trajectory, label: str, times: Array, values: Values) -> Panel:
    from scipy.spatial.transform import Rotation

    t, scene, body = trajectory.t, trajectory.scene, trajectory.scene.body
    near = 1e-9 * times[-1]
    times = times[: 1 + np.count_nonzero(times < t[-1] - near)]  # the last frame is the last sample
    before = np.clip(np.searchsorted(t, times + near) - 1, 0, None)
    after = np.minimum(before + 1, len(t) - 1)
    share = np.clip((times - t[before]) / np.where(after > before, t[after] - t[before], 1.0), 0.0, 1.0)
    start, stop = Rotation.from_matrix(trajectory.R_WB[before]), Rotation.from_matrix(trajectory.R_WB[after])
    R_WB = (start * Rotation.from_rotvec(share[:, None] * (start.inv() * stop).as_rotvec())).as_matrix()
    last = np.append(before[:-1], len(t) - 1)  # the last numbers are those of the whole run
    lengths = np.linalg.norm(trajectory.momentum_W, axis=1)
    squares = np.maximum(body.moments.sum() - 2 * body.moments, 0)  # of the sides: J_1 = m/12 (b^2 + c^2), and so on
    size = np.maximum(np.sqrt(squares), THINNEST * math.sqrt(squares.max()))
    tip = np.asarray(getattr(scene.potential, "com_B", np.zeros(3))) @ body.R_BP
    if not tip.any():
        tip = np.eye(3)[np.argmax(np.abs(scene.w_WB_B0 @ body.R_BP))]
    with np.errstate(all="ignore"):  # the momentum of a run that diverged can overflow
        L_W = np.nan_to_num(trajectory.momentum_W[before] / (lengths[0] or lengths.max() or 1.0))
    return Panel(
        label,
        "" if trajectory.ok else str(trajectory.outcome),
        2 * size / np.linalg.norm(size),
        1.25 * tip / np.linalg.norm(tip),
        R_WB @ body.R_BP,
        np.clip(L_W, -MOST, MOST),
        {name: value[last] for name, value in values.items() if not np.isnan(value).any()},  # not every method has balances
    )


def _errors(trajectory: Trajectory, truth: Trajectory) -> Array:
    """Return the attitude error at each sample (n,), rad, against the truth at the same time."""
    t = trajectory.t  # whose last step can pass the end of the truth
    if t[-1] > truth.t[-1] + np.diff(t).max(initial=0.0) * (1 + 1e-9):
        raise BadInput("truth", f"a motion until {truth.t[-1]:g} s", f"one until {t[-1]:g} s, or less than a step before")
    return angle_between(attitudes_at(truth, t), trajectory.R_WB)
