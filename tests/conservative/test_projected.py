"""Explicit steps projected onto the invariants, against `Reduced` of high order in every field, and the projection."""

import math
from dataclasses import replace

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between, orthonormality, rotation_about
from conservative.kernels import projected
from conservative.kernels.fields import body_torque
from conservative.methods.coefficients import explicit
from conservative.methods.coefficients.explicit import DORMAND_PRINCE_8, ExplicitTableau
from conservative.methods.projected import convert

from .. import independent
from ..independent import Case, motion
from .one_body import body_in_axes, drift, in_field

TURN = rotation_about((1, -2, 0.5), 1.1)
BODY = body_in_axes(TURN, 0.9, 1.7, 1.2)
COM = np.array((0.3, -0.2, 0.4))
FIELDS = {
    "gravity": cv.UniformGravity(4.0, COM),
    "spring": cv.LinearSpring(3.0, COM, (1.0, 0.5, -0.8), 0.4),
    "attraction": cv.PointAttraction(2.0, COM, (1.0, 0.5, -0.8)),
    "gravity gradient": cv.GravityGradient(1.3, BODY.inertia, (0.3, -0.5, 0.8)),
    "two functions": cv.FunctionPotential(
        lambda R: (R[2] @ COM) ** 3,
        lambda R: 3 * (R[2] @ COM) ** 2 * np.outer((0, 0, 1), COM),
        axis_W=np.array((0.0, 0.0, 1.0)),
    ),
    "no axis": cv.FunctionPotential(
        lambda R: (R[0] @ COM) * (R[2] @ COM), lambda R: np.outer((R[2] @ COM, 0, R[0] @ COM), COM)
    ),
}
SLOW = ("two functions", "no axis")
"""Fields that call Python."""


def scene(field: str, t_end: float = 2.0) -> cv.Scene:
    return cv.Scene("generic", BODY, rotation_about((0.3, -0.5, 0.8), 0.7), (1.2, -2.0, 0.7), t_end, FIELDS[field])


@pytest.mark.parametrize("field", FIELDS)
def test_agrees_with_a_method_that_shares_no_code(field: str) -> None:
    # `Reduced` of order 8 solves equations with a finite derivative and does not use the torque.
    end = 0.2 if field in SLOW else 2.0
    truth = cv.integrate(scene(field, end), 0.01, cv.Reduced(order=8))
    trajectory = cv.integrate(scene(field, end), 0.02, cv.Projected())
    assert angle_between(truth.R_WB[-1], trajectory.R_WB[-1]) < 2e-14  # measured up to 2.1e-15
    assert np.abs(truth.w_WB_B[-1] - trajectory.w_WB_B[-1]).max() < 3e-14  # measured up to 3.4e-15


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("dt", [0.02, 0.3])
def test_conserves_every_invariant(field: str, dt: float) -> None:
    end = 3.0 if field in SLOW else 300.0
    trajectory = cv.integrate(scene(field), dt, cv.Projected(), t_end=end)
    assert drift(trajectory) < 4e-15  # measured up to 1.4e-15
    assert orthonormality(trajectory.R_WB).max() < 1e-14  # measured 1.6e-15


@pytest.mark.parametrize("field", ["gravity", "gravity gradient"])
def test_is_of_order_eight(field: str) -> None:
    truth = cv.integrate(scene(field), 0.005, cv.Projected()).R_WB[-1]
    coarse, fine = (angle_between(truth, cv.integrate(scene(field), 2.0 / n, cv.Projected()).R_WB[-1]) for n in (8, 16))
    assert np.log2(coarse / fine) == pytest.approx(8, abs=0.6)  # measured 7.63 and 8.05


def test_a_steady_precession_whose_invariants_depend_on_each_other() -> None:
    # The paper's top precesses steadily, so that the gradients of energy and momentum are parallel.
    for dt, allowed in ((0.005, 2e-15), (0.01, 1e-11)):  # measured 4.5e-16 and 3.3e-12
        trajectory = cv.integrate(cv.scenes.lagrange_top(t_end=2.0), dt, cv.Projected())
        assert drift(trajectory) < allowed


def test_a_body_at_rest_in_equilibrium_stays() -> None:
    trajectory = cv.integrate(cv.scenes.hanging_rest(), 0.1, cv.Projected())
    assert angle_between(trajectory.R_WB[0], trajectory.R_WB[-1]) < 1e-15  # measured 0


def largest_defect(found: ExplicitTableau) -> float:
    """Return the largest defect of sum b c^k = 1/(k+1) below the order, of these chains with one more A, and of chains of A."""
    defects, tall = [], [1.0] * len(found.b)
    for k in range(found.order):
        defects.append(math.fsum(b * x for b, x in zip(found.b, tall, strict=True)) - 1 / math.factorial(k + 1))
        tall = [math.fsum(a * x for a, x in zip(row, tall, strict=False)) for row in found.A]
        powers = [c**k for c in found.c]
        chained = [math.fsum(a * p for a, p in zip(row, powers, strict=False)) for row in found.A]
        defects.append(math.fsum(b * p for b, p in zip(found.b, powers, strict=True)) - 1 / (k + 1))
        if k + 1 < found.order:
            defects.append(math.fsum(b * p for b, p in zip(found.b, chained, strict=True)) - 1 / ((k + 1) * (k + 2)))
    return max(map(abs, defects))


TABLEAUS = {name: each for name, each in vars(explicit).items() if isinstance(each, ExplicitTableau)}


@pytest.mark.parametrize("name", TABLEAUS)
def test_conditions_of_the_order(name: str) -> None:
    tableau = TABLEAUS[name]
    assert [len(row) for row in tableau.A] == list(range(len(tableau.b)))
    assert largest_defect(tableau) < 1e-13  # measured 7e-16
    assert largest_defect(replace(tableau, order=tableau.order + 1)) > 1e-5  # measured 2.7e-5


def test_the_conditions_show_a_wrong_digit() -> None:
    for digit, node in enumerate(DORMAND_PRINCE_8.c):
        b = list(DORMAND_PRINCE_8.b)
        b[digit] += 1e-9
        if node > 0 or digit == 0:
            assert largest_defect(replace(DORMAND_PRINCE_8, b=tuple(b))) > 1e-13
    rows = [list(row) for row in DORMAND_PRINCE_8.A]
    rows[11][6] += 1e-9
    assert largest_defect(replace(DORMAND_PRINCE_8, A=tuple(tuple(row) for row in rows))) > 1e-13


J = np.array([1.0, 1.4, 2.0])
L = np.array([0.8, -1.9, 1.1])
Q = (0.5, -0.5, 0.5, 0.5)
FIELD = in_field("gravity").potential.kernel_field(TURN)


def triple(v):
    return tuple(float(x) for x in v)


def test_projected_brings_a_state_back_to_its_invariants():
    scene = in_field("gravity")
    field, axis, scales = scene.potential.kernel_field(TURN), (0.0, 0.0, 1.0), (3.0, 2.0)
    inverse, q = triple(1 / J), (0.5, -0.5, 0.5, 0.5)
    kept = projected.values(inverse, None, field, axis, None, q, triple(L))
    for away in (1e-3, 1e-6):
        moved_q, moved_L = triple(np.array(q) + away * np.array([1, 2, -1, 0.5])), triple(L + away * np.array([1, -2, 3]))
        back_q, back_L, corrections, defect = projected.project(
            inverse, None, field, axis, None, kept, scales, moved_q, moved_L
        )
        now = projected.values(inverse, None, field, axis, None, back_q, back_L)
        np.testing.assert_allclose(now, kept, atol=4e-15)
        assert defect <= 2.0**-51
        assert 1 <= corrections <= 3
        assert np.linalg.norm(back_q) == pytest.approx(1, abs=1e-10)
        assert np.abs(np.subtract(back_L, moved_L)).max() < 10 * away


def test_projected_does_not_change_a_state_that_is_too_far_away():
    field, axis, scales = FIELD, (0.0, 0.0, 1.0), (3.0, 2.0)
    inverse = triple(1 / J)
    kept = projected.values(inverse, None, field, axis, None, Q, triple(L))
    for factor, corrected in ((1.02, True), (1.5, False)):
        _, found, corrections, defect = projected.project(inverse, None, field, axis, None, kept, scales, Q, triple(factor * L))
        assert (corrections > 0) == corrected == (defect < 1e-15)
        assert corrected or found == triple(factor * L)
    failed = cv.Projected().prepare(in_field("gravity"), cv.Grid(4.0, 6, 1))()
    assert failed.outcome.kind is cv.OutcomeKind.NOT_CONVERGED
    assert failed.outcome.residual > 1e-6
    assert failed.counters.evaluations == 12 * failed.counters.steps


def test_projected_moves_the_state_least():
    # The correction is in the plane of the two gradients, and first order in the defects.
    field, size, w = FIELD, 2.0, L / J
    for axis in (None, (0.0, 0.0, 1.0)):
        e, m = 1e-5, (0.0 if axis is None else -2e-5)
        T = np.array(body_torque(field, Q))
        dL, turn = projected.shortest_move(triple(w), triple(T), None, axis, size, e, m, Q, triple(L))
        assert w @ dL - T @ turn == pytest.approx(e, rel=1e-6)
        gradients = [np.concatenate([size * w, -T])]
        if axis is not None:
            v = np.array(projected.in_body(Q, axis))
            gradients.append(np.concatenate([size * v, np.cross(L, v)]))
            assert v @ dL + np.cross(L, v) @ turn == pytest.approx(m, rel=1e-6)
        move = np.concatenate([np.array(dL) / size, turn])
        left = np.linalg.lstsq(np.array(gradients).T, move, rcond=None)[1]
        assert left < 1e-22


@pytest.mark.parametrize(("off", "defect"), [((30.0, 0.0), 10.0), ((0.0, -30.0), 15.0)])
def test_defects_are_relative_to_the_scale_of_their_invariant(off, defect):
    inverse, scales = triple(1 / J), (3.0, 2.0)
    kept = np.add(projected.values(inverse, None, FIELD, (0.0, 0.0, 1.0), None, Q, triple(L)), off)
    found = projected.project(inverse, None, FIELD, (0.0, 0.0, 1.0), None, triple(kept), scales, Q, triple(L))
    assert found[2:] == (0, pytest.approx(defect))


@pytest.mark.parametrize(("defect", "done"), [(1e-16, 3), (1e-7, 3), (1e-5, 0), (1e-2, 0), (1.0, 0), (np.nan, 0)])
def test_a_step_that_ends_away_from_its_invariants_is_a_failure(defect, done, monkeypatch):
    # The loop runs in Python with a made-up projection: a real one ends on the invariants or far from them.
    monkeypatch.setattr(projected, "take_step", lambda *given: given[-3:-1])
    monkeypatch.setattr(projected, "project", lambda *given: (*given[-2:], 8, defect))
    monkeypatch.setattr(projected, "record_supply", lambda *given: None)  # machine code only, and no loads here
    monkeypatch.setattr(projected, "sum_supply", lambda *given: given[-1])
    coefficients = projected.Coefficients(*DORMAND_PRINCE_8.packed, np.array(DORMAND_PRINCE_8.c), 0.1)
    march = getattr(projected.march, "py_func", projected.march)
    found = march(convert(scene("gravity"), cv.Projected())[2], coefficients, (3, 1, 0, np.empty((4, 4)), np.empty((4, 3))))
    assert found.done == done
    assert found.size == pytest.approx(defect, nan_ok=True)


def near_rest(off: float, t_end: float) -> Case:
    """Return a body that starts at rest, `off` rad from its unstable equilibrium opposite of the anchor of a spring."""
    point, R = np.array((0.3, 0.5, 0.8)) / math.sqrt(0.98), rotation_about((0.3, 0.4, -0.8), 0.94)
    away = rotation_about(np.cross(R @ point, (0.1, 0.2, 1.0)), math.pi - off) @ (R @ point)
    return Case((1.3, 1.0, 0.6), R, (0.0, 0.0, 0.0), t_end, ("spring", 1.0, point, 1.01 * away, 0.0))


@pytest.mark.parametrize("off", [1e-3, pytest.param(1e-5, marks=pytest.mark.slow)])
def test_a_start_at_rest_near_an_equilibrium_is_not_moved_by_round_off(off: float) -> None:
    # The gradient of the energy is short there: the correction of round-off was 1e-11 rad in each step, more with more steps.
    case = near_rest(off, 12.0 - math.log(off))
    times = np.linspace(0.0, case.t_end, 13)
    truth = motion(case, times)[0]
    for n in (50, 200, 800):  # measured at most 1.2e-11 and 3.4e-9; with round-off corrected 1.4e-9 and 1.6e-6
        run = cv.integrate(case.scene(), case.t_end / (12 * n), cv.Projected(), sample_every=n)
        assert independent.angle_between(run.R_WB, truth).max() < 2e-13 / off


@pytest.mark.attack
def test_random_starts_at_rest_near_an_equilibrium() -> None:
    # Errors are compared with what 1e-15 rad at the start make of the motion.
    for seed in range(8):
        draw = np.random.default_rng(seed)
        J, point, axis = draw.uniform(1.0, 1.9, 3), draw.standard_normal(3), draw.standard_normal(3)
        R, off = rotation_about(axis, draw.uniform(0, 3)), 10 ** draw.uniform(-6, -2)
        turn = math.pi - off if draw.random() < 0.7 else off
        anchor = draw.uniform(0.3, 1.5) * (rotation_about(np.cross(R @ point, draw.standard_normal(3)), turn) @ (R @ point))
        field = ("spring", 1.0, point, anchor, 0.0) if seed % 2 else ("gravity", 2.0, R.T @ np.array((0, 0, 1.0)))
        start = rotation_about((1, 2, 0), off) @ R if seed % 2 == 0 else R
        case = Case(tuple(J), start, (0.0, 0.0, 0.0), 12.0, field)
        times = np.linspace(0.0, case.t_end, 5)
        truth = motion(case, times)[0]
        moved = motion(replace(case, R0=rotation_about((1, 1, 1), 1e-15) @ start), times)[0]
        allowed = 30 * independent.angle_between(truth, moved).max() + 1e-11
        for n in (400, 1600):
            run = cv.integrate(case.scene(), case.t_end / (4 * n), cv.Projected(), sample_every=n)
            error = independent.angle_between(run.R_WB, truth).max()
            assert error < allowed, (seed, n, error, allowed)
