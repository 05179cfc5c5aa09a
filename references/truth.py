"""Reference solutions. Each is checked against a second, independent solution.

    scene                                           trajectory              checked against
    free body, Lagrange top, compound pendulum      `Exact`                 `Precise`
    any other field that `Precise` knows            `Precise`               `SciPy` (DOP853, the tightest tolerance)
    torque or damping of time only [1]              Gauss collocation       `SciPy` (DOP853, the tightest tolerance)
    torque or damping of attitude [1]               `SciPy` (DOP853)        Gauss collocation
    a user's own field                              `SciPy` (DOP853)        `SciPy` (LSODA)
    random bodies (`confirm`)                       `Precise` (96 bits)     Gauss collocation, extended precision (`collocate`)

[1] in a field that kernels know, or in none.

The difference contains the error of the second solution: a few rounding units in the first line, about 1e-11 rad in the others,
and more if a motion amplifies errors. For random bodies it is below 1.1e-15 rad on nine in ten, and at most 1e-13 rad:
`confirm` refuses others (1 of 300, of the seeds 7, 1001 and 1002).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from conservative.attitude import angle_between
from conservative.features import Feature
from conservative.grid import Grid
from conservative.method import Method
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from .collocation import collocate
from .exact.method import Exact
from .precise import Precise
from .solvers.scipy import SciPy

CHECKED_RADIANS = 100.0
"""A closed form is checked over this angle only, rad: multi-precision integration takes seconds for it."""
CHECKED_SAMPLES = 16
"""Number of samples at which a closed form is checked."""

BITS = 96
"""Precision of the reference solutions of random bodies."""
CONFIRMED = 1e-13
"""Largest difference of two reference solutions of a random body, rad: a tenth of the smallest error that is compared."""
PARTS = (2, 8, 32, 128)
"""Steps of the collocation between two samples. More are tried while the difference is larger than `CONFIRMED`."""
KNOTS, MOST_PARTS = 64, 2**8
"""Samples, evenly chosen, between which the collocation of a scene with a torque or damping divides its steps, and the most
steps between two of them. The number of other samples hardly changes its cost."""
LOADED = 1e-8
"""Largest difference of two reference solutions of a scene with a torque or damping, rad."""
TIGHTEST = 2.3e-14
"""Smallest relative tolerance of SciPy."""
EXACT_APART, PRECISE_APART, FUNCTION_APART = 1e-12, 1e-8, 1e-6
"""Largest differences of two solutions, rad, in addition to rounding of times: of a closed form and `Precise`, which differ by
round-off; of `Precise` and SciPy, which integrates in double precision; and of two methods of SciPy."""


class Disagreement(ArithmeticError):
    """Two reference solutions differ by too much. Attributes: `scene`, `names`, `agreement_rad`, `allowed_rad`."""

    def __init__(self, scene: str, names: tuple[str, str], agreement_rad: float, allowed_rad: float) -> None:
        self.scene, self.names, self.agreement_rad, self.allowed_rad = scene, names, agreement_rad, allowed_rad
        differ = f"differ by {agreement_rad:.3g} rad" if agreement_rad < math.inf else "end at different times"
        super().__init__(
            f"scene: got {scene!r}, for which {names[0]} and {names[1]} {differ}; expected at most {allowed_rad:.3g} rad"
        )


class Unsolvable(Disagreement):
    """A scene without a reference solution up to a time, because one of its functions fails before.

    It has the attributes `scene` and `cause` only, because there is no second solution.
    """

    def __init__(self, scene: str, cause: Exception) -> None:
        self.scene, self.cause = scene, cause
        ArithmeticError.__init__(self, f"scene: got {scene!r}, which cannot be solved ({cause})")


@dataclass(frozen=True, eq=False)
class Truth:
    """A reference solution.

    Attributes
    ----------
    trajectory
        The reference solution at the samples of the grid.
    agreement_rad
        Largest difference of the two solutions over the checked part: of attitudes, rad, or of rates relative to the largest.
    names
        Labels of the two methods.
    checked_until
        End of the checked part, s.
    approximate
        True if the trajectory is an integration in double precision, so that `agreement_rad` bounds its accuracy. Closed forms,
        multi-precision and collocation (extended precision) are more accurate than the solution that checks them.
    """

    trajectory: Trajectory
    agreement_rad: float
    names: tuple[str, str]
    checked_until: float
    approximate: bool = False


def reference(scene: Scene, grid: Grid) -> Truth:
    """Return the reference solution of a scene at the samples of a grid.

    Raises
    ------
    Disagreement
        The two solutions differ by more than round-off and their errors explain, or one of them fails.
    MissingEngine
        A package that a solution needs is not installed.
    """
    scene = scene.now()
    if _is_collocated(scene) and (truth := _confirm_loads(scene, grid)):
        return truth
    first, second, allowed = _pair(scene)
    trajectory, names = first.solve(scene, grid), (first.label, second.label)
    if trajectory.failure is not None:
        raise Disagreement(scene.name, names, math.inf, allowed) from trajectory.failure
    end, fastest = float(grid.t[-1]), float(np.linalg.norm(trajectory.w_WB_B, axis=-1).max())
    if isinstance(first, Exact):
        until = min(end, CHECKED_RADIANS / fastest) if fastest else end
        agreement = scene.derive(_agreement, first, second, until)  # cached: many grids use one scene
    elif Feature.ATTITUDE in scene.features and Feature.FUNCTION not in scene.features:
        knots = _knots(grid)
        other, _ = _collocate_loads(scene, knots)
        names, until, agreement = (first.label, other.label), end, difference(first.solve(scene, knots), other)
    else:
        until, agreement = end, difference(trajectory, second.solve(scene, grid))
    # Times are products that only one of the solutions rounds to double.
    allowed += np.finfo(float).eps * fastest * until
    if not agreement <= allowed:
        raise Disagreement(scene.name, names, agreement, allowed)
    return Truth(trajectory, agreement, names, until, not isinstance(first, Exact | Precise))


def solve(scene: Scene, grid: Grid) -> Trajectory:
    """Return the reference solution of a scene at the samples of a grid, without its check: faster than `reference`.

    Raise `MissingEngine` if a package that it needs is not installed.
    """
    scene = scene.now()
    if _is_collocated(scene):
        trajectory, change = _collocate_loads(scene, grid)
        if change <= LOADED:
            return trajectory
    first = _pair(scene)[0]
    return (Precise(BITS) if isinstance(first, Precise) else first).solve(scene, grid)


def confirm(scene: Scene, grid: Grid) -> Truth:
    """Return the reference solution of a random body, which two independent integrators agree on.

    Raises
    ------
    Disagreement
        They differ by more than `CONFIRMED`.
    MissingEngine
        heyoka is not installed.
    """
    method = Precise(BITS)
    trajectory, end = method.solve(scene, grid), float(grid.t[-1])
    for parts in PARTS:
        second = collocate(scene, grid, parts)
        if (agreement := difference(trajectory, second)) <= CONFIRMED:
            return Truth(trajectory, agreement, (method.label, second.label), end)
    raise Disagreement(scene.name, (method.label, second.label), agreement, CONFIRMED)


def _is_collocated(scene: Scene) -> bool:
    """Return whether a scene has a torque or damping of time only, in a field that kernels know.

    Functions of the attitude are called at each stage of each iteration, which takes a hundred times as long as in SciPy.
    """
    return scene.loaded and not {Feature.FUNCTION, Feature.ATTITUDE} & scene.features


def _collocate_loads(scene: Scene, grid: Grid) -> tuple[Trajectory, float]:
    """Return the collocation with enough steps, so that twice as many change it by at most `CONFIRMED`, and the last change."""
    breaks, step, *_ = scene.smoothness(grid.last)
    knots = _knots(grid)
    gaps = np.diff(np.union1d(knots.t, breaks[breaks < grid.t[-1]]))
    parts = 2 ** math.ceil(math.log2(max(1.0, float(gaps.max()) / step)))
    trajectory, change = collocate(scene, knots, parts), np.inf
    while not change <= CONFIRMED and parts < MOST_PARTS:  # nan if steps are much too long
        parts, coarse = 2 * parts, trajectory
        trajectory = collocate(scene, knots, parts)
        change = difference(coarse, trajectory)
    return trajectory if knots == grid else collocate(scene, grid, parts, knots.every // grid.every), change


def _knots(grid: Grid) -> Grid:
    """Return the grid with `KNOTS` of its samples, or all."""
    stride = math.ceil(grid.n_samples / KNOTS)
    return grid if stride == 1 else Grid(grid.dt, grid.n_steps, grid.every * stride)


def _confirm_loads(scene: Scene, grid: Grid) -> Truth | None:
    """Return the collocation, checked by SciPy; None if it does not converge, as with a damping that stops the body at once."""
    second, (trajectory, change) = SciPy("DOP853", TIGHTEST), _collocate_loads(scene, grid)
    if not change <= LOADED:
        return None
    agreement, names = difference(trajectory, second.solve(scene, grid)), (trajectory.label, second.label)
    if not agreement <= LOADED:
        raise Disagreement(scene.name, names, agreement, LOADED)
    return Truth(trajectory, agreement, names, float(grid.t[-1]))


def difference(a: Trajectory, b: Trajectory) -> float:
    """Return the largest difference of attitudes, rad, or of rates relative to the largest; infinite if one ended early."""
    if len(a) != len(b):
        return float("inf")
    scale = float(np.abs(a.w_WB_B).max()) or 1.0
    rates = float(np.abs(a.w_WB_B - b.w_WB_B).max()) / scale
    return max(float(angle_between(a.R_WB, b.R_WB).max()), rates)


def _pair(scene: Scene) -> tuple[Method, Method, float]:
    """Return the method, the method that checks it, and their largest allowed difference, rad."""
    if Exact().unsupported(scene) is None:
        return Exact(), Precise(), EXACT_APART
    if Precise().unsupported(scene) is None:
        return Precise(), SciPy("DOP853", TIGHTEST), PRECISE_APART
    return SciPy("DOP853", TIGHTEST), SciPy("LSODA", 1e-12), FUNCTION_APART


def _agreement(scene: Scene, first: Method, second: Method, until: float) -> float:
    grid = Grid(until / CHECKED_SAMPLES, CHECKED_SAMPLES)
    return difference(first.solve(scene, grid), second.solve(scene, grid))
