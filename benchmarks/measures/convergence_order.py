"""Observed order of convergence: a fit to all points that show it, never to two."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from conservative.attitude import Array
from conservative.check import finite_array, numbers
from conservative.errors import BadInput

MIN_POINTS = 3
"""Smallest number of points of a fit."""
SHRINKING = 1 / 3
"""An error decreases with the step size if its local slope is above this fraction of the steepest slope."""
ABOVE_FLOOR = 10.0
"""Ratio of a point to the floor from which the floor changes it by less than a tenth."""
BEND, CALMER = 0.05, 1.1
"""Drop the coarsest point if its slope differs by more than BEND, relative, and the scatter falls by more than a factor CALMER.

Dropping a point of a bend lessens the scatter; dropping one of noise does not."""

AGREE = 0.015
"""Successive slopes agree if they differ by at most this, relative."""
BENT, MOVES = 3.0, 2.0
"""Standard errors of a curvature that is no noise, and the factor by which the slope may move beyond the finest step.

RK4 on the brick has slopes 4.53, 4.44, 4.28, 4.15, 4.06, 4.03: a slow program that reaches the first three and a fast one had
orders of 4.42 +- 0.04 and 4.08 +- 0.02."""

CONFIDENCE = 0.95
"""Probability that the interval of an order contains it, if the scatter of the points is random."""
GROWTH, NO_ROUND_OFF = 3.0, 1e-9
"""Factor and size of an error at the shortest step that has grown, and not only by round-off in double precision."""


@dataclass(frozen=True)
class Order:
    """A fitted order.

    Attributes
    ----------
    slope, stderr
        d log(error) / d log(step), and its standard error or, if the line is bent, how far the slope at shorter steps may be
        from it; nan where there is no fit.
    used
        Indices of the points in the fit, into the arguments, coarsest step first.
    floor
        The largest error at steps where the error no longer shrinks; nan where the data do not reach a floor.
    reason
        Reason why there is no fit; empty if there is one.
    interval
        Interval of 95 % of the order, by Student's distribution, widened to the order that shorter steps may have if the line
        is bent; nan where there is no fit.
    """

    slope: float = math.nan
    stderr: float = math.nan
    used: tuple[int, ...] = ()
    floor: float = math.nan
    reason: str = ""
    interval: tuple[float, float] = (math.nan, math.nan)

    def __str__(self) -> str:
        if self.reason:
            return self.reason
        floor = "" if math.isnan(self.floor) else f" above a floor of {self.floor:.1e}"
        return f"{self.slope:.2f} +- {self.stderr:.2f} from {len(self.used)} points{floor}"


def observed_order(steps: ArrayLike, errors: ArrayLike) -> Order:
    """Fit log(error) = slope log(step) + constant where the data show convergence.

    The data are divided into three parts, from coarse to fine:

    1. The descent is the range of neighbouring points with the largest decrease of the error in which each local slope is above
       `SHRINKING` of the steepest. The steepest is the second largest slope over three neighbours, so that a single zero does
       not determine it. Coarser points have not begun to converge. If one of them is as small as the end of the descent, the
       descent was chance and there is no order.
    2. Points finer than the end of the descent have reached the floor, the largest error from there on. Points within
       `ABOVE_FLOOR` of it are not used. If the last pair has less than half the slope of the rest, its finer point is
       not used either.
    3. The coarsest point is dropped as long as the slope of its pair differs from the fit to the others by more than `BEND`,
       the scatter decreases by more than `CALMER`, and at least four points remain.

    4. If the points that are left bend more than their scatter, the longest sequence whose successive slopes agree is used,
       the finest of several. If none agree, all are used.

    Failed runs, whose error is not finite, are skipped. Errors of zero are at the floor.

    Parameters
    ----------
    steps, errors
        (n,) each, in any order. Step sizes are above 0 and different.

    Raises
    ------
    BadInput
        The shapes differ, or a step size is not finite, not above 0, or not unique.
    """
    from scipy.special import stdtrit  # scipy.stats takes as long to import as everything else of a command

    h, e = check_points(steps, errors)
    order = [int(i) for i in np.argsort(-h) if math.isfinite(e[i])]
    if len(order) < MIN_POINTS:
        return Order(reason=f"{len(order)} runs with an error; a fit takes {MIN_POINTS}")
    x = np.log(h[order])
    y = np.log(np.maximum(e[order], np.finfo(float).tiny))
    first, last = _descent(x, y)
    floor = float(e[order[last:]].max()) if last < len(order) - 1 else math.nan
    used = [i for i in range(first, last + 1) if not e[order[i]] <= ABOVE_FLOOR * floor and e[order[i]] > 0]
    used = _without_preasymptotic(x, y, _without_bend(x, y, used) if math.isnan(floor) else used)
    if len(used) < MIN_POINTS:
        reason = f"{len(used)} points between the coarsest steps and the floor; a fit takes {MIN_POINTS}"
        return Order(floor=floor, reason=reason)
    if _trend(x[used], y[used]):
        used = _where_slopes_agree(x, y, used)
    line, trend = fit_line(x[used], y[used]), _trend(x[used], y[used])
    half = max(line.stderr * float(stdtrit(len(used) - 2, (1 + CONFIDENCE) / 2)), trend)
    interval = line.slope - half, line.slope + half
    return Order(line.slope, max(line.stderr, trend), tuple(order[i] for i in used), floor, "", interval)


def grows_with_shorter_steps(steps: ArrayLike, errors: ArrayLike) -> bool:
    """Return whether the error at the shortest step is more than `GROWTH` times the smallest one, and no round-off.

    Parameters and exceptions as in `observed_order`.
    """
    h, e = check_points(steps, errors)
    finite = np.isfinite(e)
    if np.count_nonzero(finite) < MIN_POINTS:
        return False
    last = e[finite][np.argmin(h[finite])]
    return bool(last > max(GROWTH * e[finite].min(), NO_ROUND_OFF))


def check_points(steps: ArrayLike, errors: ArrayLike) -> tuple[Array, Array]:
    """Return both as arrays (n,). Raise `BadInput` if they are invalid."""
    e = numbers("errors", errors)
    h = finite_array("steps", steps, (e.shape,), f"as many finite steps as there are errors, {e.shape}")
    if h.ndim != 1 or (h <= 0).any() or len(np.unique(h)) < len(h):
        raise BadInput("steps", h.tolist(), "a list of different steps above 0")
    if (e < 0).any():
        raise BadInput("errors", e.tolist(), "errors of 0 or more, or nan")
    return h, e


def _descent(x: Array, y: Array) -> tuple[int, int]:
    """Return first and last index of the range of decreasing errors with the largest decrease."""
    steepest = np.sort((y[:-2] - y[2:]) / (x[:-2] - x[2:]))[-2:][0]
    best, first = (0, 0), 0
    for last in range(1, len(x)):
        if not y[last - 1] - y[last] > max(SHRINKING * steepest, 0.0) * (x[last - 1] - x[last]):
            first = last
        if y[first] - y[last] > y[best[0]] - y[best[1]]:
            best = first, last
    first, last = best
    return best if y[last] < y[: first + 1].min() else (0, 0)


def _without_bend(x: Array, y: Array, used: list[int]) -> list[int]:
    if len(used) <= MIN_POINTS:
        return used
    rest = fit_line(x[used[:-1]], y[used[:-1]])
    return used[:-1] if _pair(x, y, used[-2:]) < rest.slope / 2 else used


def _without_preasymptotic(x: Array, y: Array, used: list[int]) -> list[int]:
    while len(used) > MIN_POINTS:
        whole, rest = fit_line(x[used], y[used]), fit_line(x[used[1:]], y[used[1:]])
        bend = abs(_pair(x, y, used[:2]) - rest.slope)
        if bend <= BEND * abs(rest.slope) or whole.scatter <= CALMER * rest.scatter:
            break
        used = used[1:]
    return used


def _where_slopes_agree(x: Array, y: Array, used: list[int]) -> list[int]:
    slopes, first, best = [_pair(x, y, pair) for pair in pairwise(used)], 0, (0, 0)
    for last in range(1, len(slopes)):
        if abs(slopes[last] - slopes[last - 1]) > AGREE * abs(slopes[last]):
            first = last
        elif last - first >= best[1] - best[0]:
            best = first, last
    return used[best[0] : best[1] + 2] if best[1] > best[0] else used


def _trend(x: Array, y: Array) -> float:
    """Return how far the order at shorter steps may be from the slope of the line, by a parabola; 0 if its bend is noise."""
    x = x - x.mean()
    terms = np.vander(x, 3)
    fitted, residuals, *_ = np.linalg.lstsq(terms, y, rcond=None)
    noise = math.sqrt(float(residuals[0]) / (len(x) - 3) * np.linalg.inv(terms.T @ terms)[0, 0]) if len(x) > 3 else 0.0
    at_the_end = float(2 * fitted[0] * x.min() + fitted[1])
    return MOVES * abs(at_the_end - fit_line(x, y).slope) if abs(fitted[0]) > BENT * noise else 0.0


def _pair(x: Array, y: Array, pair: Sequence[int]) -> float:
    i, j = pair
    return float((y[i] - y[j]) / (x[i] - x[j]))


class FittedLine(NamedTuple):
    """A fitted line: slope, its standard error, and the scatter of the points in the unit of y."""

    slope: float
    stderr: float
    scatter: float


def fit_line(x: Array, y: Array) -> FittedLine:
    """Return the least-squares line through three points or more, x (n,) and y (n,).

    The scatter is computed from the residuals: from 1 - r^2 it would lose its digits where the points lie on a line.
    """
    dx, dy = x - x.mean(), y - y.mean()
    slope = dx @ dy / (dx @ dx)
    scatter = float(np.linalg.norm(dy - slope * dx)) / math.sqrt(len(x) - 2)
    return FittedLine(float(slope), scatter / float(np.linalg.norm(dx)), scatter)
