"""A straight line through points, by least squares."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from conservative.attitude import Array


class FittedLine(NamedTuple):
    """A fitted line: slope, its standard error, and the scatter of the points in the unit of y."""

    slope: float
    stderr: float
    scatter: float


def fit_line(x: Array, y: Array) -> FittedLine:
    """Return the line through three points or more, x (n,) and y (n,).

    The scatter is computed from the residuals, because the standard error of `linregress`, from 1 - r^2, loses its digits if
    the points lie on a line.
    """
    from scipy.stats import linregress  # here, as importing it takes as long as everything else of a command

    found = linregress(x, y)
    residuals = (y - y.mean()) - found.slope * (x - x.mean())
    scatter = float(np.sqrt(np.sum(residuals**2) / (len(x) - 2)))
    return FittedLine(float(found.slope), scatter / float(np.linalg.norm(x - x.mean())), scatter)
