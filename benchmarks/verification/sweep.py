"""Two back ends with several steps and settings: where they agree, and which of them converges to the exact motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import Any

import numpy as np

from conservative.attitude import Array, angle_between
from conservative.errors import IntegrationFailed, Unsupported
from conservative.grid import Grid
from conservative.number_text import number, short_power

from ..measures.convergence_order import MIN_POINTS, Order, observed_order
from .back_ends import Runnable
from .compare import ROUND_OFF, take_rows
from .motions.motion import Motion
from .programs import RESOLVED, Solve, in_principal_axes, is_generic
from .solution import States, truth
from .which import UNITS

PARTS = (1, 2, 4, 8, 16, 32, 64)
"""Steps in 0.1 rad, from coarse to fine."""
LEVELS = (1e-3, 1e-6)
"""Differences, rad or relative to the largest rate, at which two back ends agree."""
ELSEWHERE = 3.0
"""Error at the shortest step over the change by the last halving of the step, from which steps do not explain the error."""
CONVERGES = 0.5
"""Smallest order of a method that converges."""
AT_ROUNDING, AT_TOLERANCE = 1e-5, 1e-3
"""Errors at the shortest step that rounding and tolerances of iterations explain, and the tolerance of a chosen step."""
RATES_SHOW = 100.0
"""Error of rates over the error of attitudes, at the shortest step, from which a sweep shows rates."""
FEWER, BELOW = PARTS[:5], 0.3
"""Steps in 0.1 rad at which an order is measured without the exact motion, and how far it may be below a whole number."""


class Limit(StrEnum):
    """The limit of a back end as its steps become shorter."""

    EXACT = "the exact motion"
    OTHER = "another motion"
    NOTHING = "no motion"
    UNKNOWN = "unknown"


@dataclass(frozen=True, eq=False)
class Series:
    """Errors of two back ends for the values of a setting, from coarse to fine; nan where a run failed.

    Attributes
    ----------
    setting, of
        "step", or the name of a setting and of the back end that has it.
    values
        Values: of the step, s.
    first, second, between
        Largest errors of both, and their largest difference: of attitudes, rad, or of rates, relative to the largest rate, if
        one of them has no attitudes. Beside a setting of one of them, the other one has its shortest step.
    """

    setting: str
    of: str
    values: tuple[Any, ...]
    first: tuple[float, ...]
    second: tuple[float, ...]
    between: tuple[float, ...]

    def agree(self, level: float) -> Any:
        """Return the coarsest value from which on all differences are at most `level`; None if the finest one is larger."""
        good = None
        for value, difference in zip(reversed(self.values), reversed(self.between), strict=True):
            if not difference <= level:
                break
            good = value
        return good


@dataclass(frozen=True, eq=False)
class Convergence:
    """How a back end converges.

    Attributes
    ----------
    limit
        What it converges to.
    order
        The fit to its errors.
    error
        The error at the shortest step.
    own
        The order with which its motions with different steps approach each other, nan if that is not known.
    """

    limit: Limit
    order: Order
    error: float
    own: float


@dataclass(frozen=True, eq=False)
class Sweep:
    """A motion with several steps and settings.

    Attributes
    ----------
    motion
        Its name.
    unit
        "rad", or "of the largest rate" if one of the back ends has no attitudes.
    series
        The steps, then the other settings.
    first, second
        How each back end converges.
    between
        The fit to the differences between them.
    """

    motion: str
    unit: str
    series: tuple[Series, ...]
    first: Convergence
    second: Convergence
    between: Order

    @property
    def steps(self) -> Series:
        """The series of steps."""
        return self.series[0]


def choose(motions: Sequence[Motion], supported: Callable[[Motion], bool]) -> Motion | None:
    """Return the motion of a sweep: of the user's body, or else the longest generic free motion that both support."""
    able = [motion for motion in motions if supported(motion)]
    own = [motion for motion in able if motion.own]
    free = [motion for motion in able if not motion.features]
    generic = [motion for motion in free if is_generic(motion)]
    return max(own or generic or free or able, key=lambda motion: motion.steps * motion.samples, default=None)


def _run(solve: Solve, motion: Motion, principal: bool, parts: int) -> States:
    """Return the samples of a motion with `parts` steps in 0.1 rad, in its body axes; (None, None) if the run failed."""
    every = motion.steps * parts
    asked = in_principal_axes(motion) if principal else motion
    grid = Grid(motion.step / parts, every * motion.samples, every)
    try:
        answer = solve(asked.scene, grid)
    except (Unsupported, IntegrationFailed):
        return None, None
    if len(answer.t) < grid.n_samples:
        return None, None
    return in_body_axes(take_rows((answer.R_WB, answer.w_WB_B), slice(1, None)), motion, asked)


def in_body_axes(data: States, motion: Motion, asked: Motion) -> States:
    """Return samples of a body in principal axes, if it was `asked` in these, in the body axes of a motion."""
    if asked is motion:
        return data
    C = motion.scene.body.R_BP
    return None if data[0] is None else data[0] @ C.T, None if data[1] is None else data[1] @ C.T


def apart(first: States, second: States, scale: float) -> tuple[float, float]:
    """Return the largest differences of two motions: of attitudes, rad, and of rates, relative; nan where one has none."""
    turned = rates = math.nan
    with np.errstate(all="ignore"):
        if first[0] is not None and second[0] is not None:
            turned = float(angle_between(first[0], second[0]).max())
        if first[1] is not None and second[1] is not None:
            rates = float(np.linalg.norm(first[1] - second[1], axis=1).max()) / scale
    return turned, rates


def changes(runs: Sequence[States], part: int) -> Array:
    """Return how much motions change from each step to the next shorter one (n - 1,): attitudes, rad (part 0), or rates (1)."""
    rates = [float(np.abs(w).max()) for _, w in runs if w is not None]
    scale = max(rates, default=1.0) or 1.0
    return np.array([apart(a, b, scale)[part] for a, b in pairwise(runs)])


def own_order(steps: Sequence[float], made: Array, floor: float) -> float:
    """Return the order by which motions approach each other, from how much they change; nan if that is round-off.

    It needs no exact motion, so wrong equations do not affect it.
    """
    good = [k for k, size in enumerate(made) if floor < size < 1.0]
    slopes = [math.log(made[i] / made[j]) / math.log(steps[i] / steps[j]) for i, j in pairwise(good) if j == i + 1]
    return slopes[-1] if slopes else math.nan


@dataclass(frozen=True)
class Measured:
    """An order that was measured without the exact motion, 1 to 4; None if no order was found, for the `reason`.

    The reason is a sentence about the back end without a subject, "" with an order.
    """

    order: int | None
    reason: str = ""


def measured_order(found: Runnable, motions: Sequence[Motion]) -> Measured:
    """Return the order of a back end by its own convergence.

    If the motions do not approach each other, it is 1: the order with the largest tolerances.
    """
    orders, depends, compared, floor = list[float](), False, 0, RESOLVED["f32" if found.single else "f64"]
    for motion in motions:
        runs = [_run(found.solve, motion, found.principal, n) for n in FEWER]
        part = int(any(R is None for R, _ in runs))
        made = changes(runs, part)
        compared += int(np.isfinite(made).sum())
        depends = depends or bool((made > floor).any())
        orders.append(own_order([motion.step / n for n in FEWER], made, floor))
    known = [order for order in orders if not math.isnan(order)]
    if known:
        return Measured(int(np.clip(math.floor(float(np.median(known)) + BELOW), 1, 4)))
    if depends:
        return Measured(1)
    if not compared:
        return Measured(None, "its order is not measured: no two of its runs with different steps have finite samples")
    if found.single:
        return Measured(None, f"its order is not measured: its motions change with the step by less than {floor:g} rad")
    return Measured(None, "its motions do not depend on the step, measured without the exact motion")


def sweep(first: Runnable, second: Runnable, motion: Motion, tell: Callable[[str], object] = lambda what: None) -> Sweep:
    """Run a motion with several steps, and with the other settings of both back ends."""
    sides, steps = (first, second), [motion.step / n for n in PARTS]
    runs = list[list[States]]()
    for side in sides:
        tell(f"{side.name}: steps of {motion.name}")
        runs.append([_run(side.solve, motion, side.principal, n) for n in PARTS])
    exact = truth(motion.scene, 0.0, np.array(motion.t))
    scale = float(np.linalg.norm(exact[1], axis=1).max()) or 1.0
    # Attitudes, unless rates show far more, such as rates in other axes, or one of both has no attitudes.
    finest = np.array([apart(some[-1], exact, scale) for some in runs])
    turned, rates = np.where(np.isfinite(finest).all(axis=0), finest, -1.0).max(axis=0)
    part = int(turned < 0 or rates > RATES_SHOW * max(turned, RESOLVED["f64"]))

    def error(data: States, of: States = exact) -> float:
        size = apart(data, of, scale)[part]
        return size if math.isfinite(size) else math.nan

    errors = [tuple(map(error, some)) for some in runs]
    between = tuple(error(a, b) for a, b in zip(*runs, strict=True))
    series = [Series("step", "", tuple(steps), errors[0], errors[1], between)]
    for k, side in enumerate(sides):
        other = runs[1 - k][-1]
        for setting in side.settings:
            tell(f"{side.name}: {setting.name}")
            # A number, such as a tolerance or a number of substeps, shows most where the step is coarse.
            parts = PARTS[0] if isinstance(setting.values[0], int | float) else PARTS[-1]
            made = [_run(solve, motion, side.principal, parts) for solve in setting.solvers]
            own, theirs = tuple(map(error, made)), (error(other),) * len(made)
            both = (own, theirs) if k == 0 else (theirs, own)
            series.append(Series(setting.name, side.name, setting.values, *both, tuple(error(run, other) for run in made)))
    converged = [_convergence(some, part, steps, size, side) for some, size, side in zip(runs, errors, sides, strict=True)]
    return Sweep(motion.name, UNITS[part], tuple(series), converged[0], converged[1], observed_order(steps, between))


def _convergence(
    runs: Sequence[States], part: int, steps: Sequence[float], errors: Sequence[float], side: Runnable
) -> Convergence:
    made, last = changes(runs, part), errors[-1]
    above = [size if size > ROUND_OFF else math.nan for size in errors]  # round-off would make the line bend
    order = observed_order(steps, above if sum(map(math.isfinite, above)) >= MIN_POINTS else errors)
    own = own_order(steps, made, RESOLVED["f32" if side.single else "f64"])
    chooses = side.order is None and not side.measures_order  # its steps, by a tolerance that limits its error
    if math.isnan(last):
        limit = Limit.UNKNOWN
    elif last <= (AT_TOLERANCE if chooses else AT_ROUNDING * (10 if side.single else 1)):
        limit = Limit.EXACT
    elif last > ELSEWHERE * made[-1]:
        limit = Limit.OTHER
    else:
        limit = Limit.NOTHING if order.reason or order.slope < CONVERGES else Limit.EXACT
    return Convergence(limit, order, last, own)


def sentence(name: str, convergence: Convergence, unit: str) -> str:
    """Return how a back end converges, as a sentence without its end."""
    error, order = f"{number(convergence.error)} {unit}", convergence.order
    if convergence.limit is Limit.UNKNOWN:
        return f"{name} does not run with the shortest step"
    if convergence.limit is Limit.OTHER:
        by = "" if math.isnan(convergence.own) else f" with order {convergence.own:.1f}"
        return f"{name} converges{by} to another motion, {error} from the exact one"
    if convergence.limit is Limit.NOTHING:
        return f"{name} does not converge: its error is {error} at the shortest step"
    if order.reason or order.slope < CONVERGES:
        return f"{name} is within {error} of the exact motion, and its error does not fall with the step"
    floor = "" if math.isnan(order.floor) else f", down to {number(order.floor)} {unit}"
    return f"{name} converges to the exact motion with order {order.slope:.2f} ± {max(order.stderr, 0.01):.2f}{floor}"


def sentences(first: str, second: str, result: Sweep) -> list[str]:
    """Return sentences on how each back end converges, whether both approach each other, and where they agree."""
    out = [sentence(first, result.first, result.unit), sentence(second, result.second, result.unit)]
    limits, steps = (result.first.limit, result.second.limit), result.steps
    if limits == (Limit.OTHER, Limit.OTHER) and steps.between[-1] < 0.1 * min(result.first.error, result.second.error):
        out.append(
            f"both converge to each other ({number(steps.between[-1])} {result.unit} at the shortest step), but not to the "
            "exact motion"
        )
    for series in result.series:
        out += [f"they agree to {_power(level)} {result.unit} {_where(series, level)}" for level in LEVELS]
    return out


def _power(level: float) -> str:
    return short_power(f"{level:.0e}")


def _where(series: Series, level: float) -> str:
    """Return from which value of a setting on two back ends agree."""
    value = series.agree(level)
    if series.setting == "step":
        return "at no step of the sweep" if value is None else f"from a step of {number(value, 3)} s on"
    what = f"{series.setting} of {series.of}"
    return f"at no value of {what}" if value is None else f"from {what} = {value} on"
