"""What a method gives is ok only if it is a trajectory of the scene on the grid, finite, and keeps what the method names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest

import conservative as cv
from conservative.errors import Diverged, IntegrationFailed, InvalidResult, NotConserved
from conservative.method import Grid, Method, Role
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
    kernel: ClassVar[str] = ""
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

    kernel: ClassVar[str] = "reduced"


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
    with pytest.raises(InvalidResult, match=r"method: got a NoneType, no Trajectory from .*foreign.*; allowed: a Trajectory"):
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
