"""A result is ok only if it is a finite trajectory of the scene on the grid whose invariants stay within its bounds."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest

import conservative as cv
from conservative import invariants
from conservative.attitude import axes_about, rotation_about
from conservative.errors import Diverged, InvalidResult, NotConserved
from conservative.grid import Grid
from conservative.invariants import kept_sizes
from conservative.method_info import MethodInfo
from conservative.methods.bounds import within_round_off
from conservative.outcome import OutcomeKind
from conservative.trajectory import Bounds, Trajectory

from ..bodies import impossible_body
from .one_body import BODY

BRICK = cv.scenes.brick_flip()
TOP = cv.scenes.lagrange_top()
GRID = Grid(0.01, 20, 3)
BRICK_INVARIANTS = frozenset({"energy", "momentum"})


@dataclass(frozen=True)
class Foreign(cv.Method):
    """A method of a user that changes the trajectory of a correct one."""

    spoil: Callable[[Trajectory], Any] = lambda good: good
    kept: frozenset[str] = frozenset()
    limit: float | None = None

    family: ClassVar[str] = "foreign"
    role: ClassVar[cv.Role] = cv.Role.OURS

    @property
    def order(self) -> int:
        return 2

    @property
    def conserves(self) -> frozenset[str]:
        return self.kept

    def bounds(self, scene: cv.Scene, grid: Grid) -> Bounds:
        return Bounds(self.limit, self.limit) if self.limit else super().bounds(scene, grid)

    def prepare(self, scene: cv.Scene, grid: Grid) -> Any:
        run = cv.Reduced().prepare(scene, grid)
        return lambda: self.spoil(run())


class WithKernel(Foreign):
    """The same method; compiled code checks its samples first."""

    method_info: ClassVar[MethodInfo] = MethodInfo(kernel="reduced")


kinds = pytest.mark.parametrize("kind", [Foreign, WithKernel])


def changed(name: str, at: Any, value: float) -> Callable[[Trajectory], Trajectory]:
    def spoil(good: Trajectory) -> Trajectory:
        array = getattr(good, name).copy()
        array[at] = value
        return replace(good, **{name: array})

    return spoil


def first(good: Trajectory, samples: slice, **more: Any) -> Trajectory:
    return replace(good, t=good.t[samples], R_WB=good.R_WB[samples], w_WB_B=good.w_WB_B[samples], **more)


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
    "one sample too few": lambda good: first(good, slice(-1)),
    "no sample": lambda good: first(good, slice(0)),
    "twice the times": lambda good: replace(good, t=2 * good.t),
    "one wrong time": changed("t", 3, 0.0901),
    "times that are not numbers": changed("t", 3, np.nan),
    "another initial state": changed("w_WB_B", (0, 0), 7.0),
    "a failed run that starts later": lambda good: first(good, slice(1, 5), failure=Diverged(0.09, "gave up")),
    "counters of another kind": lambda good: replace(good, counters={"steps": 20}),
    "a failure of another kind": lambda good: replace(good, failure="it did not work"),
}


@kinds
@pytest.mark.parametrize("name", INVALID)
def test_other_results_are_invalid(name: str, kind: type[Foreign]) -> None:
    run = kind(INVALID[name], BRICK_INVARIANTS).solve(BRICK, GRID)
    assert run.outcome.kind is OutcomeKind.INVALID
    assert run.scene is BRICK
    assert len(run) == 0
    assert run.outcome.reason


def test_integrate_raises_and_run_returns_the_failure() -> None:
    nothing = Foreign(INVALID["nothing"])
    with pytest.raises(InvalidResult, match=r"method: got a NoneType, not a Trajectory from .*foreign.*; expected a T"):
        cv.integrate(BRICK, method=nothing)
    assert nothing.run(BRICK, 0.1).outcome.kind is OutcomeKind.INVALID
    assert cv.integrate(BRICK, method=nothing, on_failure="return").outcome.kind is OutcomeKind.INVALID


@kinds
@pytest.mark.parametrize("number", [np.nan, np.inf])
@pytest.mark.parametrize("name", ["R_WB", "w_WB_B"])
def test_samples_end_before_the_first_that_is_not_finite(name: str, number: float, kind: type[Foreign]) -> None:
    method = kind(changed(name, (4, 1), number))
    run = method.solve(BRICK, GRID)
    assert isinstance(run.failure, Diverged)
    assert len(run) == 4
    assert run.failure.time == run.t[-1]
    with pytest.raises(Diverged):
        cv.integrate(BRICK, 0.01, method)
    nothing = kind(changed("R_WB", ..., np.nan)).solve(BRICK, GRID)
    assert (nothing.outcome.kind, len(nothing)) == (OutcomeKind.DIVERGED, 0)


@kinds
def test_orthonormality_is_checked_for_every_method(kind: type[Foreign]) -> None:
    run = kind(changed("R_WB", (5, 1, 1), 2.0)).solve(BRICK, GRID)
    assert isinstance(run.failure, NotConserved)
    assert (run.failure.quantity, len(run)) == ("orthonormality", 5)
    assert run.failure.drift > run.failure.bound == 0.1
    assert run.failure.time == run.t[-1]


@kinds
@pytest.mark.parametrize(
    ("scene", "quantity"),
    [(BRICK, "energy"), (BRICK, "momentum"), (TOP, "energy"), (TOP, "vertical momentum"), (TOP, "axial momentum")],
)
def test_an_invariant_is_checked_if_the_method_names_it(scene: cv.Scene, quantity: str, kind: type[Foreign]) -> None:
    faster = changed("w_WB_B", slice(3, None), 3.0)
    assert kind(faster).solve(scene, GRID).ok
    run = kind(faster, frozenset({quantity})).solve(scene, GRID)
    assert isinstance(run.failure, NotConserved)
    assert (run.failure.quantity, len(run)) == (quantity, 3)
    assert quantity in str(run.failure)


@kinds
@pytest.mark.parametrize("gain", [-1.5, -0.9, 0.9, 1.5])
def test_an_energy_that_is_wrong_by_more_than_its_scale_is_no_solution(gain: float, kind: type[Foreign]) -> None:
    scene = cv.Scene("up", cv.RigidBody((1, 1, 2)), np.eye(3), (0, 0, 0), 0.1, cv.UniformGravity(1, (0, 0, 1)))
    tilt = rotation_about((1, 0, 0), math.acos(min(1.0, 1 + gain)))  # lowers the centre of mass; the spin has the rest

    def spoil(good: Trajectory) -> Trajectory:
        R_WB, w_WB_B = np.broadcast_to(np.eye(3), (3, 3, 3)).copy(), np.zeros((3, 3))
        R_WB[1], w_WB_B[1, 2] = tilt, math.sqrt(max(gain, 0.0))
        return replace(good, R_WB=R_WB, w_WB_B=w_WB_B)

    grid = Grid(0.05, 2)
    engine = type("Engine", (kind,), {"role": cv.Role.ENGINE})
    assert engine(spoil).solve(scene, grid).ok
    run = kind(spoil).solve(scene, grid)
    assert run.ok is (abs(gain) < 1)
    if not run.ok:
        assert (run.outcome.kind, len(run)) == (OutcomeKind.DIVERGED, 1)
        assert run.outcome.reason == "the drift of energy is 1.5, the bound 1"


@kinds
def test_in_a_turning_field_the_jacobi_integral_is_checked(kind: type[Foreign]) -> None:
    scene = cv.scenes.tumbling_satellite()
    grid = Grid(scene.dt, 3)
    spoil = changed("w_WB_B", 2, 10 * float(np.linalg.norm(scene.w_WB_B0)))
    run = kind().check(scene, grid, spoil(cv.Taylor().prepare(scene, grid)()))
    assert (run.outcome.kind, len(run)) == (OutcomeKind.DIVERGED, 2)
    assert "Jacobi integral" in run.outcome.reason


def test_a_symplectic_method_whose_energy_is_lost_has_diverged() -> None:
    run = cv.integrate(cv.scenes.asymmetric_top(), 0.8, "splitting:order=2", 32000, 80, on_failure="return")
    assert run.outcome.kind is OutcomeKind.DIVERGED, run.outcome
    assert np.abs(run.drift("energy")).max() <= 1 < len(run)
    assert run.t[-1] < 4000  # 896 and 1,216 s of 25,600 s: the motion is chaotic, and compilers round differently


@kinds
@pytest.mark.parametrize(("share", "ok"), [(0.98, True), (1.02, False)])
def test_runs_are_ok_up_to_their_bounds(share: float, ok: bool, kind: type[Foreign]) -> None:
    def gain_energy(good: Trajectory) -> Trajectory:
        return replace(good, w_WB_B=good.w_WB_B * np.where(good.t == good.t[2], math.sqrt(1 + share * 1e-9), 1)[:, None])

    def stretch(good: Trajectory) -> Trajectory:
        return replace(good, R_WB=good.R_WB * np.where(good.t == good.t[1], math.sqrt(1 + share * 1e-9), 1)[:, None, None])

    assert kind(gain_energy, frozenset({"energy"}), 1e-9).solve(BRICK, GRID).ok is ok
    assert kind(stretch, frozenset(), 1e-9).solve(BRICK, GRID).ok is ok


@kinds
@pytest.mark.parametrize("value", [1.1, np.nan])
@pytest.mark.parametrize("name", ["t", "R_WB", "w_WB_B"])
def test_one_wrong_sample_is_noticed(name: str, value: float, kind: type[Foreign]) -> None:
    for sample in range(GRID.n_samples):

        def spoil(good: Trajectory, sample: int = sample) -> Trajectory:
            array = getattr(good, name).copy()
            array[sample] = array[sample] * value + 1e-3
            return replace(good, **{name: array})

        assert not kind(spoil, BRICK_INVARIANTS, 1e-9).solve(BRICK, GRID).ok


@pytest.mark.parametrize("n_steps", [1, 6, 7])
def test_the_compiled_check_is_enough_for_a_good_trajectory(n_steps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    grid = Grid(0.01, n_steps, 3)
    run = cv.Reduced().prepare(BRICK, grid)()
    for kind in (Foreign, WithKernel):
        assert kind(kept=BRICK_INVARIANTS).check(BRICK, grid, run) is run
    monkeypatch.setattr(invariants, "kept_sizes", None)
    assert WithKernel(kept=BRICK_INVARIANTS).check(BRICK, grid, run) is run


def test_a_run_that_ended_early_has_its_failure_and_its_samples() -> None:
    run = Foreign(lambda good: first(good, slice(4), failure=Diverged(0.09, "gave up"))).solve(BRICK, GRID)
    assert (len(run), run.outcome.reason) == (4, "gave up")


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
            body = impossible_body((tensor + tensor.T) / 2)
        except cv.BadInput:  # rounding has made it indefinite
            continue
        scene = cv.Scene("flat", body, np.eye(3), draw.normal(size=3), 1.0, cv.UniformGravity(1.0, (0.3, 0.2, 0.5)))
        for method in (cv.Projected(), cv.Reduced(), cv.Gauss()):
            run = method.solve(scene, Grid(0.01, 20))
            ended.append(run.ok)
            if run.ok:
                with np.errstate(all="raise"):
                    assert np.abs(run.drift(scene.invariants[0])).max() <= 1e-3
    assert len(ended) > 40  # the others are refused: their moments are too far apart
    assert not all(ended)


def test_bounds() -> None:
    def scene(*moments: float) -> cv.Scene:
        return cv.Scene("free", cv.RigidBody(moments), np.eye(3), (1, 2, 3), 1.0)

    ordinary, grid, rounding = scene(3.0, 4.0, 6.0), Grid(0.1, 90), 4 * sys.float_info.epsilon * 100
    assert Foreign().bounds(BRICK, GRID) == Bounds(drift=1e-3, orthonormality=0.1)
    assert within_round_off(None, ordinary, grid).drift == pytest.approx(rounding * 2, rel=1e-12, abs=0)
    assert within_round_off(None, scene(1.0, 7.0, 7.5), grid).drift == pytest.approx(rounding * 7.5, rel=1e-12, abs=0)
    assert within_round_off(None, ordinary, grid, tol=1e-9).drift == pytest.approx(10 * 90 * 1e-9, rel=1e-6, abs=0)
    assert within_round_off(None, ordinary, grid, tol=1.0).drift == 1e-3
    assert within_round_off(None, ordinary, grid).orthonormality == 1e-13
    loose = within_round_off(None, ordinary, grid, 1e-9, None)
    assert loose.orthonormality == loose.drift > 1e-7
    assert cv.Convected(1e-7).bounds(ordinary, grid) == within_round_off(None, ordinary, grid, 1e-7, None)
    assert cv.Substepped(most=8).bounds(ordinary, grid) == cv.Reduced().bounds(ordinary, Grid(0.0125, 720))


def near_anchor(gap: float) -> cv.Scene:
    """Return a fall past an attracting point, whose field magnifies the rounding of the attitude where the gap is small."""
    start = rotation_about((0, 0, 1), 3 * gap)
    field = cv.PointAttraction(1.0, (1.0, 0, 0), (1 + gap, 0, 0))
    return cv.Scene("near", cv.RigidBody((1.0, 1.2, 1.1)), start, (1e-3, 2e-3, -1e-3), 20 * gap**1.5, field)


@pytest.mark.parametrize("gap", [0.03, 0.01, 1e-4])
@pytest.mark.parametrize("method", [cv.Projected(), cv.Taylor(), cv.Reduced(4)], ids=lambda each: each.family)
def test_a_right_run_past_an_attracting_point_is_ok(method: cv.Method, gap: float) -> None:
    scene = near_anchor(gap)
    grid = Grid(scene.t_end / 200, 200)
    found = method.solve(scene, grid)
    assert found.ok  # the drift of the energy is 7e-16 over the square of the gap, and was allowed 2e-13
    drift = np.abs(found.drift("energy")).max()
    assert drift < 1e-15 / gap**2
    many = cv.integrate_many(scene, w_WB_B0=[scene.w_WB_B0, 2 * scene.w_WB_B0], dt=grid.dt, method=method, threads=1)
    assert many.ok.all()
    wrong = replace(found, w_WB_B=found.w_WB_B * (1 + np.linspace(0, 100, 201)[:, None] * 1e-15 / gap**2))
    assert isinstance(method.check(scene, grid, wrong).failure, NotConserved)


def test_momentum_is_relative_to_the_momentum_that_the_energy_can_make() -> None:
    falling = cv.Scene("near rest", BODY, np.eye(3), (1e-3, 0, 0), 1.0, cv.UniformGravity(2, (0, 0, 3)))
    (size,) = kept_sizes(falling, frozenset({"vertical momentum"})).values()
    assert size == pytest.approx(math.sqrt(2 * falling.energy_scale * BODY.moments.max()), rel=1e-12)
    (energy,) = kept_sizes(falling, frozenset({"energy"})).values()
    assert energy == falling.energy_scale


@kinds
@pytest.mark.parametrize("along", range(3))
@pytest.mark.parametrize("off", [1, 2])
def test_a_momentum_that_turns_is_not_conserved(along: int, off: int, kind: type[Foreign]) -> None:
    """The momentum is along one axis of the world. The last sample is turned, so that one other component changes."""
    w = np.array((0.3, -0.5, 0.4))
    L = BODY.inertia @ w
    axes = np.roll(axes_about(L / np.linalg.norm(L)), along - 2, axis=1)  # column `along` is the direction of the momentum
    scene = cv.Scene("turned", BODY, axes.T, w, 1.0)

    def turn(good: Trajectory) -> Trajectory:
        R_WB = good.R_WB.copy()
        R_WB[-1] = rotation_about(np.eye(3)[(along + off) % 3], 0.01) @ R_WB[-1]
        return replace(good, R_WB=R_WB)

    grid, kept = Grid(0.01, 3), frozenset({"momentum"})
    assert kind(kept=kept).solve(scene, grid).ok
    run = kind(turn, kept).solve(scene, grid)
    assert run.outcome.kind is cv.OutcomeKind.NOT_CONSERVED
    assert len(run) == 3
