"""Distributions of attitudes, found block by block, are those of all bodies at once."""

import math

import numpy as np
import pytest

from conservative.attitude import angle_between, rotation_about
from conservative.integration import distributions
from conservative.integration.distributions import QUANTILES, angle_quantiles, blocks, directions, mean_attitudes, project
from conservative.integration.spread import spread
from conservative.scenes import brick_flip

N = 5000
SPREADS = ("3e-7", "2deg", "any")


@pytest.fixture(scope="module")
def R_WB():
    """Attitudes (N, 3, 3, 3): three samples, each of another spread about another attitude, two bodies of which fail."""
    about = [rotation_about((1, 2, k), 0.5 + k) for k in range(3)]
    R = np.stack([R @ spread(brick_flip(), N, attitude=each)["R_WB0"] for R, each in zip(about, SPREADS, strict=True)], axis=1)
    R[17, 1:] = R[3000, 2] = math.nan
    return R


class OnDisk:
    """What an array on a disk offers, and how much was read of it at once."""

    def __init__(self, values, chunk):
        self.values, self.shape, self.chunks, self.read = values, values.shape, (chunk, *values.shape[1:]), []

    def __getitem__(self, part):
        self.read.append((part.start, len(self.values[part])))
        return self.values[part].tolist()


def test_blocks_are_those_of_the_disk(R_WB, monkeypatch):
    monkeypatch.setattr(distributions, "_BLOCK", 2**17)  # 606 bodies of three samples
    stored = OnDisk(R_WB, 100)
    np.testing.assert_array_equal(np.concatenate(list(blocks(stored))), R_WB)
    assert stored.read[:2] == [(0, 600), (600, 600)]
    np.testing.assert_array_equal(np.concatenate(list(blocks(R_WB, [0, 2]))), R_WB[:, [0, 2]])
    assert max(map(len, blocks(R_WB))) == 606


def finite(R_WB, sample):
    return R_WB[np.isfinite(R_WB[:, sample]).all(axis=(1, 2)), sample]


def test_the_mean_is_the_attitude_that_is_nearest_to_all(R_WB, monkeypatch):
    monkeypatch.setattr(distributions, "_BLOCK", 2**16)
    for sample, mean in enumerate(mean_attitudes(R_WB)):
        R = finite(R_WB, sample)
        assert np.abs(mean.T @ mean - np.eye(3)).max() < 1e-14  # measured 9e-16
        assert np.linalg.det(mean) > 0
        beside = [mean @ rotation_about(axis, angle) for axis in np.eye(3) for angle in (1e-3, -1e-3)]
        assert all(np.sum((R - mean) ** 2) < np.sum((R - other) ** 2) for other in beside)
    np.testing.assert_array_equal(mean_attitudes(R_WB, [1]), mean_attitudes(R_WB)[[1]])


def test_quantiles_are_right_to_a_quarter_of_a_percent(R_WB):
    mean = mean_attitudes(R_WB)
    found = angle_quantiles(R_WB, mean)
    for sample in range(3):
        exact = np.quantile(angle_between(mean[sample], finite(R_WB, sample)), QUANTILES, method="inverted_cdf")
        assert np.abs(found[sample] / exact - 1).max() < 0.0026  # measured 0.0022
    np.testing.assert_array_equal(angle_quantiles(R_WB, mean[[2]], [2]), found[[2]])


def test_quantiles_of_equal_attitudes_and_of_none():
    R = np.tile(rotation_about((1, 2, 3), 1.0), (4, 2, 1, 1))
    R[:, 1] = math.nan
    found = angle_quantiles(R, R[0] * 1.0)
    assert found[0].tolist() == [0, 0, 0]
    assert np.isnan(found[1]).all()


def test_directions_of_what_is_finite(R_WB):
    found = directions(R_WB, np.array([0, 0.6, 0.8]), [0, 2])
    assert found.shape == (2, N - 2, 3)
    np.testing.assert_allclose(found[1, 17], R_WB[18, 2] @ (0, 0.6, 0.8), rtol=1e-15)


@pytest.mark.parametrize("centre", [(0.6, 0.0, 0.8), (0, 0, 1), (0, 0, -1)])
def test_the_disc_is_seen_from_outside_and_keeps_areas(centre):
    around = np.stack([np.cross(centre, (0.28, 0.96, 0)), np.cross(centre, (-0.28, -0.96, 0)), centre])
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    angle = np.array([0.4, 0.4, 0])[:, None]
    points, mean = project(np.cos(angle) * centre + np.sin(angle) * around)
    assert mean == pytest.approx(centre, abs=1e-15)
    assert np.linalg.norm(points, axis=1) == pytest.approx([2 * math.sin(0.2), 2 * math.sin(0.2), 0], abs=1e-15)
    up = np.array([0, 0, 1.0] if abs(centre[2]) < 0.99 else [1.0, 0, 0])
    highest, _ = project(np.stack([centre + 0.1 * up, centre + 0.1 * np.cross(up, centre)]) / math.sqrt(1))
    assert highest[0, 1] > abs(highest[0, 0])
    assert highest[1, 0] > highest[0, 0]


def test_the_opposite_of_the_centre_is_at_the_rim():
    points, _ = project(np.array([[0, 0, 1.0], [0, 0, 1.0], [1e-3, 0, -math.sqrt(1 - 1e-6)]]))
    assert np.linalg.norm(points[2]) == pytest.approx(2, abs=1e-5)
    assert project(np.empty((0, 3)))[1].tolist() == [0, 0, 1]
