"""Many bodies in lanes of compiled code: each moves as it does alone, for any neighbours, pieces of a run and units."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import from_quaternion
from conservative.batch import Batch
from conservative.integration import blocks
from conservative.kernels import COMPILED
from conservative.methods import columns
from conservative.methods.many import Block

from .one_body import BODY, TURN, body_in_axes

POINT, ANCHOR = np.array((0.3, -0.2, 0.4)), np.array((1.0, 0.5, -0.8))
GRAVITY, ON_AXIS = cv.UniformGravity(4.0, POINT), cv.UniformGravity(4.0, 0.5 * TURN[:, 2])
TOP, ACROSS = body_in_axes(TURN, 1.1, 1.1, 0.6), body_in_axes(TURN, 1.1, 0.6, 1.1)


def rotations(n: int, seed: int) -> np.ndarray:
    q = np.random.default_rng(seed).normal(size=(n, 4))
    return from_quaternion(q / np.linalg.norm(q, axis=1)[:, None])


def tensors(moments: np.ndarray, seed: int = 16) -> np.ndarray:
    R = rotations(len(moments), seed)
    J = R @ (moments[:, :, None] * R.swapaxes(1, 2))
    return (J + J.swapaxes(1, 2)) / 2


def batch(
    body: cv.RigidBody, n: int, potential: cv.Potential | None = None, inertia: np.ndarray | None = None, **parameters: Any
) -> Batch:
    """Return bodies at random attitudes with random rates of 0.05 to 5 rad/s."""
    rng = np.random.default_rng(14)
    w = rng.normal(size=(n, 3)) * 10 ** rng.uniform(-1.5, 0.5, (n, 1))
    return Batch(cv.Scene("many", body, np.eye(3), (0, 0, 1), 1.0, potential), rotations(n, 15), w, inertia, parameters)


def generic(n: int, potential: cv.UniformGravity | None = None) -> Batch:
    """Return bodies with different inertia; each third has 1e28 times the moments."""
    rng = np.random.default_rng(14)
    moments = rng.uniform(0.9, 1.1, (n, 3)) * (1, 1.4, 2) * np.where(np.arange(n) % 3, 1.0, 1e28)[:, None]
    weights = {"weight": rng.uniform(1, 4, n) * moments[:, 0]} if potential else {}
    return batch(BODY, n, potential, tensors(moments), **weights)


def tops(n: int, potential: cv.UniformGravity | None = ON_AXIS, **parameters: Any) -> Batch:
    return batch(TOP, n, potential, **parameters)


DEGENERATE = (
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


def free(n: int) -> Batch:
    """Return free bodies: the degenerate ones in their principal axes, then random ones of any size."""
    rng = np.random.default_rng(14)
    masses = 10 ** rng.uniform(-1, 0, (n, 3)) * 10.0 ** rng.integers(-9, 9, (n, 1))
    inertia, w = tensors(masses.sum(axis=1, keepdims=True) - masses), rng.normal(size=(n, 3))
    for i, (moments, rates) in enumerate(DEGENERATE[:n]):
        inertia[i], w[i] = np.diag(moments), rates
    scene = cv.Scene("free", cv.RigidBody((1, 2, 2.5)), np.eye(3), (0.3, -1.0, 0.7), 30.0)
    return Batch(scene, rotations(n, 15), w, inertia, {})


GRADIENT = body_in_axes(TURN, 1.0, 2.0, 1.5).inertia
FIELDS = {
    "gravity": (GRAVITY, ("weight", "com_B")),
    "spring": (cv.LinearSpring(3.0, POINT, ANCHOR, 0.4), ("stiffness", "point_B", "anchor_W", "rest_length")),
    "attraction": (cv.PointAttraction(-2.0, POINT, ANCHOR), ("strength", "point_B", "anchor_W")),
    "gradient": (cv.GravityGradient(1.3, GRADIENT, (0.3, -0.5, 0.8)), ("rate", "inertia")),
    "none": (None, ()),
}


def varied(field: str, moment: float = 1.0, time: float = 1.0) -> Batch:
    """Return seven bodies that differ in inertia, initial state and all numbers of the field, in units kg m^2 and s."""
    (potential, names), rng, n = FIELDS[field], np.random.default_rng(17), 7
    inertia, parameters = tensors(np.array((0.9, 1.7, 1.2)) * np.exp(0.1 * rng.normal(size=(n, 3)))), {}
    for name in names:
        value = np.asarray(getattr(potential, name))
        shape = (n, 1, 1) if value.ndim == 2 else (n, *value.shape)
        parameters[name] = value * rng.uniform(0.9, 1.1, shape) * (moment / time**2 if name == "weight" else 1)
    bodies = batch(BODY, n, potential)
    return Batch(bodies.scene, bodies.R_WB0, rng.normal(size=(n, 3)) * 2 / time, moment * inertia, parameters)


def name_of(value: object) -> str | None:
    return getattr(value, "name", None)


def run(method: cv.Method, bodies: Batch, grid: cv.Grid) -> Block:
    prepared = method.prepare_many(bodies, grid)
    assert prepared is not None
    return prepared()


PARTLY_SYMMETRIC = np.where((np.arange(11) % 2)[:, None, None], generic(11).inertia, TOP.inertia)
CASES = [
    (cv.Reduced(), generic(11), 0.05),
    (cv.Reduced(), generic(11), 2.0),  # steps of 10 rad: some bodies are solved one at a time
    (cv.Reduced(6), generic(11), 0.3),
    (cv.Reduced(), generic(11, GRAVITY), 0.05),
    (cv.Lame(), tops(11), 0.1),
    (cv.Lame(), tops(11, None), 0.1),
    (cv.Lame(), tops(11, weight=np.linspace(1, 9, 11)), 0.7),  # in 1 to 5 parts
    (cv.Lame(), tops(5, com_B=np.outer(np.linspace(-1, 1, 5), TURN[:, 2])), 0.3),
    (cv.MoserVeselov(), free(21), 0.3),
    (cv.MoserVeselov(6), free(21), 0.1),
    (cv.MoserVeselov(), batch(BODY, 11), 0.3),
    *(
        (cv.Taylor(order), varied(field), dt)
        for field in FIELDS
        if FIELDS[field][0]
        for order, dt in ((4, 0.01), (9, 0.05), (18, 0.1))
    ),
    *((cv.Taylor(12), varied("gravity", *units), 0.05 * units[1]) for units in ((1e-20, 1e-4), (1e20, 1e5), (1.0, 1e12))),
    # A single free body or top has other unknowns: both agree where neither has a truncation error.
    (cv.Taylor(18), varied("none"), 0.03),
    (cv.Taylor(18), tops(11), 0.03),
    (cv.Taylor(18), tops(11, None), 0.03),
    (cv.Taylor(14), batch(TOP, 11, ON_AXIS, PARTLY_SYMMETRIC), 0.1),
    # The first is symmetric together with its field; the others have a point off the axis, or another axis.
    (cv.Taylor(14), tops(5, com_B=0.5 * TURN[:, 2] + np.outer(np.arange(5) / 10, TURN[:, 0])), 0.1),
    (cv.Taylor(14), batch(TOP, 5, ON_AXIS, np.where(np.arange(5)[:, None, None], ACROSS.inertia, TOP.inertia)), 0.1),
]


@pytest.mark.parametrize(("method", "bodies", "dt"), CASES, ids=name_of)
def test_each_body_moves_as_it_does_alone(method: cv.Method, bodies: Batch, dt: float) -> None:
    """The last lane is not full. Attitudes, and rates relative to the largest of a body, differ by up to 7e-15."""
    grid = cv.Grid(dt, 40, 7)
    block, ended = run(method, bodies, grid), 0
    for i in range(len(bodies)):
        alone = method.solve(bodies.take(i), grid)
        if alone.ok:
            assert block.finished[i]
            np.testing.assert_allclose(block.R_WB[i], alone.R_WB, rtol=0, atol=2e-14, err_msg=str(i))
            size = np.abs(alone.w_WB_B).max() or 1.0
            np.testing.assert_allclose(block.w_WB_B[i] / size, alone.w_WB_B / size, rtol=0, atol=2e-14, err_msg=str(i))
            ended += 1
    assert ended >= 5


@pytest.mark.parametrize(
    ("method", "bodies", "dt"),
    [
        (cv.Reduced(), generic(17, GRAVITY), 0.4),
        (cv.Lame(), tops(17), 0.7),
        (cv.MoserVeselov(), free(240), 1.2),
        (cv.Taylor(6), batch(BODY, 17, GRAVITY), 0.1),
    ],
    ids=name_of,
)
def test_a_body_does_not_depend_on_its_neighbours(method: cv.Method, bodies: Batch, dt: float) -> None:
    """Bits are equal if neighbours rest, turn fast, are not finite, or have other places."""
    grid, w = cv.Grid(dt, 30, 7), bodies.w_WB_B0.copy()
    w[1::4], w[3::8], w[7] = 0.0, 8.0, 1e90
    block = run(method, bodies, grid)
    other = run(method, Batch(bodies.scene, bodies.R_WB0, w, bodies.inertia, bodies.parameters), grid)
    moved = run(method, bodies[5:], grid)
    np.testing.assert_array_equal(other.R_WB[::2], block.R_WB[::2])
    np.testing.assert_array_equal(other.w_WB_B[::2], block.w_WB_B[::2])
    np.testing.assert_array_equal(moved.R_WB, block.R_WB[5:])
    assert block.finished.sum() > 10
    assert not other.finished[7]


@pytest.mark.parametrize(
    ("method", "bodies"),
    [(cv.Reduced(), generic(9)), (cv.Lame(), tops(9)), (cv.MoserVeselov(), free(21)[5:14]), (cv.Taylor(10), varied("gravity"))],
    ids=name_of,
)
def test_samples_pieces_and_repetitions_do_not_change_the_motion(
    method: cv.Method, bodies: Batch, monkeypatch: pytest.MonkeyPatch
) -> None:
    every = run(method, bodies, cv.Grid(0.1, 40))
    again = method.prepare_many(bodies, cv.Grid(0.1, 40, 7))
    assert again is not None
    whole = again()
    np.testing.assert_array_equal(every.R_WB[:, [0, 7, 14, 21, 28, 35, 40]], whole.R_WB)
    monkeypatch.setattr(columns, "PIECE", 0.0)  # a piece is a step
    for block in (again(), again()):
        np.testing.assert_array_equal(block.R_WB, whole.R_WB)
        np.testing.assert_array_equal(block.w_WB_B, whole.w_WB_B)


def test_bodies_without_a_step_are_not_finished() -> None:
    top = cv.scenes.lagrange_top()
    bodies = Batch(top, np.tile(top.R_WB0, (3, 1, 1)), np.outer((1.0, 0.1, 0.0), top.w_WB_B0), None, {})
    finished = [cv.Reduced().solve(bodies.take(i), cv.Grid(0.5, 3)).ok for i in range(3)]
    assert run(cv.Reduced(), bodies, cv.Grid(0.5, 3)).finished.tolist() == finished
    assert not finished[0]
    turning = batch(BODY, 3)
    turning.w_WB_B0[:] = np.outer((0.0, 1e-70, 21.0), (0.6, 0.0, 0.8))
    for order in ("exact", 4) if COMPILED else ("exact",):  # in plain Python a root of a negative number ends the lanes
        assert run(cv.MoserVeselov(order), turning, cv.Grid(0.3, 40)).finished.tolist() == [True, False, False]
    far = varied("gravity")
    far.w_WB_B0[[1, 6]] *= ((20.0,), (1e90,))  # one is far from its invariants, one is not finite
    assert run(cv.Taylor(6), far, cv.Grid(0.2, 20)).finished.tolist() == [True, False, True, True, True, True, False]


@pytest.mark.parametrize("field", [field for field, (potential, _) in FIELDS.items() if potential])
def test_a_body_that_fails_in_lanes_fails_as_it_does_alone(field: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Residuals differ by up to 5e-14 of their size."""
    method, bodies, grid = cv.Taylor(6), varied(field), cv.Grid(0.45, 40, 3)
    failed = {i: each for i in range(len(bodies)) if not (each := method.solve(bodies.take(i), grid)).ok}
    monkeypatch.setattr(blocks, "run_alone", None)
    block = blocks.run_block(method, bodies, grid)
    assert block.failures.keys() == failed.keys()
    assert failed
    for i, alone in failed.items():
        own, failure = block.failures[i], alone.failure
        assert isinstance(own, cv.NotConverged)
        assert isinstance(failure, cv.NotConverged)
        assert (own.step, own.time, own.reason) == (failure.step, failure.time, failure.reason)
        assert own.residual == pytest.approx(failure.residual, rel=1e-12)
        np.testing.assert_allclose(block.R_WB[i, : len(alone)], alone.R_WB, rtol=0, atol=1e-13)  # measured 4e-14
        assert np.isnan(block.R_WB[i, len(alone) :]).all()
        assert np.isnan(block.w_WB_B[i, len(alone) :]).all()


def test_lame_leaves_bodies_without_symmetry() -> None:
    inertia = np.tile(TOP.inertia, (3, 1, 1))
    inertia[1, 0, 0] *= 1.001
    block = run(cv.Lame(), batch(TOP, 3, None, inertia), cv.Grid(0.1, 5))
    assert block.finished.tolist() == [True, False, True]
    assert np.isnan(block.R_WB[1]).all()


@pytest.mark.parametrize(
    ("method", "bodies"),
    [
        (cv.Reduced(), batch(TOP, 2, FIELDS["spring"][0])),
        (cv.Reduced(frame="auto"), tops(3)),
        (cv.Lame(), batch(TOP, 2, FIELDS["spring"][0])),
        (cv.Lame(), batch(TOP, 1, None, BODY.inertia[None])),
        (cv.Taylor(tolerance=1e-9), varied("gravity")),
        (cv.Taylor(), batch(BODY, 2, cv.Orbit(0.7, (0, 0, 1)).gravity_gradient(GRADIENT, (1, 0, 0)))),
    ],
    ids=name_of,
)
def test_other_methods_fields_and_bodies_run_one_at_a_time(method: cv.Method, bodies: Batch) -> None:
    assert method.prepare_many(bodies, cv.Grid(0.1, 5)) is None


def test_momentum_is_summed_with_compensation() -> None:
    bodies = generic(8)
    block = run(cv.Reduced(), bodies, cv.Grid(0.05, 20000, 20000))
    before, after = ((block.R_WB[:, k] @ (bodies.inertia @ block.w_WB_B[:, k, :, None]))[..., 0] for k in (0, -1))
    assert (np.linalg.norm(after - before, axis=1) / np.linalg.norm(before, axis=1)).max() < 1e-14
