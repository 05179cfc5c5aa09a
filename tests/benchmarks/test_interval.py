"""The interval of a statistic, compared with Student's interval of a mean."""

import numpy as np
import pytest
from scipy import stats

from conservative.benchmarks.measures.interval import interval, mean_of


@pytest.mark.parametrize(("n", "level"), [(5, 0.8), (8, 0.9), (20, 0.95)])
def test_the_widened_interval_of_a_mean_has_the_width_of_students(n, level):
    samples = np.random.default_rng(12).normal(3.0, 0.2, (40, n))
    ends = np.array([interval(sample, level, mean_of, widened=True) for sample in samples])
    width = np.diff(ends).mean() / np.mean([2 * stats.t.ppf((1 + level) / 2, n - 1) * stats.sem(sample) for sample in samples])
    assert width == pytest.approx(1.0, abs=0.03)  # measured 1.006, 0.986, 1.002
    assert np.diff([interval(sample, level, mean_of) for sample in samples]).mean() < 0.97 * np.diff(ends).mean()


def test_one_value_has_no_interval():
    assert np.isnan(interval(np.ones(1), 0.95)).all()
