"""How often a body turns over is counted, and neither a wobble nor a spin that stays is one."""

import numpy as np
import pytest

import conservative as cv
from conservative.benchmarks.measures.turns_over import count_turns_over, momentum_along_spin
from conservative.references.exact.method import Exact

from .generic_study import START, TURN

BODY = cv.RigidBody(TURN @ np.diag([13, 5, 10]) @ TURN.T)


def exact(rates, t_end):
    """The exact motion of a body turned in its frame, for rates in its principal axes."""
    scene = cv.Scene("turned", BODY, START, TURN @ rates, t_end, dt=0.01)
    return Exact().run(scene, 0.01)


def with_component(along):
    """A trajectory whose momentum along the axis of its spin is this."""
    found = exact((0, 0, along[0]), 0.01)
    rates = np.asarray(along)[:, None] * TURN[:, 2]
    return cv.Trajectory(
        found.scene, np.arange(len(along)) * 0.01, np.repeat(START[None], len(along), axis=0), rates, "made up"
    )


@pytest.mark.parametrize(("rates", "t_end", "count"), [((0, 0.05, 10), 6, 2), ((0, 10, 0.05), 6, 0), ((0, 0.05, 10), 1, 0)])
def test_exact_motions_turn_over_as_often_as_is_known(rates, t_end, count):
    assert count_turns_over(exact(rates, t_end)) == count


@pytest.mark.parametrize(
    ("along", "count"), [((1, 0.1, -0.1, 0.1, 1), 0), ((1, -0.4, 1), 0), ((1, -0.6, 0.1, 0.7), 2), ((-2, 1.1), 1)]
)
def test_a_side_counts_from_half_of_the_start_on(along, count):
    assert count_turns_over(with_component(along)) == count


def test_the_axis_is_that_of_most_momentum_at_the_start_in_a_turned_frame():
    found = exact((0.1, 0.2, 3.0), 0.05)
    assert abs(momentum_along_spin(found.scene, found.w_WB_B)[0]) == pytest.approx(30)
