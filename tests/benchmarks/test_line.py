import numpy as np
import pytest
from scipy.stats import linregress

from conservative.benchmarks.measures.line import fit_line

X = np.linspace(-2.0, 3.0, 40)


def test_a_line_through_noise_is_that_of_scipy():
    y = 0.3 * X - 1 + 0.1 * np.random.default_rng(1).normal(size=len(X))
    found, expected = fit_line(X, y), linregress(X, y)
    assert (found.slope, found.stderr) == pytest.approx((expected.slope, expected.stderr), rel=1e-12)
    assert 0.08 < found.scatter < 0.12  # 0.1 was put in


def test_the_scatter_of_points_nearly_on_a_line_keeps_its_digits():
    noise = 1e-11 * np.random.default_rng(2).normal(size=len(X))
    far, near = fit_line(X, noise), fit_line(X, X + noise)
    assert near.slope == pytest.approx(1, abs=1e-11)
    assert near.scatter == pytest.approx(far.scatter, rel=1e-3)  # measured 5e-6; linregress is off by a factor
    assert near.stderr == pytest.approx(far.stderr, rel=1e-3)
