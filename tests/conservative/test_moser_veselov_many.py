"""Moser-Veselov steps of many bodies at once: those of one body at a time, whoever the neighbours are."""

from __future__ import annotations

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import rotation_about
from conservative.kernels import COMPILED, kernel
from conservative.kernels import moser_veselov_many as lanes
from conservative.kernels.lanes import load_rows, save_rows
from conservative.kernels.moser_veselov import Shift, State, take_steps
from conservative.methods import columns
from conservative.methods.many import Block, Bodies

SCENE = cv.Scene("one of many", cv.RigidBody((1, 2, 2.5)), np.eye(3), (0.3, -1.0, 0.7), 30.0)
KINDS = (
    ((1, 1, 1.7), (0.4, -0.3, 2)),
    ((1.7, 1, 1.7), (0.4, -0.3, 0)),
    ((0.5, 1.7, 1.7), (0, -0.3, 1.1)),
    ((1, 1 + 1e-12, 1.7), (0.4, -0.3, 2)),
    ((1.3, 1.3, 1.3), (0.4, -0.3, 2)),
    ((1, 2, 2.5), (0, -2, 0)),
    ((1, 2, 2.5), (0, 0, 0)),
    ((1e-30, 2e-30, 2.5e-30), (1, 2, 0.3)),
    ((2, 3, 6), (1.0, 2.0, 1 / 3)),  # on the separatrix, where w3^2 = w1^2 J1 (J2 - J1) / (J3 (J3 - J2))
    ((2, 3, 6), (1.0, 2.0, 1 / 3 + 1e-9)),
)


def mixed(n: int) -> Bodies:
    """Bodies of all kinds, in axes that are those of the body first and then turned, and random ones."""
    random = np.random.default_rng(14)
    masses = 10 ** random.uniform(-1, 0, (n, 3)) * 10.0 ** random.integers(-9, 9, (n, 1))
    moments, w, turned = masses.sum(axis=1, keepdims=True) - masses, random.normal(size=(n, 3)), np.empty((n, 3, 3))
    moments[: len(KINDS)], w[: len(KINDS)] = ([kind[part] for kind in KINDS] for part in (0, 1))
    for i in range(n):
        turned[i] = np.eye(3) if i < len(KINDS) else rotation_about(random.normal(size=3), 2.0)
    inertia = turned @ (moments[:, :, None] * turned.transpose(0, 2, 1))
    start = np.array([rotation_about(random.normal(size=3), random.uniform(0, 3)) for _ in range(n)])
    return Bodies(SCENE, start, w, (inertia + inertia.transpose(0, 2, 1)) / 2, {})


def run(bodies: Bodies, dt: float = 0.3, order: int | str = "exact", steps: int = 40, every: int = 7) -> Block:
    """The block of a run in lanes."""
    found = cv.MoserVeselov(order).prepare_many(bodies, cv.Grid(dt, steps, every))
    assert found is not None
    return found()


@pytest.mark.parametrize(("order", "dt"), [("exact", 0.3), (6, 0.1)])
def test_many_are_those_of_one_at_a_time(order: int | str, dt: float) -> None:
    """21 bodies: two lanes of eight, and five in the third."""
    bodies = mixed(21)
    block = run(bodies, dt, order)
    assert block.finished.all()
    for i in range(len(bodies)):
        alone = cv.MoserVeselov(order).solve(bodies.take(i), cv.Grid(dt, 40, 7))
        np.testing.assert_allclose(block.R_WB[i], alone.R_WB, rtol=0, atol=1e-14, err_msg=str(i))  # measured 9e-16
        np.testing.assert_allclose(block.w_WB_B[i], alone.w_WB_B, rtol=0, atol=1e-14, err_msg=str(i))


def test_one_inertia_is_for_all() -> None:
    bodies = mixed(11)
    turn = rotation_about((3, -1, 2), 1.3)
    inertia = turn @ np.diag([1.0, 1.4, 2.0]) @ turn.T
    shared = cv.Scene("turned", cv.RigidBody(inertia), np.eye(3), (0, 0, 1), 1.0)
    found = run(Bodies(shared, bodies.R_WB0, bodies.w_WB_B0, None, {}))
    wanted = run(Bodies(SCENE, bodies.R_WB0, bodies.w_WB_B0, np.tile(shared.body.inertia, (11, 1, 1)), {}))
    np.testing.assert_allclose(found.R_WB, wanted.R_WB, rtol=0, atol=1e-14)  # measured 2e-15: axes of two eigensolvers


def test_a_body_does_not_depend_on_its_neighbours() -> None:
    """Not even in its last bit: neighbours that rest, are on the separatrix, too fast or nothing at all, and other places."""
    bodies = mixed(240)
    block, w, inertia = run(bodies, 1.2, steps=9), bodies.w_WB_B0.copy(), bodies.inertia.copy()
    w[1::8], w[3::8], w[5::8], w[7] = 0.0, 50.0, w[9], np.nan
    inertia[5::8] = inertia[9]
    other, moved = run(Bodies(SCENE, bodies.R_WB0, w, inertia, {}), 1.2, steps=9), run(bodies[5:], 1.2, steps=9)
    np.testing.assert_array_equal(other.R_WB[::2], block.R_WB[::2])
    np.testing.assert_array_equal(other.w_WB_B[::2], block.w_WB_B[::2])
    np.testing.assert_array_equal(moved.R_WB, block.R_WB[5:])
    assert other.finished[::2].all()
    assert not other.finished[3::8].any()
    assert not other.finished[7]


def test_who_has_no_step_is_left_alone() -> None:
    bodies = mixed(12)
    w = bodies.w_WB_B0 / np.maximum(np.linalg.norm(bodies.w_WB_B0, axis=1, keepdims=True), 1e-9)
    still, slow, fast = np.zeros(3), 1e-70 * w[10], 21.0 * w[11]
    some = Bodies(SCENE, bodies.R_WB0[9:12], np.array([still, slow, fast]), bodies.inertia[9:12], {})
    assert run(some).finished.tolist() == [True, False, False]
    if COMPILED:  # in plain Python, the root of a negative number leaves all to be run alone
        assert run(some, order=4).finished.tolist() == [True, False, False]
    assert run(Bodies(SCENE, bodies.R_WB0[:6], 4.9 * w[:6], bodies.inertia[:6], {}), order=4).finished.tolist() == [True] * 6


def test_pieces_and_repetitions_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    bodies, grid = mixed(21)[5:14], cv.Grid(0.3, 40, 7)
    again = cv.MoserVeselov().prepare_many(bodies, grid)
    assert again is not None
    whole = again()
    monkeypatch.setattr(columns, "PIECE", 0.0)  # a piece is a step
    for block in (again(), again()):
        np.testing.assert_array_equal(block.R_WB, whole.R_WB)
        np.testing.assert_array_equal(block.w_WB_B, whole.w_WB_B)


@kernel
def advance_four(table, states, first):
    """200 steps of four bodies."""
    n, flat, states_flat = table.shape[1], table.reshape(-1), states.reshape(-1)
    at = State(*load_rows(states_flat, first, n, 5, 4))
    save_rows(states_flat, first, n, take_steps(Shift(*load_rows(flat, first, n, 15, 4)), at, 0, 200))


@kernel
def advance_alone(table, states, i):
    """200 steps of one body."""
    c, s = table[:, i], states[:, i]
    k = Shift(c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8], c[9], c[10], c[11], c[12], c[13], c[14])
    at = take_steps(k, State(s[0], s[1], s[2], s[3], s[4]), 0, 200)
    for j in range(5):
        states[j, i] = at[j]


@pytest.mark.skipif(not COMPILED, reason="plain Python has lanes of one width only")
def test_steps_of_any_width_are_the_same_bit_for_bit() -> None:
    bodies, limits = mixed(21)[8:16], (6.0, 2.7, 0.2)
    table, eight = np.empty((lanes.ROWS, 8)), np.empty((lanes.STATE_ROWS, 8))
    moments, R_BP = bodies.principal
    lanes.prepare(moments, R_BP, bodies.R_WB0, bodies.w_WB_B0, 1.0, 0.3, 0, limits, table, eight)
    four, alone = eight.copy(), eight.copy()
    lanes.march(table, eight, 0, 200, 200, 200, np.empty((8, 2, 3, 3)), np.empty((8, 2, 3)))
    for i in range(0, 8, 4):
        advance_four(table, four, i)
    for i in range(8):
        advance_alone(table, alone, i)
    np.testing.assert_array_equal(four, eight)
    np.testing.assert_array_equal(alone, eight)
