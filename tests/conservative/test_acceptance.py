"""A result is ok only if it is a finite trajectory of the scene on the grid and keeps the invariants within its bounds."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import axes_about, rotation_about
from conservative.batch import Batch
from conservative.card import Card
from conservative.drifts import ReferenceValues
from conservative.errors import Diverged, IntegrationFailed, InvalidResult, NotConserved
from conservative.grid import Grid
from conservative.invariants import kept_sizes
from conservative.method import Method, Role
from conservative.methods.bounds import bounds_of
from conservative.outcome import OutcomeKind
from conservative.trajectory import Bounds, Trajectory

BRICK = cv.scenes.brick_flip()
TOP = cv.scenes.lagrange_top()
GRID = Grid(0.01, 20, 3)


@dataclass(frozen=True)
class Foreign(Method):
    """A method of somebody else's, which does something to the trajectory of a good one."""

    spoil: Callable[[Trajectory], Any] = lambda good: good
    kept: frozenset[str] = frozenset()
    family: ClassVar[str] = "foreign"
    role: ClassVar[Role] = Role.OURS

    @property
    def order(self) -> int:
        return 2

    @property
    def conserves(self) -> frozenset[str]:
        return self.kept

    def prepare(self, scene: cv.Scene, grid: Grid) -> Any:
        run = cv.Reduced().prepare(scene, grid)
        return lambda: self.spoil(run())


class WithKernel(Foreign):
    """The same, looked at by compiled code first."""

    card: ClassVar[Card] = Card(kernel="reduced")


def changed(name: str, at: Any, value: float) -> Callable[[Trajectory], Trajectory]:
    def spoil(good: Trajectory) -> Trajectory:
        array = getattr(good, name).copy()
        array[at] = value
        return replace(good, **{name: array})

    return spoil


INVALID: dict[str, Callable[[Trajectory], Any]] = {
    "nothing": lambda good: None,
    "a pair": lambda good: (good.R_WB, good.w_WB_B),
    "another scene": lambda good: replace(good, scene=TOP),
    "a list of times": lambda good: replace(good, t=good.t.tolist()),
    "a list of attitudes": lambda good: replace(good, R_WB=good.R_WB.tolist()),
    "no rates": lambda good: replace(good, w_WB_B=None),
    "quaternions": lambda good: replace(good, R_WB=good.R_WB[:, 0, :]),
    "rates by columns": lambda good: replace(good, w_WB_B=good.w_WB_B.T),
    "complex": lambda good: replace(good, R_WB=good.R_WB.astype(complex)),
    "single precision": lambda good: replace(good, w_WB_B=good.w_WB_B.astype(np.float32)),
    "one sample too few": lambda good: replace(good, t=good.t[:-1], R_WB=good.R_WB[:-1], w_WB_B=good.w_WB_B[:-1]),
    "every sample twice": lambda good: replace(
        good, t=np.repeat(good.t, 2), R_WB=np.repeat(good.R_WB, 2, axis=0), w_WB_B=np.repeat(good.w_WB_B, 2, axis=0)
    ),
    "no sample": lambda good: replace(good, t=good.t[:0], R_WB=good.R_WB[:0], w_WB_B=good.w_WB_B[:0]),
    "twice the times": lambda good: replace(good, t=2 * good.t),
    "one time off": changed("t", 3, 0.0901),
    "times that are not numbers": changed("t", 3, np.nan),
    "counters of another kind": lambda good: replace(good, counters={"steps": 20}),
    "a failure of another kind": lambda good: replace(good, failure="it did not work"),
}


@pytest.mark.parametrize("kind", [Foreign, WithKernel])
@pytest.mark.parametrize("name", INVALID)
def test_what_is_no_trajectory_of_the_scene_on_the_grid_is_an_outcome(name: str, kind: type[Foreign]) -> None:
    found = kind(INVALID[name]).solve(BRICK, GRID)
    assert found.outcome.kind is OutcomeKind.INVALID
    assert found.scene is BRICK
    assert len(found) == 0
    assert found.outcome.reason


def test_a_motion_that_starts_elsewhere_is_that_of_another_scene() -> None:
    assert Foreign(changed("w_WB_B", (0, 0), 7.0)).solve(BRICK, GRID).outcome.kind is OutcomeKind.INVALID


def test_integrate_raises_and_run_returns_what_the_check_finds() -> None:
    nothing = Foreign(INVALID["nothing"])
    with pytest.raises(InvalidResult, match=r"method: got a NoneType, no Trajectory from .*foreign.*; expected a Trajectory"):
        cv.integrate(BRICK, method=nothing)
    assert nothing.run(BRICK, 0.1).outcome.kind is OutcomeKind.INVALID
    assert cv.integrate(BRICK, method=nothing, on_failure="return").outcome.kind is OutcomeKind.INVALID


@pytest.mark.parametrize("kind", [Foreign, WithKernel])
@pytest.mark.parametrize("number", [np.nan, np.inf])
@pytest.mark.parametrize("name", ["R_WB", "w_WB_B"])
def test_what_is_not_finite_has_diverged(name: str, number: float, kind: type[Foreign]) -> None:
    method = kind(changed(name, (4, 1), number))
    found = method.solve(BRICK, GRID)
    assert isinstance(found.failure, Diverged)
    assert len(found) == 4
    assert found.failure.time == found.t[-1]
    with pytest.raises(Diverged):
        cv.integrate(BRICK, 0.01, method)


@pytest.mark.parametrize("kind", [Foreign, WithKernel])
def test_nothing_finite_leaves_no_sample(kind: type[Foreign]) -> None:
    found = kind(lambda good: replace(good, R_WB=good.R_WB * np.nan)).solve(BRICK, GRID)
    assert (found.outcome.kind, len(found)) == (OutcomeKind.DIVERGED, 0)


def skewed(good: Trajectory) -> Trajectory:
    return changed("R_WB", (5, 1, 1), 2.0)(good)


@pytest.mark.parametrize("kind", [Foreign, WithKernel])
def test_orthonormality_is_checked_of_every_method(kind: type[Foreign]) -> None:
    found = kind(skewed).solve(BRICK, GRID)
    assert isinstance(found.failure, NotConserved)
    assert (found.failure.quantity, len(found)) == ("orthonormality", 5)
    assert found.failure.drift > found.failure.bound == 0.1
    assert found.failure.time == found.t[-1]


FASTER = changed("w_WB_B", slice(3, None), 3.0)


@pytest.mark.parametrize("kind", [Foreign, WithKernel])
@pytest.mark.parametrize(
    ("scene", "quantity"),
    [(BRICK, "energy"), (BRICK, "momentum"), (TOP, "energy"), (TOP, "vertical momentum"), (TOP, "axial momentum")],
)
def test_an_invariant_counts_where_the_method_names_it(scene: cv.Scene, quantity: str, kind: type[Foreign]) -> None:
    assert kind(FASTER).solve(scene, GRID).ok
    found = kind(FASTER, frozenset({quantity})).solve(scene, GRID)
    assert isinstance(found.failure, NotConserved)
    assert (found.failure.quantity, len(found)) == (quantity, 3)
    assert quantity in str(found.failure)


@pytest.mark.parametrize("kind", [Foreign, WithKernel])
def test_a_good_trajectory_is_handed_on_as_it_is(kind: type[Foreign]) -> None:
    run = cv.Reduced().prepare(BRICK, GRID)()
    method = kind(kept=cv.Reduced().conserves)
    assert method.check(BRICK, GRID, run) is run


def test_a_run_that_ended_early_keeps_its_failure_and_its_samples() -> None:
    def end(good: Trajectory) -> Trajectory:
        return replace(good, t=good.t[:4], R_WB=good.R_WB[:4], w_WB_B=good.w_WB_B[:4], failure=Diverged(0.09, "gave up"))

    found = Foreign(end).solve(BRICK, GRID)
    assert (len(found), found.outcome.reason) == (4, "gave up")
    late = Foreign(lambda good: replace(end(good), t=good.t[1:5]))
    assert late.solve(BRICK, GRID).outcome.kind is OutcomeKind.INVALID


def test_convected_with_a_loose_tolerance_is_not_ok() -> None:
    with pytest.raises(NotConserved):
        cv.integrate(BRICK, 0.01, cv.Convected(tol=0.1))
    assert cv.Convected().solve(BRICK, Grid(0.01, 50)).ok


def test_ill_conditioned_bodies_are_right_or_an_outcome() -> None:
    draw = np.random.default_rng(5)
    ended = []
    for _ in range(60):
        R, _ = np.linalg.qr(draw.normal(size=(3, 3)))
        tensor = R @ np.diag([1.0, 10 ** draw.uniform(-16, -12), 0.6]) @ R.T
        try:
            body = cv.RigidBody((tensor + tensor.T) / 2)
        except cv.BadInput:  # rounding has made it indefinite
            continue
        scene = cv.Scene("flat", body, np.eye(3), draw.normal(size=3), 1.0, cv.UniformGravity(1.0, (0.3, 0.2, 0.5)))
        for method in (cv.Projected(), cv.Reduced(), cv.Gauss()):
            found = method.solve(scene, Grid(0.01, 20))
            ended.append(found.ok)
            if found.ok:
                with np.errstate(all="raise"):
                    assert np.abs(found.drift(scene.invariants[0])).max() <= 1e-3
    assert len(ended) > 40  # the others are refused: their moments are too far apart
    assert not all(ended)


def test_default_bounds_are_stated() -> None:
    assert Foreign().bounds(BRICK, GRID) == Bounds(drift=1e-3, orthonormality=0.1)
    assert issubclass(NotConserved, IntegrationFailed)


EPS = sys.float_info.epsilon


def scene(moments=(3.0, 4.0, 6.0)):
    return cv.Scene("free", cv.RigidBody(moments), np.eye(3), (1, 2, 3), 1.0)


def test_rounding_and_tolerances_add_up_over_the_steps():
    assert bounds_of(scene(), Grid(0.1, 90)).drift == pytest.approx(4 * EPS * 100 * 2, rel=1e-12, abs=0)
    assert bounds_of(scene((1.0, 7.0, 7.5)), Grid(0.1, 90)).drift == pytest.approx(4 * EPS * 100 * 7.5, rel=1e-12, abs=0)
    assert bounds_of(scene(), Grid(0.1, 90), tol=1e-9).drift == pytest.approx(10 * 90 * 1e-9, rel=1e-6, abs=0)
    assert bounds_of(scene(), Grid(0.1, 90), tol=1.0).drift == 1e-3


def test_attitudes_from_quaternions_are_orthonormal_and_others_as_good_as_the_rest():
    assert bounds_of(scene(), Grid(0.1, 90)).orthonormality == 1e-13
    loose = bounds_of(scene(), Grid(0.1, 90), 1e-9, None)
    assert loose.orthonormality == loose.drift > 1e-7


def test_bounds_of_methods_with_a_tolerance():
    grid = Grid(0.1, 90)
    assert cv.Reduced(tol=1e-9).bounds(scene(), grid) == bounds_of(scene(), grid, 1e-9)
    assert cv.Convected(1e-7).bounds(scene(), grid) == bounds_of(scene(), grid, 1e-7, None)


def test_bounds_of_parts_are_those_of_all_parts():
    grid = Grid(0.1, 90)
    assert cv.Substepped(most=8).bounds(scene(), grid) == cv.Reduced().bounds(scene(), Grid(0.0125, 720))


def samples(n_steps=7, every=3):
    """Return the grid, and the times, attitudes and rates of a body that turns steadily about its momentum."""
    grid, w = Grid(0.1, n_steps, every), np.array([0.3, -0.2, 0.4])
    R = np.array([rotation_about(w, np.linalg.norm(w) * t) for t in grid.t])
    return grid, [grid.t, R, np.tile(w, (len(R), 1))]


def largest_drift(grid, given, rows=None):
    """Return the largest drift of energy and of the momentum along the rates, or of the attitudes' orthonormality."""
    if rows is None:
        w = np.array([0.3, -0.2, 0.4])
        rows = np.zeros((10, 3))
        rows[:3], rows[3], rows[6, 0] = np.eye(3), w, w @ w
        rows[8, :2], rows[9] = (w @ w / 2, 1.0), 1.0
    t, R, w = given
    measured = ReferenceValues(Batch.of(BRICK), rows[None]).measure(grid, t, R[None], w[None])[0]
    return max(measured[4], measured[0]) if np.isfinite(measured).all() else math.inf


@pytest.mark.parametrize("n_steps", [1, 6, 7])
def test_good_samples_have_no_drift(n_steps):
    assert largest_drift(*samples(n_steps)) < 1e-15  # 4e-16


@pytest.mark.parametrize("sample", [0, 1, 2, 3])
@pytest.mark.parametrize("array", [0, 1, 2])
@pytest.mark.parametrize("value", [1.1, np.nan])
def test_one_number_that_is_off_is_noticed(sample, array, value):
    grid, given = samples()
    given[array][sample] = given[array][sample] * value + 1e-3
    assert largest_drift(grid, given) > 1e-4  # 2e-4


@pytest.mark.parametrize("name", ["energy", "orthonormality"])
def test_drifts_are_those_of_the_worst_sample(name):
    grid, given = samples()
    if name == "energy":
        given[2][2] *= np.sqrt(1 + 1e-9 / 0.145)  # 0.145 J at the start
        assert largest_drift(grid, given) == pytest.approx(1e-9, rel=1e-6)
    else:
        given[1][1] *= np.sqrt(1 + 1e-9)
        assert largest_drift(grid, given, np.zeros((10, 3))) == pytest.approx(1e-9, rel=1e-6)


MOMENTS = np.array((1.0, 4.0, 25.0))


def test_momentum_is_relative_to_what_all_the_energy_makes_with_the_largest_moment():
    scene = cv.Scene("near rest", cv.RigidBody(MOMENTS), np.eye(3), (1e-3, 0, 0), 1.0, cv.UniformGravity(2, (0, 0, 3)))
    (found,) = kept_sizes(scene, frozenset({"vertical momentum"})).values()
    assert found == pytest.approx(math.sqrt(2 * scene.energy_scale * 25), rel=1e-12)
    (own,) = kept_sizes(scene, frozenset({"energy"})).values()
    assert own == scene.energy_scale


@pytest.mark.parametrize("along", range(3))
@pytest.mark.parametrize("off", [1, 2])
def test_a_momentum_that_turns_aside_is_not_kept(along, off):
    """The momentum is along one axis of the world, and the last sample is turned so that one other component changes."""
    w = np.array((0.3, -0.5, 0.4))
    axes = np.roll(axes_about(w * MOMENTS / np.linalg.norm(w * MOMENTS)), along - 2, axis=1)  # column `along` is the momentum's
    scene = cv.Scene("turned", cv.RigidBody(MOMENTS), axes.T, w, 1.0)
    about = np.eye(3)[(along + off) % 3]

    def turn(good):
        R_WB = good.R_WB.copy()
        R_WB[-1] = rotation_about(about, 0.01) @ R_WB[-1]
        return replace(good, R_WB=R_WB)

    grid = Grid(0.01, 3)
    assert WithKernel(kept=frozenset({"momentum"})).solve(scene, grid).ok
    found = WithKernel(turn, frozenset({"momentum"})).solve(scene, grid)
    assert found.outcome.kind is cv.OutcomeKind.NOT_CONSERVED
    assert len(found) == 3
