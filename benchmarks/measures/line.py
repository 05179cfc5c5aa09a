"""A straight line through points, by least squares."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from conservative.attitude import Array


class Line(NamedTuple):
    """A fitted line: its slope and the standard error of that, and the scatter of the points about it, in y's unit."""

    slope: float
    stderr: float
    scatter: float


def fit_line(x: Array, y: Array) -> Line:
    """Return the line through three points or more, x (n,) and y (n,), any units.

    The scatter is that of the residuals: the standard error that `linregress` makes of 1 - r^2 has lost its digits where the
    points lie on a line.
    """
    from scipy.stats import linregress  # here, as importing it takes as long as everything else of a command

    found = linregress(x, y)
    residuals = (y - y.mean()) - found.slope * (x - x.mean())
    scatter = float(np.sqrt(np.sum(residuals**2) / (len(x) - 2)))
    return Line(float(found.slope), scatter / float(np.linalg.norm(x - x.mean())), scatter)
