"""What a run in units of our own says of its failure is in SI units."""

import numpy as np

import conservative as cv
from conservative.errors import NotConverged
from conservative.method import Grid
from conservative.methods.units import Units

BRICK = cv.scenes.brick_flip()


def test_the_time_of_a_failure_is_in_seconds():
    units, grid = Units(2.0**16, 2.0**32), Grid(0.1 * 2.0**32, 8)
    R, w = np.repeat(BRICK.R_WB0[None], 3, axis=0), np.repeat(BRICK.w_WB_B0[None] * units.time, 3, axis=0)
    found = cv.Trajectory(BRICK, np.array((0.0, 0.1, 0.2)), R, w, "made up", failure=NotConverged(3, 0.2, 0.5, "made up"))
    restored = units.restore(found, BRICK, grid)
    assert (restored.outcome.step, restored.outcome.time, restored.outcome.residual) == (3, 0.2 * units.time, 0.5)
    assert restored.outcome.kind is cv.OutcomeKind.NOT_CONVERGED
    np.testing.assert_array_equal(restored.t, grid.t[:3])
    np.testing.assert_array_equal(restored.w_WB_B, np.repeat(BRICK.w_WB_B0[None], 3, axis=0))
