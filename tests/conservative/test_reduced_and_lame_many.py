"""Steps of `Reduced` and `Lame` for many bodies at once: those of one at a time to round-off, whatever the neighbours are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import rotation_about
from conservative.batch import Batch
from conservative.method import Method
from conservative.methods import columns
from conservative.methods.many import Block

TURN = rotation_about((3, -1, 2), 1.3)
TOP = cv.RigidBody(TURN @ np.diag([1.1, 1.1, 0.6]) @ TURN.T)
GRAVITY = cv.UniformGravity(4.0, (0.3, -0.2, 0.4))
ON_AXIS = cv.UniformGravity(4.0, 0.5 * TURN[:, 2])


def generic(n: int, potential: cv.UniformGravity | None = None) -> Batch:
    """Bodies with moments, axes, attitudes and speeds (0.05 to 5 rad/s) of their own; each third is 1e28 times as heavy."""
    random = np.random.default_rng(14)
    turned = np.array([rotation_about(random.normal(size=3), 2.0) for _ in range(n)])
    moments = random.uniform(0.9, 1.1, (n, 3)) * (1, 1.4, 2) * np.where(np.arange(n) % 3, 1.0, 1e28)[:, None]
    inertia = turned @ (moments[:, :, None] * turned.transpose(0, 2, 1))
    w = random.normal(size=(n, 3)) * 10 ** random.uniform(-1.5, 0.5, (n, 1))
    scene = cv.Scene("generic", cv.RigidBody((1, 1.4, 2)), np.eye(3), (0, 0, 1), 1.0, potential)
    weights = {} if potential is None else {"weight": random.uniform(1, 4, n) * moments[:, 0]}
    return Batch(scene, starts(n), w, (inertia + inertia.transpose(0, 2, 1)) / 2, weights)


def starts(n: int) -> np.ndarray:
    """Attitudes of no meaning."""
    random = np.random.default_rng(15)
    return np.array([rotation_about(random.normal(size=3), random.uniform(0, 3)) for _ in range(n)])


def tops(n: int, potential: cv.UniformGravity | None = ON_AXIS, **parameters: Any) -> Batch:
    """The same symmetric body at speeds of 0.1 to 10 rad/s."""
    random = np.random.default_rng(16)
    scene = cv.Scene("tops", TOP, np.eye(3), (0, 0, 1), 1.0, potential)
    return Batch(scene, starts(n), random.normal(size=(n, 3)) * 10 ** random.uniform(-1, 0.7, (n, 1)), None, parameters)


def run(method: Method, bodies: Batch, grid: cv.Grid) -> Block:
    """The block of a run in lanes."""
    found = method.prepare_many(bodies, grid)
    assert found is not None
    block: Block = found()
    return block


def differ(method: Method, bodies: Batch, grid: cv.Grid) -> list[int]:
    """Return the bodies that were not finished or differ from those run alone; bodies that fail alone are left out."""
    block, found = run(method, bodies, grid), []
    for i in range(len(bodies)):
        alone = method.solve(bodies.take(i), grid)
        speed = np.abs(alone.w_WB_B).max()
        same = np.abs(alone.R_WB - block.R_WB[i]).max() < 1e-14  # measured 4e-15, and 0 in six of the eight cases
        same = same and np.abs(alone.w_WB_B - block.w_WB_B[i]).max() < 1e-14 * speed  # measured 2e-15
        if alone.ok and not (block.finished[i] and same):
            found.append(i)
    return found


@pytest.mark.parametrize(
    ("method", "bodies", "dt"),
    [
        (cv.Reduced(), generic(11), 0.05),
        (cv.Reduced(), generic(11), 2.0),  # a few are solved for alone, steps of 10 rad
        (cv.Reduced(6), generic(11), 0.3),
        (cv.Reduced(), generic(11, GRAVITY), 0.05),
        (cv.Lame(), tops(11), 0.1),
        (cv.Lame(), tops(11, None), 0.1),
        (cv.Lame(), tops(11, weight=np.linspace(1, 9, 11)), 0.7),  # in 1 to 5 parts
        (cv.Lame(), tops(5, com_B=np.outer(np.linspace(-1, 1, 5), TURN[:, 2])), 0.3),
    ],
)
def test_many_are_those_of_one_at_a_time(method: Method, bodies: Batch, dt: float) -> None:
    """11 bodies: eight lanes, and three in a second group."""
    assert differ(method, bodies, cv.Grid(dt, 40, 7)) == []


@pytest.mark.parametrize(("method", "bodies", "dt"), [(cv.Reduced(), generic(17, GRAVITY), 0.4), (cv.Lame(), tops(17), 0.7)])
def test_a_body_does_not_depend_on_its_neighbours(method: Method, bodies: Batch, dt: float) -> None:
    """Not even in its last bit: neighbours that rest, need more parts or corrections, have no step at all; other places."""
    grid, w = cv.Grid(dt, 30, 7), bodies.w_WB_B0.copy()
    w[1::4], w[3::8], w[7] = 0.0, 8.0, 1e7
    block, other = run(method, bodies, grid), run(method, Batch(bodies.scene, bodies.R_WB0, w, None, {}), grid)
    if bodies.inertia is not None:
        other = run(method, Batch(bodies.scene, bodies.R_WB0, w, bodies.inertia, bodies.parameters), grid)
    moved = run(method, bodies[5:], grid)
    np.testing.assert_array_equal(other.R_WB[::2], block.R_WB[::2])
    np.testing.assert_array_equal(other.w_WB_B[::2], block.w_WB_B[::2])
    np.testing.assert_array_equal(moved.R_WB, block.R_WB[5:])
    assert block.finished.sum() > 10
    assert not other.finished[7]


def test_who_has_no_solution_alone_is_not_finished() -> None:
    top = cv.scenes.lagrange_top()
    bodies = Batch(top, np.tile(top.R_WB0, (3, 1, 1)), np.outer((1.0, 0.1, 0.0), top.w_WB_B0), None, {})
    grid = cv.Grid(0.5, 3)
    finished = [cv.Reduced().solve(bodies.take(i), grid).ok for i in range(3)]
    assert run(cv.Reduced(), bodies, grid).finished.tolist() == finished
    assert not finished[0]


def test_a_body_without_symmetry_is_left_to_others() -> None:
    inertia = np.tile(TOP.inertia, (3, 1, 1))
    inertia[1, 0, 0] *= 1.001
    bodies = tops(3, None)
    block = run(cv.Lame(), Batch(bodies.scene, bodies.R_WB0, bodies.w_WB_B0, inertia, {}), cv.Grid(0.1, 5))
    assert block.finished.tolist() == [True, False, True]
    assert np.isnan(block.R_WB[1]).all()
    one = Batch(bodies.scene, bodies.R_WB0[:1], bodies.w_WB_B0[:1], inertia[1:2], {})
    assert cv.Lame().prepare_many(one, cv.Grid(0.1, 5)) is None


def test_other_fields_and_frames_run_one_by_one() -> None:
    scene = cv.Scene("sprung", TOP, TURN, (0, 0, 1), 1.0, cv.LinearSpring(3.0, (0.2, 0.1, 0.4), (0.5, 0.0, 0.3), 0.1))
    sprung = Batch(scene, TURN[None], np.ones((1, 3)), None, {})
    for method, bodies in ((cv.Reduced(), sprung), (cv.Lame(), sprung), (cv.Reduced(frame="auto"), tops(3))):
        assert method.prepare_many(bodies, cv.Grid(0.1, 5)) is None


@pytest.mark.parametrize(("method", "bodies"), [(cv.Reduced(), generic(9)), (cv.Lame(), tops(9))])
def test_pieces_and_repetitions_change_nothing(method: Method, bodies: Batch, monkeypatch: pytest.MonkeyPatch) -> None:
    again = method.prepare_many(bodies, cv.Grid(0.3, 40, 7))
    assert again is not None
    whole = again()
    monkeypatch.setattr(columns, "PIECE", 0.0)  # a piece is a step
    for block in (again(), again()):
        np.testing.assert_array_equal(block.R_WB, whole.R_WB)
        np.testing.assert_array_equal(block.w_WB_B, whole.w_WB_B)


def test_drifts_are_those_of_compensated_sums() -> None:
    bodies, grid = generic(8), cv.Grid(0.05, 20000, 20000)
    block = run(cv.Reduced(), bodies, grid)
    assert bodies.inertia is not None
    L = [bodies.inertia @ block.w_WB_B[:, k, :, None] for k in (0, -1)]
    before, after = ((block.R_WB[:, k] @ L[k])[..., 0] for k in (0, -1))
    lost = np.linalg.norm(after - before, axis=1) / np.linalg.norm(before, axis=1)
    assert lost.max() < 1e-14
