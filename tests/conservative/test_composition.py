"""Sets of coefficients: order conditions, symmetry, the observed order of a run, and wrong digits."""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from itertools import product

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between, rotation_about
from conservative.methods.coefficients.compositions import COMPOSITIONS, Composition

from ..sampling import sampled
from .one_body import body_in_axes

TURN = rotation_about((1, 2, 3), 0.8)
TOP = cv.Scene(
    "generic top",
    body_in_axes(TURN, 2.0, 1.5, 0.9),
    rotation_about((1, -1, 0.4), 0.9),
    TURN @ [0.5, -0.3, 4.0],
    3.0,
    cv.UniformGravity(9.0, TURN @ [0.1, 0.05, 0.6]),
)
# Steps over the run: coarse enough that the error stands well above round-off, fine enough that the leading term rules it.
STEPS = {2: (200, 400, 800, 1600), 4: (100, 200, 400, 800), 6: (60, 90, 135, 200), 8: (30, 40, 55, 75), 10: (14, 18, 23, 30)}


@cache
def reference() -> np.ndarray:
    return cv.Gauss(10).run(TOP, 0.01).R_WB[-1]


def largest_defect(found: Composition) -> float:
    """Return the largest defect in one dimension of sum w = 1 and, for odd k > 1 below the order, of sum w^k = 0."""
    powers = range(1, found.order, 2)
    return float(max(abs(sum(w**power for w in found.weights) - (power == 1)) for power in powers))


@pytest.mark.parametrize("order", COMPOSITIONS)
def test_lengths_are_symmetric_and_add_up(order: int) -> None:
    found = COMPOSITIONS[order]
    assert len(found.weights) == found.stages
    assert found.weights == found.weights[::-1]
    assert found.order % 2 == 0
    assert largest_defect(found) < 1e-38  # Hairer, Lubich & Wanner 2006, III.3
    for dt in (0.01, 0.3, 1 / 7):
        lengths = found.lengths(dt)
        assert lengths == lengths[::-1]
        # Rounding of the middle length alone is left: half a unit in its last place.
        off = abs(sum(Fraction(length) for length in lengths) - Fraction(dt))
        assert off <= Fraction(abs(lengths[found.stages // 2])) / 2**53


@pytest.mark.parametrize("order", COMPOSITIONS)
def test_a_run_shows_the_claimed_order(order: int) -> None:
    method, steps = cv.Reduced(order), np.array(STEPS[order])
    errors = [float(angle_between(reference(), method.run(TOP, 3.0 / n, sample_every=10**9).R_WB[-1])) for n in steps]
    slope = np.polyfit(np.log(1 / steps), np.log(errors), 1)[0]
    assert abs(slope - order) < 0.35  # measured within 0.1 up to order 8, 9.86 for order 10


@pytest.mark.parametrize("order", COMPOSITIONS)
def test_energy_and_vertical_momentum_are_conserved_at_every_order(order: int) -> None:
    trajectory = cv.Reduced(order).run(TOP, 0.05)
    vertical = trajectory.momentum_W[:, 2]
    assert np.ptp(trajectory.energy) / TOP.energy_scale < 3e-15  # measured 1.5e-15
    assert np.ptp(vertical) / np.linalg.norm(trajectory.momentum_W[0]) < 3e-14  # measured 2.5e-15


def test_the_conditions_show_a_wrong_digit_and_a_wrong_order() -> None:
    good = COMPOSITIONS[6]
    wrong = good.half[:12] + str((int(good.half[12]) + 1) % 10) + good.half[13:]
    assert largest_defect(good._replace(half=wrong)) > 1e-12
    assert largest_defect(COMPOSITIONS[4]._replace(order=6)) > 1e-3


@pytest.mark.parametrize(("part", "order"), sampled(product(["torque", "motor", "field"], COMPOSITIONS), 4))
def test_functions_of_time_are_asked_within_the_run_only(part: str, order: int) -> None:
    """No stage is outside of its step. A stage of Forest & Ruth's composition ended 0.35 steps after the run."""
    asked, end = list[float](), 0.3

    def gain(t: float) -> float:
        asked.append(t)
        return 1.0 + t

    arm = np.outer((0, 0, 1), (0.1, 0.2, 0.3))
    field = cv.FunctionPotential(
        lambda R, t: gain(t) * float(np.sum(arm * R)), lambda R, t: gain(t) * arm, 1.0, time_dependent=True
    )
    parts: dict[str, dict[str, object]] = {
        "torque": {"torque": cv.Torque(lambda t: (gain(t), 0.2, 0.1))},
        "motor": {"body": cv.RigidBody(TOP.body.inertia, rotor_momentum=lambda t: (gain(t), 0.2, 0.1))},
        "field": {"potential": field},
    }
    method = (cv.Splitting if part == "field" else cv.Reduced)(order)
    scene = TOP.rename("of time", t_end=end, **parts[part])
    asked.clear()
    assert method.run(scene, 0.1).ok
    assert 0 <= min(asked) < max(asked) <= end
