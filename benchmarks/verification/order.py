"""Whether errors at several steps show an order of convergence, of any solver: for tests of convergence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from conservative.attitude import Array
from conservative.check import positive_number
from conservative.errors import BadInput
from conservative.number_text import number

from ..measures.convergence_order import MIN_POINTS, SHRINKING, Order, check_points, observed_order
from .finding import Verdict

WITHIN = 0.25
"""Largest difference between a fitted order and the order that it shows: orders of methods are whole or half numbers.

Another order is shown by twice this difference; between both, the errors are undecided."""
WIDEST = 0.35
"""Largest half-width of an interval that shows an order."""
WIDE_PLATEAU = 0.5
"""The same if local slopes near the expected order show it, as they do where the first ones still change."""
NEAR = 0.15
"""Largest distance of a fitted order from the next possible one, if the expected order is wrong.

Where two terms of an error nearly cancel, slopes are regular, but not near a whole number."""
WAY = 0.3
"""Local slopes approach an order if the last three come nearer by more than this part of the distance that is left."""
FALLS, SHARP, FALLS_AT_LEAST = 10.0, 0.05, 3.9
"""Smallest ratio of the largest to the smallest error of a fit that shows an order, unless the half-width is below the second,
and the smallest ratio in any case: three steps, each half of the one before, of a method of order 1.

Errors of 0.3 to 3 that are far from converging fall by a smaller ratio by chance. If errors at shorter steps than those of the
fit are smaller by the last ratio, too, the fit does not show the order at short steps."""


class OrderNotShown(AssertionError):
    """Errors that do not show the expected order, with the `OrderVerdict` as attribute `verdict`."""

    def __init__(self, verdict: OrderVerdict) -> None:
        super().__init__(f"{verdict.sentence}\n{verdict.table}")
        self.verdict = verdict


@dataclass(frozen=True)
class OrderVerdict:
    """Whether errors show an expected order.

    Attributes
    ----------
    verdict
        `Verdict.RIGHT`, `WRONG`, or `UNDECIDED` if the errors do not show any order, or not precisely enough.
    sentence
        The reason, with the order, its interval, and what to do.
    table
        A line for each step, from coarse to fine: step, error, the order between this step and the one before, and whether
        the point is in the fit.
    order
        The fit, an `Order` of `observed_order`.
    """

    verdict: Verdict
    sentence: str
    table: str
    order: Order


def judge_order(
    steps: ArrayLike, errors: ArrayLike, order: float, *, within: float = WITHIN, at_least: bool = False
) -> OrderVerdict:
    """Return whether errors at several steps show an expected order. Parameters and exceptions as in `assert_order`."""
    positive_number("order", order, "the expected order, a finite number above 0, such as 4")
    positive_number("within", within, "a finite number above 0, such as 0.25")
    h, e = check_points(steps, errors)
    if not len(h):
        raise BadInput("steps", "no steps", f"{MIN_POINTS} steps or more")
    found = observed_order(h, e)
    verdict, sentence, shown = _judge(h, e, found, float(order), within, at_least)
    return OrderVerdict(verdict, sentence, _table(h, e, shown), shown)


def assert_order(steps: ArrayLike, errors: ArrayLike, order: float, *, within: float = WITHIN, at_least: bool = False) -> Order:
    """Assert that errors at several steps show an expected order of convergence, and return the fit.

    `observed_order` finds the range of steps in which the error falls with a power of the step, between steps that are too
    coarse and round-off, and fits the order there, with an interval. The errors can be those of any solver, for any problem
    whose solution is known. Six steps or more, each half of the one before, are enough for most methods.

    Parameters
    ----------
    steps, errors
        Step sizes, or anything proportional to them, and the norms of the errors, (n,) each, in any order. Steps are above
        0 and different; errors are 0 or more, and nan or inf for a run that failed.
    order
        The expected order, above 0.
    within
        Largest allowed difference between the fitted order and the expected one. If the interval of the order is wider, the
        order can differ by half of its width.
    at_least
        Also allow higher orders, which problems with a symmetry can have.

    Raises
    ------
    OrderNotShown
        An `AssertionError`: the errors show another order, or none. The message is a sentence and the table of the errors;
        `verdict.verdict` distinguishes another order (`Verdict.WRONG`) from none (`Verdict.UNDECIDED`).
    BadInput
        The shapes differ, a step is not above 0, not finite or not unique, an error is below 0, or the order is not above 0.
    """
    judged = judge_order(steps, errors, order, within=within, at_least=at_least)
    if judged.verdict is not Verdict.RIGHT:
        raise OrderNotShown(judged)
    return judged.order


def _judge(h: Array, e: Array, found: Order, order: float, within: float, at_least: bool) -> tuple[Verdict, str, Order]:
    """Return the verdict, the sentence, and the fit that shows it.

    A plateau of local slopes shows an order, and so does a precise fit, if the errors scatter.
    """
    within = within * min(1.0, order)
    plateau = _plateau(h, e, order, within)
    if plateau and _agree(h, e, plateau, order, within) and _width(line := _fit(h, e, plateau, found)) <= WIDE_PLATEAU:
        return Verdict.RIGHT, f"{_describe(h, line)}, {order:g} is expected", line
    if found.reason:
        return Verdict.UNDECIDED, f"the errors do not show an order: {_why_none(h, e, found)}", found
    text = _describe(h, found)
    none = f"the errors show no single order: {text}"
    used = sorted(found.used, key=lambda i: -h[i])
    half = _width(found)
    if half > WIDEST or (e[used].max() < FALLS * e[used].min() and half > SHARP):
        return Verdict.UNDECIDED, f"{none}. Compute more steps, shorter ones or between these", found
    finer = e[(h < h[used].min()) & np.isfinite(e) & ~(e <= found.floor)]
    if len(finer) and finer.min() < e[used].min() / FALLS_AT_LEAST:
        return Verdict.UNDECIDED, f"{none}, but they fall differently at shorter steps", found
    local = _slopes(h, e, used)
    near = abs(found.slope - order) <= within
    if near and abs(local[-1] - order) <= 2 * within and not _leaves(local, order):
        return Verdict.RIGHT, f"{text}, {order:g} is expected", found
    if at_least and found.slope > order + within:
        return Verdict.RIGHT, f"{text}, {order:g} or more is expected", found
    sharp = half <= SHARP and len(local) >= MIN_POINTS and np.ptp(local) <= 2 * SHARP
    between = local.min() - within <= order <= local.max() + within or abs(found.slope - order) <= 2 * within
    if near or (not sharp and (between or _off(found.slope) > NEAR or _approaches(local, order))):
        return Verdict.UNDECIDED, f"{none}, and {order:g} is expected", found
    hint = "; at_least=True allows higher orders" if found.slope > order else ""
    return Verdict.WRONG, f"{text}, but {order:g} is expected{hint}", found


def _slopes(h: Array, e: Array, points: Sequence[int]) -> Array:
    """Return the order between each of some points and the next one."""
    slopes: Array = np.diff(np.log(e[list(points)])) / np.diff(np.log(h[list(points)]))
    return slopes


def _plateau(h: Array, e: Array, order: float, within: float) -> list[int]:
    """Return the points, coarse to fine, of the longest range in which all local slopes are near an order; empty without one.

    Slopes after the range may fall to 0, because round-off begins, but not settle on another order or rise, and those in the
    range may not move away from the order throughout.
    """
    points = [int(i) for i in np.argsort(-h) if math.isfinite(e[i]) and e[i] > 0]
    if len(points) < MIN_POINTS:
        return []
    slopes = _slopes(h, e, points)
    best, first = (0, 0), 0
    for end in range(len(slopes) + 1):
        if end == len(slopes) or abs(slopes[end] - order) > within:
            if end - first >= best[1] - best[0]:
                best = first, end
            first = end + 1
    first, end = best
    after = slopes[end:]
    pairs = [min(a, b) if abs(a - b) <= within else 0.0 for a, b in pairwise(after)]
    settles = max(pairs, default=0.0) > SHRINKING * order or any(min(two) > SHRINKING for two in pairwise(pairs))
    rises = len(after) > 0 and after[0] > order + within
    plateau, before = points[first : end + 1], slopes[:first]
    # A coarser step with an error as small makes the descent chance; a steeper descent before it makes a short one round-off.
    chance = e[points[:first]].min(initial=math.inf) <= 2 * e[plateau[-1]]
    tail = len(plateau) <= MIN_POINTS and any(min(a, b) > order + within and abs(a - b) <= within for a, b in pairwise(before))
    short = len(plateau) < MIN_POINTS or e[plateau[0]] < FALLS_AT_LEAST * e[plateau[-1]]
    return [] if short or chance or tail or settles or rises or _leaves(slopes[first:end], order) else plateau


def _leaves(local: Array, order: float) -> bool:
    """Return whether each of three local slopes or more is further from an order than the one before, by 0.05 in all."""
    distances = np.abs(local - order)
    return len(local) >= MIN_POINTS and bool((np.diff(distances) > 0).all()) and distances[-1] - distances[0] > SHARP


def _approaches(local: Array, order: float) -> bool:
    """Return whether the last three local slopes come nearer to an order one by one, and the way left is short."""
    last = local[-MIN_POINTS:]
    moved = abs(last[0] - order) - abs(last[-1] - order)
    return len(last) == MIN_POINTS and _leaves(last[::-1], order) and moved > WAY * abs(last[-1] - order)


def _agree(h: Array, e: Array, plateau: list[int], order: float, within: float) -> bool:
    """Return whether the errors before the end of a plateau do not contradict it: three points can be chance.

    Later errors are not asked, because round-off makes them larger than the order says.
    """
    before = h >= h[plateau[-1]]
    found = observed_order(h[before], e[before])
    low, high = found.interval
    precise = high - low <= 4 * within or len(plateau) > MIN_POINTS
    return bool(found.reason) or (precise and low - within <= order <= high + within)


def _fit(h: Array, e: Array, points: list[int], found: Order) -> Order:
    fitted = observed_order(h[points], e[points])
    return replace(fitted, used=tuple(points[i] for i in fitted.used), floor=found.floor) if not fitted.reason else found


def _width(found: Order) -> float:
    """Return the half-width of the interval of an order."""
    low, high = found.interval
    return (high - low) / 2


def _describe(h: Array, found: Order) -> str:
    low, high = found.interval
    used = h[list(found.used)]
    return f"order {found.slope:.2f} ({low:.2f} to {high:.2f}) at steps {used.max():g} to {used.min():g}"


def _off(slope: float) -> float:
    """Return the distance of a slope from the nearest order that methods have: whole numbers, 1/2 and 3/2."""
    return min(abs(slope - possible) for possible in (0.5, 1.5, max(round(slope), 1)))


def _why_none(h: Array, e: Array, found: Order) -> str:
    """Return why there is no fit, and what to do."""
    ordered = e[np.argsort(-h)]
    ordered = ordered[np.isfinite(ordered)]
    if len(ordered) >= MIN_POINTS and (np.diff(ordered) > 0).all() and ordered[-1] > FALLS_AT_LEAST * ordered[0]:
        return (
            f"they grow from {number(float(ordered[0]))} at the longest step to {number(float(ordered[-1]))} at the "
            "shortest one. "
            "If the steps are numbers of steps, give step sizes, such as the duration divided by these numbers"
        )
    if not math.isnan(found.floor) and ordered.max() < 10 * found.floor:
        return (
            f"they do not fall with the step, from {number(float(ordered[0]))} at the longest one to "
            f"{number(float(ordered[-1]))} at the shortest one. "
            "Round-off, a tolerance of a solver, an error of the reference or a method that does not converge can be the reason"
        )
    floor = "" if math.isnan(found.floor) else f", and fine steps only reach a floor of {number(found.floor)}"
    return f"{found.reason}{floor}. Compute more steps between the coarsest and the finest one"


def _table(h: Array, e: Array, found: Order) -> str:
    lines, before = ["step          error       order"], None
    for i in np.argsort(-h):
        local = ""
        if before is not None and e[i] > 0 and e[before] > 0 and math.isfinite(e[i]) and math.isfinite(e[before]):
            local = f"{math.log(e[before] / e[i]) / math.log(h[before] / h[i]):5.2f}"
        mark = "  in the fit" if int(i) in found.used else ""
        lines.append(f"{h[i]:<12.6g}  {e[i]:<10.3e}  {local}{mark}".rstrip())
        before = i
    return "\n".join(lines)
