"""Trajectories as frames on one clock, which the page and the video draw."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from itertools import groupby
from typing import Any, NamedTuple

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
SAME = 1e-6
"""Largest relative difference of moments that are drawn as equal, and of a centre of mass that is drawn on the axis."""
MOST = 1e6
"""Largest angular momentum in the data of a panel, relative to the initial one; the arrow ends before."""
ERROR = "attitude error, rad"
LIMITS: dict[str, tuple[float, float]] = {ERROR: (1e-3, 0.1)}
"""Largest values that are good, and fair, of the attitude error; for drifts they are 1e-10 and 1e-3."""
FACES = ("#d55e00", "#f2b48a", "#0072b2", "#8fc4e8", "#e0a800", "#f7e3a1")
"""Colours of the faces +x, -x, +y, -y, +z, -z."""
COLOURS = {"faces": FACES, "arrow": "#009e73", "trace": "#cc3399", "outline": "#808890", "ink": "#202428"}
COLOURS |= {"sphere": "#9fb3c8", "ellipsoid": "#f4efe6"}  # the surfaces of equal momentum and of equal energy
GRADES = {"good": "#cdebd8", "fair": "#fbe9b7", "bad": "#f8cfc8"}
"""Backgrounds of numbers by their grade, as in player.css."""


Values = Mapping[str, Array]
"""The largest value so far of each drift and of the attitude error, rad, at the samples of a motion (n,), by name."""


class Shape(StrEnum):
    """A solid of constant density with the moments of a body about the fixed point."""

    BOX = "box"
    CONE = "cone"


QUARTERS, ROUND = 4, 12
"""Coloured parts of the surface of a cone, which show that it spins, and straight pieces of the circle in each of them."""


class Face(NamedTuple):
    """A plane part of a surface: corners (n, 3), counter-clockwise from outside, a colour, and edges as numbers of corners."""

    corners: Array
    colour: str
    edges: tuple[tuple[int, int], ...]


@dataclass(frozen=True, eq=False)
class Solid:
    """The solid that is drawn for a body, in principal axes.

    Attributes
    ----------
    shape
        A box about the fixed point, or for a top a cone that stands on it.
    size
        The sides of a box (3,), or the radius and the height of a cone (2,). The farthest point is at a distance of 1.
    axis
        Direction of a cone (3,), from its tip to its base.
    """

    shape: Shape
    size: Array
    axis: Array

    @cached_property
    def centre(self) -> Array:
        """The middle of the solid (3,)."""
        return np.zeros(3) if self.shape is Shape.BOX else self.axis * self.size[1] / 2

    @cached_property
    def faces(self) -> list[Face]:
        """The faces of the surface."""
        if self.shape is Shape.BOX:
            signs = np.array([[x, y, z] for x in (1, -1) for y in (1, -1) for z in (1, -1)])
            sides = zip(_SIDES, FACES, strict=True)
            return [
                Face((signs * self.size / 2)[list(side)], colour, ((0, 1), (1, 2), (2, 3), (3, 0))) for side, colour in sides
            ]
        rim, tip, base, faces = self._rim, np.zeros(3), self.axis * self.size[1], list[Face]()
        for k in range(len(rim)):
            before, after, quarter = rim[k], rim[(k + 1) % len(rim)], k // ROUND
            edges = ((1, 2), *((0, 2),) * (k % ROUND == 0), *((0, 1),) * ((k + 1) % ROUND == 0))
            faces.append(Face(np.stack([tip, after, before]), FACES[quarter], edges))
            faces.append(Face(np.stack([base, before, after]), FACES[4 + quarter % 2], ((1, 2),)))
        return faces

    def share_inside(self, direction: Array) -> float:
        """Return the share of a vector (3,) from the fixed point that is inside the solid."""
        with np.errstate(divide="ignore"):
            if self.shape is Shape.BOX:
                return float(min(np.min(self.size / 2 / np.abs(direction)), 1.0))
        along = float(direction @ self.axis)
        across = float(np.linalg.norm(direction - along * self.axis))
        radius, height = self.size
        return float(min(height / along, 1.0)) if along > 0 and across * height < along * radius else 0.0

    @cached_property
    def _rim(self) -> Array:
        """The points of the rim of a cone, counter-clockwise about its axis."""
        first = np.cross(self.axis, np.eye(3)[np.argmin(np.abs(self.axis))])
        first /= np.linalg.norm(first)
        angles = np.arange(QUARTERS * ROUND) * 2 * np.pi / (QUARTERS * ROUND)
        circle = np.outer(np.cos(angles), first) + np.outer(np.sin(angles), np.cross(self.axis, first))
        return np.asarray(self.size[0] * circle + self.size[1] * self.axis)


_SIDES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
"""Corners of the sides of a box, in the order of `FACES`."""


@dataclass(frozen=True, eq=False)
class Panel:
    """Frames of one trajectory, fewer than the times of the clock if the run ended early.

    Attributes
    ----------
    label, outcome
        Title, and the failure of the run (empty if it reached its end).
    solid, tip
        The body as it is drawn, and the end of the rod (3,) in principal axes.
    R_WP, L_W
        Attitudes of the principal axes (n, 3, 3), and angular momentum relative to its initial size (n, 3), world axes.
    sizes
        Largest drift so far of each invariant, and largest attitude error so far, rad, (n,).
    """

    label: str
    outcome: str
    solid: Solid
    tip: Array
    R_WP: Array
    L_W: Array
    sizes: dict[str, Array]

    def data(self) -> dict[str, Any]:
        """Return the data for the player: rounded, and numbers as the frames from which they have a text and a grade."""
        values = {"size": self.solid.size, "tip": self.tip, "q": np.roll(to_quaternion(self.R_WP), -1, axis=1), "L": self.L_W}
        numbers = [[self.number(name, frame) for frame in range(len(self.R_WP))] for name in self.sizes]
        texts = [[(f"{symbol} {size}", grade) for symbol, size, grade in track] for track in numbers]
        starts = [[next(same) for _, same in groupby(enumerate(track), lambda pair: pair[1])] for track in texts]
        shown = [[(frame, *text) for frame, text in start] for start in starts]
        return {name: value.round(4).ravel().tolist() for name, value in values.items()} | {
            "shape": self.solid.shape,
            "sizes": shown,
        }

    def number(self, name: str, frame: int) -> tuple[str, str, str]:
        """Return the symbol, the number and the grade of a frame in `sizes`: as tables show it, rounded up."""
        value = float(self.sizes[name][frame])
        good, fair = LIMITS.get(name, (1e-10, 1e-3))
        symbol, grade = ("✓", "good") if value <= good else ("≈", "fair") if value <= fair else ("✗", "bad")
        shown = angle(value) if name == ERROR else bound(value)
        return symbol, shown if value >= 1e-15 else "< 1e-15", grade


def speeds(duration: float) -> list[float]:
    """Return five speeds, simulated s per s; with the middle one, the default, a motion takes about 10 s."""
    middle = round(3 * math.log10(duration / 10))  # the speeds are 1, 2 and 5 in each decade
    return [float(f"{(1, 2, 5)[k % 3]}e{k // 3}") for k in range(middle - 2, middle + 3)]


def drift_name(invariant: Invariant) -> str:
    """Return the name of the drift of an invariant in `Panel.sizes`."""
    return f"{invariant.name} drift"


def largest_values(trajectory: Trajectory, error: Array | None) -> dict[str, Array]:
    """Return the largest drift of each invariant so far, and the largest attitude error, rad, at the samples (n,), by name."""
    values = {drift_name(invariant): sizes(trajectory.drift(invariant)) for invariant in trajectory.scene.invariants}
    if error is not None:
        values[ERROR] = error
    return {name: np.maximum.accumulate(value) for name, value in values.items()}


def longest(trajectories: Sequence[Trajectory]) -> float:
    """Return the time, s, up to which the motions can be watched; infinity if all of it."""
    ends = []
    right = [trajectory for trajectory in trajectories if trajectory.ok]
    for trajectory in right or trajectories:
        turned = np.cumsum(np.diff(trajectory.t) * np.linalg.norm(trajectory.w_WB_B[1:], axis=1))
        within = np.count_nonzero(turned <= 0.99 * MOST_FRAMES * TURN)  # `make_panels` computes this angle from a mean rate
        ends.append(math.inf if within == len(turned) else float(trajectory.t[within]))
    return max(ends, default=math.inf)


def make_panels(
    trajectories: Sequence[Trajectory], labels: Sequence[str], truth: int | None, values: Sequence[Values | None] | None = None
) -> tuple[Array, list[Panel]]:
    """Return the times of the frames (n,), s, and the panels of trajectories, see `element`."""
    if not trajectories or not all(map(len, trajectories)):
        raise BadInput("trajectories", repr(list(trajectories)), "trajectories with at least one sample")
    if len(labels) != len(trajectories):
        raise BadInput("labels", list(labels), f"one label for each of {len(trajectories)} trajectories")
    duration = max(float(trajectory.t[-1]) for trajectory in trajectories) or trajectories[0].scene.t_end
    shared = min((float(trajectory.t[-1]) for trajectory in trajectories if trajectory.ok), default=duration)
    if all(
        not trajectory.ok or trajectory.t[-1] - np.diff(trajectory.t).max(initial=0.0) <= shared for trajectory in trajectories
    ):
        duration = shared or duration  # last steps pass it: all bodies are drawn at one time
    rate = min(float(np.linalg.norm(trajectory.w_WB_B, axis=1).mean()) for trajectory in trajectories)
    frames = max(FRAMES, math.ceil(rate * duration / TURN) + 1)
    if frames > MOST_FRAMES + 1:
        got = f"{duration:g} s, in which the body turns by {rate * duration:.0f} rad"
        raise BadInput("t_end", got, f"at most {MOST_FRAMES * TURN / rate:.3g} s, so that the motion can be watched")
    times, exact = np.linspace(0.0, duration, frames), None if truth is None else trajectories[truth]
    panels = []
    for trajectory, label, largest in zip(trajectories, labels, values or [None] * len(trajectories), strict=True):
        if largest is None:
            largest = largest_values(trajectory, None if exact is None or trajectory is exact else _errors(trajectory, exact))
        panels.append(_panel(trajectory, label, times, largest))
    return times, panels


def _panel(trajectory: Trajectory, label: str, times: Array, values: Values) -> Panel:
    from scipy.spatial.transform import Rotation

    t, scene, body = trajectory.t, trajectory.scene, trajectory.scene.body
    near = 1e-9 * times[-1]  # times that differ by less are equal
    times = times[: 1 + np.count_nonzero(times < t[-1] - near)]  # the last frame is the last sample
    before = np.clip(np.searchsorted(t, times + near) - 1, 0, None)
    after = np.minimum(before + 1, len(t) - 1)
    share = np.clip((times - t[before]) / np.where(after > before, t[after] - t[before], 1.0), 0.0, 1.0)
    start, stop = Rotation.from_matrix(trajectory.R_WB[before]), Rotation.from_matrix(trajectory.R_WB[after])
    R_WB = (start * Rotation.from_rotvec(share[:, None] * (start.inv() * stop).as_rotvec())).as_matrix()
    last = np.append(before[:-1], len(t) - 1)  # the last numbers belong to the whole run
    lengths = np.linalg.norm(trajectory.momentum_W, axis=1)
    tip = np.asarray(getattr(scene.potential, "com_B", np.zeros(3))) @ body.R_BP
    solid = _solid_of(body.moments, tip)
    if not tip.any():
        tip = np.eye(3)[np.argmax(np.abs(scene.w_WB_B0 @ body.R_BP))]
    with np.errstate(all="ignore"):  # the momentum of a run that diverged can overflow
        L_W = np.nan_to_num(trajectory.momentum_W[before] / (lengths[0] or lengths.max() or 1.0))
    return Panel(
        label,
        "" if trajectory.ok else str(trajectory.outcome),
        solid,
        # A quarter longer than the distance of the solid's farthest point, 1.
        1.25 * tip / np.linalg.norm(tip),
        R_WB @ body.R_BP,
        np.clip(L_W, -MOST, MOST),
        {name: value[last] for name, value in values.items() if not np.isnan(value).any()},  # not every method has balances
    )


def _solid_of(moments: Array, com_P: Array) -> Solid:
    """Return the solid of a body: a cone on its tip if the centre of mass is on an axis of symmetry, otherwise a box.

    Of a cone on its tip J1 = J2 = 3/5 m (r^2/4 + h^2) and J3 = 3/10 m r^2. Of a box J_1 = m/12 (b^2 + c^2), and so on.
    """
    along, off = int(np.argmax(np.abs(com_P))), np.sort(np.abs(com_P))[:2]
    about, (first, second) = moments[along], np.delete(moments, along)
    is_top = com_P.any() and off.max() <= SAME * np.abs(com_P).max() and abs(first - second) <= SAME * first
    if is_top and about < 2 * first:  # otherwise no height has these moments
        sides = np.sqrt([2 * about, first - about / 2])  # r and h, times a constant
        size = np.maximum(sides, THINNEST * sides.max())
        return Solid(Shape.CONE, size / np.linalg.norm(size), np.sign(com_P[along]) * np.eye(3)[along])
    squares = np.maximum(moments.sum() - 2 * moments, 0)
    size = np.maximum(np.sqrt(squares), THINNEST * math.sqrt(squares.max()))
    return Solid(Shape.BOX, 2 * size / np.linalg.norm(size), np.zeros(3))


def legend(panels: Sequence[Panel], truth: int | None) -> list[tuple[str, str]]:
    """Return colour and text of the lines in the panels."""
    solids = {panel.solid.shape: f"{panel.solid.shape} of the same moments" for panel in panels}
    entries = [*((FACES[0], text) for text in solids.values()), (str(COLOURS["arrow"]), "angular momentum")]
    entries.append((str(COLOURS["trace"]), "axis of the body, and the trace of its end"))
    return entries + [(str(COLOURS["outline"]), "reference solution")] * (truth is not None)


def _errors(trajectory: Trajectory, truth: Trajectory) -> Array:
    """Return the attitude error at each sample (n,), rad, against the truth at the same time."""
    t = trajectory.t  # whose last step can pass the end of the truth
    if t[-1] > truth.t[-1] + np.diff(t).max(initial=0.0) * (1 + 1e-9):
        raise BadInput("truth", f"a motion until {truth.t[-1]:g} s", f"one until {t[-1]:g} s, or less than a step before")
    return angle_between(attitudes_at(truth, t), trajectory.R_WB)
