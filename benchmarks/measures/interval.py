"""The interval of a statistic of values that scatter: one bootstrap for every ratio of times.

Two statistics of times use it, because they answer different questions:

* A ratio of two sides (`speed_ratio`) is the geometric mean over all processes, because a user also runs in a slow one. It is
  measured once, in few processes. Its interval is therefore `widened`.
* A ratio of two versions (`versions.times`) compares the faster halves of the processes: the place of code in memory makes some
  processes slower, in either version, and no change of the code explains it. Slower rows are measured again, which keeps false
  alarms out; a widened interval would miss more rows that are slower.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from conservative.attitude import Array

RESAMPLES = 4999
"""Number of resamples of an interval."""


def mean_of(values: Array) -> Array:
    """Return the means over resampled values (..., n)."""
    return np.asarray(values.mean(axis=-1))


def interval(
    values: Array, level: float, statistic: Callable[[Array], Array] = mean_of, widened: bool = False
) -> tuple[float, float]:
    """Return the interval of a statistic, by resampling (Efron and Tibshirani, An Introduction to the Bootstrap, 1993, 13.3).

    Parameters
    ----------
    values
        Independent values in the last axis, (n,) or (m, n) for m quantities that were measured together.
    level
        Probability that the interval contains the true value.
    statistic
        From (..., n), or (..., m, n), to (...).
    widened
        Widen the percentiles, which are too narrow for few values, as Hesterberg does (What teachers should know about the
        bootstrap, 2015, 5.3).

    Returns
    -------
    tuple[float, float]
        Both ends; NaN for fewer than two values.
    """
    from scipy.special import ndtr, stdtrit  # scipy.stats takes as long to import as everything else of a command

    n = values.shape[-1]
    if n < 2:
        return math.nan, math.nan
    tail = (1 - level) / 2
    if widened:
        tail = float(ndtr(-math.sqrt(n / (n - 1)) * stdtrit(n - 1, 1 - tail)))
    resampled = np.moveaxis(values[..., _resamples(n)], -2, 0)
    low, high = np.quantile(statistic(resampled), (tail, 1 - tail))
    return float(low), float(high)


@lru_cache(maxsize=64)
def _resamples(count: int) -> NDArray[np.intp]:
    """Return the indices (RESAMPLES, count) of resampled values; the same every time."""
    drawn = np.random.default_rng(count).multinomial(count, np.full(count, 1 / count), RESAMPLES)
    return np.repeat(np.tile(np.arange(count), RESAMPLES), drawn.ravel()).reshape(RESAMPLES, count)
