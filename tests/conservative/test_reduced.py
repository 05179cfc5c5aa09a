"""The map in three unknowns: equal to the paper's in eighteen, known values, conservation, order, frames."""

from __future__ import annotations

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between, cayley, rotation_about
from conservative.methods.non_spinning import resolve_frame

TURN = rotation_about((3, -1, 2), 1.3)


def symmetric(free: bool, side: float = 1.0) -> cv.Scene:
    """A symmetric body in axes of its own, with its centre of mass on either side of the fixed point."""
    field = None if free else cv.UniformGravity(1.3, TURN @ [0, 0, 0.8 * side])
    body = cv.RigidBody(TURN @ np.diag([2, 2, 0.7]) @ TURN.T)
    return cv.Scene("symmetric", body, rotation_about((1, 0.2, -1), 0.7), TURN @ [0.3, -0.4, 6], 2.0, field)


# The brick multiplies round-off by 10^4 or so in its two reversals. Nearly all of the difference is that of 18 unknowns, which
# are summed without compensation: a run of this map with 40 digits is 8e-13 off Reduced and 1.6e-11 off Convected.
@pytest.mark.parametrize(
    ("scene", "t_end", "bound"),
    [
        (cv.scenes.brick_flip(), 2.5, 1e-12),  # measured 1.5e-14
        (cv.scenes.brick_flip(), 6.0, 1e-10),  # measured 1.5e-11
        (cv.scenes.lagrange_top(), 0.63, 1e-12),  # measured 2e-14
        (symmetric(False), 2.0, 1e-12),  # measured 1.4e-15
    ],
)
def test_it_is_the_papers_map(scene: cv.Scene, t_end: float, bound: float) -> None:
    ours, paper = (method.run(scene, 0.01, t_end) for method in (cv.Reduced(), cv.Convected(tol=1e-14)))
    size = np.linalg.norm(paper.w_WB_B[0])
    assert np.abs(ours.R_WB - paper.R_WB).max() < bound
    assert np.abs(ours.w_WB_B - paper.w_WB_B).max() / size < bound


def test_order_is_two_with_little_scatter() -> None:
    scene = cv.scenes.brick_flip()
    truth = cv.MoserVeselov().run(scene, 0.1).R_WB[-1]
    steps = np.array([1200, 2400, 4800, 9600])
    errors = [float(angle_between(truth, cv.Reduced().run(scene, 6 / n, sample_every=n).R_WB[-1])) for n in steps]
    slope = np.polyfit(np.log(1 / steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(2, abs=0.01)  # measured 2.001


def explicit_midpoint_energy(scene: cv.Scene, dt: float) -> float:
    """Energy drift of the contrast: an explicit method of the same order on the same equations."""
    J, L, R = scene.body.inertia, scene.body.momentum(scene.w_WB_B0), scene.R_WB0
    for _ in range(round(scene.t_end / dt)):
        half = L + dt / 2 * np.cross(L, scene.body.inverse @ L)
        w = scene.body.inverse @ half
        L, R = L + dt * np.cross(half, w), R @ cayley(dt * w)
    energy = L @ np.linalg.solve(J, L) / 2
    return abs(energy / scene.kinetic_energy0 - 1)


def test_a_method_of_the_same_order_that_does_not_conserve_drifts_a_thousand_times_more() -> None:
    scene = cv.scenes.brick_flip()
    drift = np.ptp(cv.Reduced().run(scene, 0.01).energy) / scene.kinetic_energy0
    assert drift < explicit_midpoint_energy(scene, 0.01) / 1000  # measured 7e-16 against 1.1e-4


@pytest.mark.parametrize("order", [2, 6])
def test_energy_error_walks_and_does_not_run(order: int) -> None:
    scene = cv.Scene("generic", cv.RigidBody([[3, 0.2, 0.1], [0.2, 2, -0.3], [0.1, -0.3, 4]]), TURN, (0.5, 1, -2), 1.0)
    trajectory = cv.Reduced(order).run(scene, 0.03, t_end=0.03 * 300_000, sample_every=300)
    error = (trajectory.energy - trajectory.energy[0]) / scene.energy_scale
    assert np.abs(error).max() < 1e-14  # measured 4e-15 at order 6, in 2.7 million stages


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("free", [True, False])
def test_the_frame_that_does_not_spin_has_the_same_motion(free: bool, side: float) -> None:
    scene = symmetric(free, side)
    truth = cv.Gauss(8, frame="body").run(scene, 0.02).R_WB[-1]
    slow = cv.Reduced(6, frame="non_spinning").run(scene, 0.05)
    full = cv.Reduced(6).run(scene, 0.05)
    assert angle_between(truth, slow.R_WB[-1]) < 5e-9  # measured 5e-10 to 6.5e-10
    assert angle_between(truth, slow.R_WB[-1]) < angle_between(truth, full.R_WB[-1]) / 100  # measured a 1,000th of 7e-7
    assert "frame=non_spinning" in slow.label
    assert slow.scene is scene


def test_frames_are_chosen_and_refused() -> None:
    assert resolve_frame("auto", symmetric(True)) == "non_spinning"
    assert resolve_frame("auto", symmetric(False)) == "non_spinning"
    assert resolve_frame("auto", cv.scenes.brick_flip()) == "body"
    sphere = cv.Scene("sphere", cv.RigidBody((2, 2, 2)), np.eye(3), (1, 2, 3), 1.0)
    assert resolve_frame("auto", sphere) == "body"
    with pytest.raises(cv.Unsupported, match="symmetric about one axis"):
        cv.integrate(cv.scenes.brick_flip(), method=cv.Reduced(frame="non_spinning"))
