"""Parts of kernels and their runner whose faults whole runs hide: carries, limits of trust, failures, rare steps."""

from __future__ import annotations

from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from mpmath import MPContext
from numba import njit

import conservative as cv
from conservative.attitude import angle_between
from conservative.grid import Grid
from conservative.kernels import gauss, reduced, twofold
from conservative.kernels import polhode as polhode_kernel
from conservative.kernels.compiler import vector
from conservative.kernels.protocol import Output, Result, Workspace, deliver
from conservative.kernels.samples import END
from conservative.methods import reduced as reduced_method
from conservative.methods.coefficients.gauss_legendre import tableau
from conservative.methods.gauss import convert, find_coefficients
from conservative.methods.moser_veselov import find_polhode
from conservative.methods.principal_axes import principal_start
from conservative.methods.run_kernel import prepare_run

from .test_large_steps import free_body, heavy_body

J, H = (1.0, 1.4, 2.0), 0.5
INVERSE = tuple(1 / x for x in J)
Q, L = (1.0, 0.0, 0.0, 0.0), (0.5, -0.4, 0.9)
CARRY = (1e-9, -2e-9, 3e-9)
"""Larger than any carry of a run, so that one step shows it."""
TIGHT = 1e-24


def compiled(function: Any) -> Any:
    """A function that only kernels call, compiled for Python."""
    return njit(lambda *arguments: function(*arguments))


def gain_of_steps(start: np.ndarray, carry: tuple[float, ...]) -> np.ndarray:
    """Return the gain of a step of the loop for the momentum `start` less `carry`."""
    lengths, q_out, L_out = np.array([H]), np.empty((2, 4)), np.empty((2, 3))
    state = (Q, (0.0, 0.0, 0.0, 0.0), tuple(start.tolist()), carry, ())
    history = reduced.no_history()
    found = compiled(reduced.take_steps)(
        lengths, 1, 1, 1, J, INVERSE, None, None, TIGHT, (1, 0), 0, state, history, q_out, L_out
    )
    _, _, after, left, _ = found[4]
    return np.array(after) - left - (start - carry)


def gain_of_branch(start: np.ndarray, carry: tuple[float, ...]) -> np.ndarray:
    """Return the same gain by continuation."""
    found = reduced.continue_branch(H, J, INVERSE, None, None, Q, tuple(start.tolist()), carry, TIGHT)
    return np.array(found[1]) - found[2] - (start - carry)


@pytest.mark.parametrize("gain", [gain_of_steps, gain_of_branch])
def test_the_last_correction_includes_the_carry_of_the_momentum(gain) -> None:
    exact = gain(np.array(L) - CARRY, (0.0, 0.0, 0.0))
    assert np.abs(gain(np.array(L), CARRY) - exact).max() < 1e-14  # measured 2e-16
    assert np.abs(gain(np.array(L), (0.0, 0.0, 0.0)) - exact).max() > 1e-10  # measured 3e-9: what a forgotten carry does


def trust(size: float, near: float, momentum: tuple[float, ...] = L) -> bool:
    """Return whether Newton's method is trusted from a guess at the squared distance `size` |a|^2 from the solution a."""
    a = np.array(reduced.continue_branch(H, J, INVERSE, None, None, Q, momentum, (0.0, 0.0, 0.0), 1e-20)[0])
    aside = np.array([0.0, 0.6, -0.8]) * np.sqrt(size) * np.linalg.norm(a)
    guess = tuple((a + aside).tolist())
    *_, trusted = reduced.newton_solve(H, J, None, None, Q, momentum, (0.0, 0.0, 0.0), guess, near, 1e-8)
    return bool(trusted)


def test_newton_is_trusted_only_near_its_guess() -> None:
    assert trust(0.2, reduced.NEAR)
    assert not trust(0.4, reduced.NEAR)
    assert trust(0.005, reduced.NEAR_TANGENT)
    assert not trust(0.03, reduced.NEAR_TANGENT)


def test_newton_is_trusted_no_farther_from_a_small_solution() -> None:
    small = tuple(1e-3 * x for x in L)  # |a| = 1.5e-4
    a = np.linalg.norm(reduced.continue_branch(H, J, INVERSE, None, None, Q, small, (0.0, 0.0, 0.0), 1e-20)[0])
    assert trust(7e-5 / a**2, 0.0, small)
    assert not trust(3e-4 / a**2, 0.0, small)


KINDS = (
    (cv.Reduced(), cv.scenes.lagrange_top(), 0.50, cv.OutcomeKind.WRONG_BRANCH),
    (cv.Reduced(), cv.scenes.lagrange_top(), 0.55, cv.OutcomeKind.NOT_CONVERGED),
    (cv.Gauss(3), heavy_body(16), 6.0, cv.OutcomeKind.NOT_CONVERGED),
)


@pytest.mark.parametrize(("method", "scene", "dt", "kind"), KINDS)
def test_a_step_is_on_the_wrong_branch_only_if_it_has_another_solution(method, scene, dt, kind) -> None:
    assert method.prepare(scene, Grid(dt, 1))().outcome.kind is kind


def test_weights_of_gauss_have_a_low_part_and_it_is_added() -> None:
    for stages in (3, 5, 10):
        mp, table = MPContext(), tableau(stages)
        mp.dps = 40
        for node, high, low in zip(table.c, table.b, table.b_low, strict=True):
            x = mp.findroot(lambda x: mp.legendre(stages, x), mp.mpf(float(2 * node - 1)))  # noqa: B023
            exact = 1 / ((1 - x**2) * mp.diff(lambda x: mp.legendre(stages, x), x) ** 2)  # noqa: B023
            assert abs(high + mp.mpf(low) - exact) < 1e-30
        assert np.abs(table.b_low).max() > 0
        assert find_coefficients(stages, 0.1).b_low[:stages].tolist() == table.b_low.tolist()


def test_a_step_of_gauss_adds_both_parts_of_the_weights() -> None:
    b, low = np.array([0.25, 0.5, 0.25, 0.0]), np.array([0.0, 0.125, 0.0, 0.0])
    F = np.concatenate([np.full(24, np.nan), np.repeat([1.0, 2, 3, 4, 5, 6], 4)])
    dL, dg = compiled(gauss.weigh)(b, low, F, 24)
    assert (*dL, *dg) == tuple(1.125 * k for k in (1, 2, 3, 4, 5, 6))


def test_gauss_takes_round_off_of_its_invariants_off_and_leaves_the_rest_alone() -> None:
    inverse, c, none, loose = (1.0, 0.5, 0.4), (0.3, -0.2, 0.1), (0.0, 0.0, 0.0), (1.0, 1.0, 0.0)
    L, g = (0.6, 0.5, -0.4), (2 / 3, 1 / 3, -2 / 3)
    kept, remove_round_off = gauss.values(inverse, None, c, L, g), compiled(gauss.remove_round_off)
    assert remove_round_off(inverse, None, c, loose, kept, 1.0, L, none, g, none) == (L, none, g, none)
    far_L, far_g = tuple(x + 3e-9 * k for k, x in enumerate(L)), tuple(x * (1 + 2e-9) + 5e-9 * k for k, x in enumerate(g))
    near_L, lost_L, near_g, lost_g = remove_round_off(inverse, None, c, loose, kept, 1.0, far_L, none, far_g, none)
    assert gauss.values(inverse, None, c, near_L, near_g) == pytest.approx(kept, abs=1e-15)  # from 5e-9, measured 1e-16
    assert np.linalg.norm(near_g) == pytest.approx(1, abs=1e-15)
    assert 1e-10 < np.abs(np.subtract(near_L, far_L)).max() < 1e-8
    assert near_L[2] == far_L[2]
    assert np.abs([*lost_L, *lost_g]).max() < 2e-16


@pytest.mark.parametrize("turns", [[2.0**53, 1, 1, 1, 1, 1], [2.0**53, -0.5, -0.25, -0.5, -0.5], [1.0, 2.0**53, 1, 3, 3, 0.25]])
def test_the_angle_of_gauss_is_a_sum_without_loss(turns: list[float], monkeypatch: pytest.MonkeyPatch) -> None:
    """The loop in Python, with made-up integrals and no stages: each angle stored is the exact sum, rounded once."""
    stored, left, none = [], iter(turns), (0.0, 0.0, 0.0)
    for name, result in (("hold_rates", None), ("sweep", None), ("solve_stages", (0, 1, 0.0, True)), ("weigh", (none, none))):
        monkeypatch.setattr(gauss, name, lambda *_, result=result: result)
    monkeypatch.setattr(gauss, "middle", lambda *_: (0.0, 0.0, 1.0))
    monkeypatch.setattr(gauss, "remove_round_off", lambda *state: state[6:])
    monkeypatch.setattr(gauss, "integrate_turn", lambda *_: next(left))
    monkeypatch.setattr(gauss, "store", lambda row, turned, phi, *_: stored.append(phi))
    gauss.march(convert(heavy_body(1), cv.Gauss(2))[2], find_coefficients(2, 0.01), (len(turns), 1, 0, None, None))
    exact = Fraction(0)
    for phi, turn in zip(stored[1:], turns, strict=True):
        exact += Fraction(turn)
        assert abs(Fraction(phi) - exact) <= Fraction(np.spacing(float(exact))) / 2


@pytest.mark.parametrize(("dt", "parts"), [(0.2, 1), (0.4, 2), (0.7, 3), (1.0, 4), (1.3, 5)])
def test_steps_past_half_a_nutation_are_divided(dt: float, parts: int) -> None:
    # Half a nutation takes 0.3 s.
    scene = cv.scenes.lagrange_top()
    long = cv.Lame().prepare(scene, Grid(dt, 12))()
    short = cv.Lame().prepare(scene, Grid(dt / 64, 12 * 64, 64))()
    assert long.counters.stages == 12 * parts
    assert angle_between(long.R_WB, short.R_WB).max() < 1e-11  # measured 7e-14


def test_series_of_moser_and_veselov_have_the_terms_of_every_order() -> None:
    # Half as many as the highest order: compiled code does not check the bounds of an array.
    polhode = find_polhode(free_body(2))[1]
    orders = [method.order for method in map(cv.MoserVeselov, range(2, 11, 2))]
    assert max(orders) == 10
    with pytest.raises(cv.BadInput):
        cv.MoserVeselov(12)
    for series in polhode_kernel.calibration_series(polhode, 0.1):
        assert len(series) >= max(orders) // 2


@pytest.mark.parametrize("order", [2, 4, 6, 8, 10])
def test_a_step_of_moser_and_veselov_has_the_error_of_its_order(order: int) -> None:
    polhode = find_polhode(free_body(2))[1]

    def error(h: float) -> float:
        steps = (polhode_kernel.preprocessed_step(polhode, h, order), polhode_kernel.exact_step(polhode, h))
        found, exact = (np.array(polhode_kernel.normalise(step)) for step in steps)
        return float(np.abs(found - exact).max())

    assert np.log2(error(0.8) / error(0.4)) == pytest.approx(order + 1, abs=0.6)


BRICK = cv.scenes.brick_flip()


@pytest.mark.parametrize("pause", [4, 5, 7])
def test_pauses_do_not_change_samples(pause):
    model, coefficients = reduced_method.convert(BRICK, cv.Reduced())[2], reduced_method.find_coefficients(2, 0.01)
    found = []
    for length in (0, pause):
        q, L = np.zeros((8, 4)), np.zeros((8, 3))
        reduced.enter(*model, *coefficients, 20, 3, length, q, L, np.zeros(END), np.empty((0, 3, 3)), np.empty((0, 3)))
        found.append((q, L))
    for whole, parts in zip(*found, strict=True):
        np.testing.assert_allclose(parts, whole, rtol=1e-12, atol=1e-14)


def test_a_long_quaternion_is_divided_with_its_carry():
    q, carry = (1.3, -0.4, 0.7, 0.2), (1e-3, -2e-3, 3e-3, 4e-3)
    ends = (0.0, 0.6, 0.8), (0.6, 0.0, 0.8)
    long = gauss.LONGEST
    short, left = gauss.carry_attitude(q, carry, (0.0, 0.0, 1.0), 1.0, *ends)
    divided = gauss.carry_attitude(tuple(long * x for x in q), tuple(long * x for x in carry), (0.0, 0.0, 1.0), 1.0, *ends)
    assert divided == (short, left)
    assert max(map(abs, left)) > 0


def plain(function: Any) -> Any:
    """Return a kernel as a Python function, so that nothing is compiled."""
    return getattr(function, "py_func", function)


def test_a_compensated_sum_has_no_rounding_error():
    total, carry = 1.0, 0.0
    for _ in range(1000):
        total, carry = plain(vector.accumulate)(total, carry, 1e-17)
    assert total == 1.0 + 45 * 2.0**-52  # 1e-14
    assert total - carry == pytest.approx(1.0 + 1e-14, abs=3e-16)


def exact(x):
    return Fraction(x[0]) + Fraction(x[1])


@pytest.mark.parametrize("seed", range(4))
def test_twofold_numbers_have_thirty_digits(seed):
    rng = np.random.default_rng(seed)

    def number():
        high = float(rng.normal())
        return (high, float(high * 1e-17 * rng.uniform(-1, 1)))

    x, y, f = number(), number(), float(rng.normal())
    for found, expected in (
        (twofold.plus(x, y), exact(x) + exact(y)),
        (twofold.minus(x, y), exact(x) - exact(y)),
        (twofold.times(x, y), exact(x) * exact(y)),
        (twofold.scale(f, x), Fraction(f) * exact(x)),
        (twofold.over(x, y), exact(x) / exact(y)),
        (twofold.two(f), Fraction(f)),
    ):
        size = max(abs(expected), abs(exact(x)), abs(exact(y))) if expected else 1
        assert abs(exact(found) - expected) <= size * Fraction(1, 10**30)
        assert found[0] + found[1] == found[0]


SCENE = cv.Scene("free", cv.RigidBody((1, 2, 2.5)), np.eye(3), (0.3, 0.2, 1), 1.0)
GRID = Grid(0.1, 6)


def run(done=GRID.n_steps, bad=(), elsewhere=False):
    """Return the trajectory of a made-up kernel that takes `done` steps; the samples `bad` are not finite."""

    def enter(n_steps, every, pause, q, L, *output):
        q[:], L[:] = (1.0, 0.0, 0.0, 0.0), (0.3, 0.4, 2.5)
        for sample in bad:
            q[sample] = np.nan
        result = Result(done, done, 0, None, 0.25, elsewhere)
        return deliver(result, Workspace(n_steps, every, pause, q, L), Output(*output))

    kernel = SimpleNamespace(enter=enter, FAILURE="planted", PAUSE=7)
    return prepare_run(SCENE, GRID, "planted", principal_start(SCENE), kernel, (), ())()


@pytest.mark.parametrize("bad", [(3,), (3, 4, 5, 6), (6,), (1,)])
def test_a_state_that_is_not_finite_is_a_failure_that_ends_the_samples_before_it(bad):
    found = run(bad=bad)
    assert isinstance(found.failure, cv.Diverged)
    assert len(found) == bad[0]
    assert found.outcome.time == found.t[-1] == GRID.t[bad[0] - 1]
    assert np.isfinite(found.R_WB).all()


@pytest.mark.parametrize(("elsewhere", "kind"), [(False, cv.NotConverged), (True, cv.WrongBranch)])
def test_a_step_without_a_solution_is_named_with_the_time_of_the_last_good_state(elsewhere, kind):
    found = run(done=2, bad=(3, 4, 5, 6), elsewhere=elsewhere)
    assert type(found.failure) is kind
    assert (found.outcome.step, found.outcome.time, found.outcome.residual) == (3, 2 * GRID.dt, 0.25)
    assert len(found) == 3


def test_a_whole_run_is_a_trajectory_of_its_own():
    found = run()
    built = cv.Trajectory(SCENE, GRID.t, found.R_WB, found.w_WB_B, "planted", cv.Counters(6, 6, 0, None))
    assert not set(vars(built)) - {"t"} - set(vars(found))
    assert vars(found.counters) == vars(built.counters)
    np.testing.assert_array_equal(found.t, GRID.t)
    assert (found.failure, found.choice, found.label) == (None, None, "planted")
    again = cv.Reduced().prepare(SCENE, GRID)
    one, other = again(), again()
    for name in ("t", "R_WB", "w_WB_B"):
        assert not np.shares_memory(getattr(one, name), getattr(other, name))
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
