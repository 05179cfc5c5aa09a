"""Orders of several versions over the same steps, as an order depends a little on the steps that it is fitted to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from ..measures.convergence_order import MIN_POINTS, observed_order
from .observation import Fit, Observation

NO_STEP = "its accuracy does not depend on dt"


def fit_orders(observations: Sequence[Observation]) -> tuple[Observation, ...]:
    """Return the observations of one setting on one scene with their orders, over the steps that all versions had time for."""
    steps = _common_steps(observations)
    return tuple(_with_orders(each, steps) for each in observations)


def _common_steps(observations: Sequence[Observation]) -> set[float]:
    """Return the steps, s; a version with too few of them for a fit has no say."""
    reached = [{point.dt for point in each.points if point.reached} for each in observations]
    enough = [steps for steps in reached if len(steps) >= MIN_POINTS]
    return set.intersection(*enough) if enough else set()


def _with_orders(seen: Observation, steps: set[float]) -> Observation:
    if not seen.outcome.ok:
        return seen
    if not seen.points:
        return replace(seen, attitude_order=Fit(reason=NO_STEP), rates_order=Fit(reason=NO_STEP))
    points = [point for point in seen.points if point.dt in steps]
    dts = [point.dt for point in points]
    attitude, rates = _fit(dts, [point.attitude for point in points]), _fit(dts, [point.rates for point in points])
    return replace(seen, attitude_order=attitude, rates_order=rates)


def _fit(steps: Sequence[float], errors: Sequence[float]) -> Fit:
    order = observed_order(steps, errors)
    return Fit(order.slope, order.stderr, order.reason) if not order.reason else Fit(math.nan, math.nan, order.reason)
