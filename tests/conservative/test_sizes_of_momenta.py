"""Momenta that are kept: what their drifts are relative to, near rest too, and that each of their components counts."""

import math
from dataclasses import replace

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import axes_about, rotation_about
from conservative.invariants import kept_sizes
from conservative.method import Grid

from .test_acceptance import WithKernel

MOMENTS = np.array((1.0, 4.0, 25.0))


def test_momentum_is_relative_to_what_all_the_energy_makes_with_the_largest_moment():
    scene = cv.Scene("near rest", cv.RigidBody(MOMENTS), np.eye(3), (1e-3, 0, 0), 1.0, cv.UniformGravity(2, (0, 0, 3)))
    (found,) = kept_sizes(scene, frozenset({"vertical momentum"})).values()
    assert found == pytest.approx(math.sqrt(2 * scene.energy_scale * 25), rel=1e-12)
    (own,) = kept_sizes(scene, frozenset({"energy"})).values()
    assert own == scene.energy_scale


@pytest.mark.parametrize("along", range(3))
@pytest.mark.parametrize("off", [1, 2])
def test_a_momentum_that_turns_aside_is_not_kept(along, off):
    """The momentum is along one axis of the world, and the last sample is turned so that one other component changes."""
    w = np.array((0.3, -0.5, 0.4))
    axes = np.roll(axes_about(w * MOMENTS / np.linalg.norm(w * MOMENTS)), along - 2, axis=1)  # column `along` is the momentum's
    scene = cv.Scene("turned", cv.RigidBody(MOMENTS), axes.T, w, 1.0)
    about = np.eye(3)[(along + off) % 3]

    def turn(good):
        R_WB = good.R_WB.copy()
        R_WB[-1] = rotation_about(about, 0.01) @ R_WB[-1]
        return replace(good, R_WB=R_WB)

    grid = Grid(0.01, 3)
    assert WithKernel(kept=frozenset({"momentum"})).solve(scene, grid).ok
    found = WithKernel(turn, frozenset({"momentum"})).solve(scene, grid)
    assert found.outcome.kind is cv.OutcomeKind.NOT_CONSERVED
    assert len(found) == 3
