"""`Taylor` for many bodies in lanes, against one at a time: in each field, with starts, bodies and fields that all differ."""

from dataclasses import replace

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import from_quaternion, orthonormality, rotation_about
from conservative.methods import columns
from conservative.methods.many import Block, Bodies

N = 7
"""Not a multiple of the bodies in a register."""
TURN = rotation_about((1, -2, 0.5), 1.1)
MOMENTS = np.array((0.9, 1.7, 1.2))
COM, ANCHOR = np.array((0.3, -0.2, 0.4)), np.array((1.0, 0.5, -0.8))
GRADIENT = TURN @ np.diag((1.0, 2.0, 1.5)) @ TURN.T
FIELDS = {
    "gravity": (cv.UniformGravity(4.0, COM), ("weight", "com_B")),
    "spring": (cv.LinearSpring(3.0, COM, ANCHOR, 0.4), ("stiffness", "point_B", "anchor_W", "rest_length")),
    "attraction": (cv.PointAttraction(-2.0, COM, ANCHOR), ("strength", "point_B", "anchor_W")),
    "gravity gradient": (cv.GravityGradient(1.3, GRADIENT, (0.3, -0.5, 0.8)), ("rate", "inertia")),
    "free": (None, ()),
}


def draw(field: str, n: int = N, size: float = 0.1) -> Bodies:
    """Bodies that differ in all that they can differ in; each number of a field by up to `size` of itself."""
    rng = np.random.default_rng(14)
    rotations = (from_quaternion(q / np.linalg.norm(q, axis=1)[:, None]) for q in rng.normal(size=(2, n, 4)))
    R_BP, R_WB0 = rotations
    moments = MOMENTS * np.exp(0.1 * rng.normal(size=(n, 3)))
    inertia = (R_BP * moments[:, None]) @ R_BP.swapaxes(1, 2)
    inertia = (inertia + inertia.swapaxes(1, 2)) / 2
    potential, names = FIELDS[field]
    parameters = {}
    for name in names:
        value = np.asarray(getattr(potential, name))
        spread = rng.uniform(1 - size, 1 + size, (n, *(1,) * value.ndim))
        parameters[name] = value * (spread if value.ndim == 2 else rng.uniform(1 - size, 1 + size, (n, *value.shape)))
    scene = cv.Scene("many", cv.RigidBody(inertia[0]), R_WB0[0], (1, 2, 3), 2.0, potential)
    return Bodies(scene, R_WB0, rng.normal(size=(n, 3)) * 2, inertia, parameters)


def run(bodies: Bodies, grid: cv.Grid, order: int) -> Block:
    many = cv.Taylor(order).prepare_many(bodies, grid)
    assert many is not None
    return many()


def off_one_at_a_time(bodies: Bodies, found: Block, grid: cv.Grid, order: int) -> float:
    """The largest difference from the same bodies alone: of attitudes, and of rates relative to the largest of a body."""
    off = []
    for i in range(len(bodies)):
        alone = cv.Taylor(order).solve(bodies.take(i), grid)
        assert alone.ok
        size = np.abs(alone.w_WB_B).max() or 1.0
        off += [np.abs(alone.R_WB - found.R_WB[i]).max(), np.abs(alone.w_WB_B - found.w_WB_B[i]).max() / size]
    return float(max(off))


@pytest.mark.parametrize("field", FIELDS)
def test_bodies_move_as_they_do_one_at_a_time(field: str) -> None:
    bodies = draw(field)
    for order, dt in ((4, 0.01), (9, 0.05), (18, 0.1)):
        grid = cv.Grid(dt, 40, 3)
        found = run(bodies, grid, order)
        assert found.finished.all()
        assert found.R_WB.shape == (N, 15, 3, 3)
        assert found.w_WB_B.shape == (N, 15, 3)
        assert off_one_at_a_time(bodies, found, grid, order) < 2e-14  # measured 5e-15


@pytest.mark.parametrize("field", ["gravity", "free"])
def test_symmetric_bodies_turn_in_a_frame_that_does_not_spin(field: str) -> None:
    symmetric = TURN @ np.diag((0.9, 0.9, 1.2)) @ TURN.T
    potential = cv.UniformGravity(4.0, -0.3 * TURN[:, 2]) if field == "gravity" else None
    drawn, grid = draw(field), cv.Grid(0.1, 60, 7)
    some = np.where((np.arange(N) % 2)[:, None, None], drawn.inertia, symmetric)
    for inertia in (None, some):
        held = replace(drawn.scene, body=cv.RigidBody(symmetric), potential=potential)
        bodies = Bodies(held, drawn.R_WB0, drawn.w_WB_B0, inertia, {})
        found = run(bodies, grid, 14)
        assert found.finished.all()
        assert off_one_at_a_time(bodies, found, grid, 14) < 2e-14  # measured 5e-15
        assert orthonormality(found.R_WB).max() < 1e-14


@pytest.mark.parametrize(("moment", "time"), [(1e-20, 1e-4), (1e20, 1e5), (1.0, 1e12)])
def test_units_of_bodies_do_not_matter(moment: float, time: float) -> None:
    bodies, grid = draw("gravity"), cv.Grid(0.05 * time, 10, 10)
    parameters = {**bodies.parameters, "weight": bodies.parameters["weight"] * moment / time / time}
    scaled = Bodies(bodies.scene, bodies.R_WB0, bodies.w_WB_B0 / time, bodies.inertia * moment, parameters)
    found = run(scaled, grid, 12)
    assert found.finished.all()
    assert off_one_at_a_time(scaled, found, grid, 12) < 2e-14  # measured 8e-16
    np.testing.assert_allclose(found.R_WB, run(bodies, cv.Grid(0.05, 10, 10), 12).R_WB, rtol=0, atol=1e-13)


def test_a_body_that_cannot_be_projected_is_not_finished_and_disturbs_nobody() -> None:
    bodies, grid = draw("gravity"), cv.Grid(0.2, 20, 1)
    usual = run(bodies, grid, 6)
    assert usual.finished.all()
    fast = bodies.w_WB_B0.copy()
    fast[[1, 6]] *= ((20.0,), (1e90,))  # one is far from its invariants, of one nothing is finite
    fast[2] *= 1.7  # several corrections
    found = run(Bodies(bodies.scene, bodies.R_WB0, fast, bodies.inertia, bodies.parameters), grid, 6)
    np.testing.assert_array_equal(found.finished, [True, False, True, True, True, True, False])
    np.testing.assert_array_equal(found.R_WB[[0, 3, 4, 5]], usual.R_WB[[0, 3, 4, 5]])
    np.testing.assert_array_equal(found.w_WB_B[[0, 3, 4, 5]], usual.w_WB_B[[0, 3, 4, 5]])
    assert not np.array_equal(found.R_WB[2], usual.R_WB[2])


def test_samples_and_pieces_do_not_change_the_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    bodies = draw("gravity")
    every, few = (run(bodies, cv.Grid(0.05, 20, n), 10) for n in (1, 7))
    monkeypatch.setattr(columns, "PIECE", 0.0)
    pieces = run(bodies, cv.Grid(0.05, 20, 7), 10)
    np.testing.assert_array_equal(every.R_WB[:, [0, 7, 14, 20]], few.R_WB)
    np.testing.assert_array_equal(few.R_WB, pieces.R_WB)
    np.testing.assert_array_equal(few.w_WB_B, pieces.w_WB_B)


def test_what_runs_alone() -> None:
    bodies = draw("gravity")
    assert cv.Taylor(tolerance=1e-9).prepare_many(bodies, cv.Grid(0.1, 10, 1)) is None
    satellite = cv.Orbit(0.7, (0, 0, 1)).gravity_gradient(GRADIENT, (1, 0, 0))
    held = replace(bodies.scene, potential=satellite)
    assert cv.Taylor().prepare_many(Bodies(held, bodies.R_WB0, bodies.w_WB_B0, None, {}), cv.Grid(0.1, 10, 1)) is None
