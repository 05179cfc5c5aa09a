"""The motion that errors are measured against: from one truth, after another one, independent of it, has agreed.

    scene                                           the trajectory          what it is checked against
    free body, Lagrange top, compound pendulum      `Exact`                 `Precise`
    any other field that `Precise` knows            `Precise`               `SciPy` (DOP853, the tightest tolerance)
    a user's own field                              `SciPy` (DOP853)        `SciPy` (LSODA)

The checker's own error is in the agreement: a few rounding units in the first line, some 1e-11 rad in the others, more where a
motion amplifies errors. Source: our own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from conservative.attitude import angle_between
from conservative.grid import Grid
from conservative.method import Method
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from .engines.scipy import SciPy
from .exact.method import Exact
from .precise import Precise

CHECKED_RADIANS = 100.0
"""A closed form is checked this far into the motion, rad turned: multi-precision integration costs seconds per hundred."""
CHECKED_SAMPLES = 16

TIGHTEST = 2.3e-14
"""Relative tolerance for SciPy, which has no smaller one."""


class Disagreement(ArithmeticError):
    """Two truths differ by more than they may. Attributes: `scene`, `names`, `agreement_rad` and `allowed_rad`, in rad."""

    def __init__(self, scene: str, names: tuple[str, str], agreement_rad: float, allowed_rad: float) -> None:
        self.scene, self.names, self.agreement_rad, self.allowed_rad = scene, names, agreement_rad, allowed_rad
        super().__init__(
            f"scene: got {scene!r}, for which {names[0]} and {names[1]} differ by {agreement_rad:.3g} rad; "
            f"expected at most {allowed_rad:.3g} rad"
        )


@dataclass(frozen=True, eq=False)
class Truth:
    """A trajectory to measure against.

    Attributes
    ----------
    trajectory
        The motion at the samples of the grid.
    agreement_rad
        Largest difference of the two truths over the part checked: of attitudes, rad, or of rates relative to the largest rate.
    names
        Who made the trajectory, and who checked it.
    checked_until
        End of the part checked, s.
    approximate
        Whether the trajectory is neither a closed form nor multi-precision: then it is known no better than the two agree.
    """

    trajectory: Trajectory
    agreement_rad: float
    names: tuple[str, str]
    checked_until: float
    approximate: bool = False


def reference(scene: Scene, grid: Grid) -> Truth:
    """Return the motion of a scene at the samples of a grid, once two independent truths agree.

    Raises
    ------
    Disagreement
        The truths differ by more than round-off and their own errors explain.
    MissingEngine
        A package that a truth needs is not installed.
    """
    first, second, allowed = _pair(scene)
    trajectory = first.solve(scene, grid)
    if trajectory.failure is not None:
        raise trajectory.failure
    end, fastest = float(grid.t[-1]), float(np.linalg.norm(trajectory.w_WB_B, axis=-1).max())
    if isinstance(first, Exact):
        until = min(end, CHECKED_RADIANS / fastest) if fastest else end
        agreement = scene.derive(_agreement, first, second, until)  # grids change more often than scenes
    else:
        until, agreement = end, difference(trajectory, second.solve(scene, grid))
    # Times are products rounded to double in one truth and not in the other.
    allowed += np.finfo(float).eps * fastest * until
    names = (first.label, second.label)
    if not agreement <= allowed:
        raise Disagreement(scene.name, names, agreement, allowed)
    return Truth(trajectory, agreement, names, until, not isinstance(first, Exact | Precise))


def difference(a: Trajectory, b: Trajectory) -> float:
    """Return the largest difference of attitudes, rad, or of rates relative to the largest; infinite if one ended early."""
    if len(a) != len(b):
        return float("inf")
    scale = float(np.abs(a.w_WB_B).max()) or 1.0
    rates = float(np.abs(a.w_WB_B - b.w_WB_B).max()) / scale
    return max(float(angle_between(a.R_WB, b.R_WB).max()), rates)


def _pair(scene: Scene) -> tuple[Method, Method, float]:
    """Return who makes the trajectory, who checks it, and by how much they may differ, rad."""
    if Exact().unsupported(scene) is None:
        return Exact(), Precise(), 1e-12
    if Precise().unsupported(scene) is None:
        return Precise(), SciPy("DOP853", TIGHTEST), 1e-8
    return SciPy("DOP853", TIGHTEST), SciPy("LSODA", 1e-12), 1e-6


def _agreement(scene: Scene, first: Method, second: Method, until: float) -> float:
    """Return the difference over the first `until` s."""
    grid = Grid(until / CHECKED_SAMPLES, CHECKED_SAMPLES)
    return difference(first.solve(scene, grid), second.solve(scene, grid))
