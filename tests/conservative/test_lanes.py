"""Lanes: the same numbers as one body at a time, whoever the neighbours are."""

from __future__ import annotations

import numpy as np
import pytest

from conservative.kernels import COMPILED

if not COMPILED:
    pytest.skip("lanes are machine code", allow_module_level=True)

from conservative.kernels import lanes_moser_veselov, lanes_reduced, lanes_start, reduced
from conservative.kernels.protocol import Workspace

STEPS = 200


def free_bodies(n):
    """J (3, n) ascending, L (3, n) and q (4, n) in principal axes."""
    rng = np.random.default_rng(14)
    m = 10 ** rng.uniform(-0.7, 0, (3, n))
    J = np.sort(m[[1, 2, 0]] + m[[2, 0, 1]], axis=0)
    q = rng.normal(size=(4, n))
    return J, J * rng.normal(size=(3, n)), q / np.linalg.norm(q, axis=0)


def march_reduced(march, width, J, L, q, h=0.2):
    """The states (n, 7) at the end, by lanes."""
    n = J.shape[1]
    out = np.zeros((n // width, 2, 7, width))
    march(h, 1e-14, np.concatenate([J, 1 / J]), np.concatenate([q, L]), STEPS, STEPS, out)
    return out[:, -1].transpose(0, 2, 1).reshape(n, 7)


def march_alone(J, L, q, h=0.2):
    """The same, by the kernel for one body."""
    ends = np.zeros((J.shape[1], 7))
    for i, end in enumerate(ends):
        q_out, L_out = np.zeros((2, 4)), np.zeros((2, 3))
        model = reduced.Model(tuple(J[:, i]), tuple(1 / J[:, i]), None, tuple(q[:, i]), tuple(L[:, i]))
        reduced.march(model, reduced.Coefficients(np.array([h]), 1e-14), Workspace(STEPS, STEPS, 0, q_out, L_out))
        end[:] = *q_out[-1], *L_out[-1]
    return ends


@pytest.mark.parametrize(("march", "width"), [(lanes_reduced.march_four, 4), (lanes_reduced.march_eight, 8)])
def test_lanes_of_reduced_are_those_of_one_body(march, width):
    start = free_bodies(16)
    np.testing.assert_allclose(march_reduced(march, width, *start), march_alone(*start), rtol=0, atol=1e-14)  # 2e-15


def test_a_lane_does_not_depend_on_its_neighbours():
    J, L, q = free_bodies(16)
    L_other = L.copy()
    L_other[:, 1::2] *= 9.0  # needs more corrections, or has no solution
    some, other = (march_reduced(lanes_reduced.march_eight, 8, J, each, q) for each in (L, L_other))
    assert (some[::2] == other[::2]).all()
    assert not (some[1::2] == other[1::2]).any()


def run_exact(march, width, J, L, q):
    """The states (n, 5) at the end of exact steps."""
    n = J.shape[1]
    constants, states, left = np.zeros((15, n)), np.zeros((5, n)), np.zeros((4, n))
    lanes_start.prepare(J, L, q, 0.2, constants, states, left)
    out = np.zeros((n // width, 2, 5, width))
    march(constants, states, STEPS, STEPS, out)
    alone = np.zeros((n, 2, 5))
    lanes_moser_veselov.march_single(constants, states, STEPS, STEPS, alone)
    return out[:, -1].transpose(0, 2, 1).reshape(n, 5), alone[:, -1]


@pytest.mark.parametrize(("march", "width"), [(lanes_moser_veselov.march_four, 4), (lanes_moser_veselov.march_eight, 8)])
def test_exact_steps_are_the_same_bit_for_bit(march, width):
    lanes, alone = run_exact(march, width, *free_bodies(16))
    assert np.isfinite(lanes).all()
    assert (lanes == alone).all()
