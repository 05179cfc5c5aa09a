"""The projection of a state onto its invariants, against NumPy."""

import numpy as np
import pytest

import conservative as cv
from conservative.kernels import projected, reduced

from .exact_motion import TURN, in_field

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
    kept = projected.values(inverse, field, axis, None, q, triple(L))
    for away in (1e-3, 1e-6):
        moved_q, moved_L = triple(np.array(q) + away * np.array([1, 2, -1, 0.5])), triple(L + away * np.array([1, -2, 3]))
        back_q, back_L, corrections, defect = projected.project(inverse, field, axis, None, kept, scales, moved_q, moved_L)
        now = projected.values(inverse, field, axis, None, back_q, back_L)
        np.testing.assert_allclose(now, kept, atol=4e-15)
        assert defect <= 2.0**-51
        assert 1 <= corrections <= 3
        assert np.linalg.norm(back_q) == pytest.approx(1, abs=1e-10)
        assert np.abs(np.subtract(back_L, moved_L)).max() < 10 * away


def test_projected_leaves_a_state_that_is_too_far_away():
    field, axis, scales = FIELD, (0.0, 0.0, 1.0), (3.0, 2.0)
    inverse = triple(1 / J)
    kept = projected.values(inverse, field, axis, None, Q, triple(L))
    for factor, corrected in ((1.02, True), (1.5, False)):
        _, found, corrections, defect = projected.project(inverse, field, axis, None, kept, scales, Q, triple(factor * L))
        assert (corrections > 0) == corrected == (defect < 1e-15)
        assert corrected or found == triple(factor * L)
    failed = cv.Projected().prepare(in_field("gravity"), cv.Grid(4.0, 6, 1))()
    assert failed.outcome.kind is cv.OutcomeKind.NOT_CONVERGED
    assert failed.outcome.residual > 1e-6
    assert failed.counters.evaluations == 12 * failed.counters.steps


def test_projected_moves_the_state_least():
    """The correction is in the plane of the two gradients, and first order in what is asked for."""
    field, size, w = FIELD, 2.0, L / J
    for axis in (None, (0.0, 0.0, 1.0)):
        e, m = 1e-5, (0.0 if axis is None else -2e-5)
        dL, turn = projected.shortest_move(triple(1 / J), field, axis, None, size, e, m, Q, triple(L))
        T = np.array(reduced.body_torque(field, Q))
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
    kept = np.add(projected.values(inverse, FIELD, (0.0, 0.0, 1.0), None, Q, triple(L)), off)
    found = projected.project(inverse, FIELD, (0.0, 0.0, 1.0), None, triple(kept), scales, Q, triple(L))
    assert found[2:] == (0, pytest.approx(defect))
