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
from conservative.number_text import number

from ..measures.convergence_order import Order, observed_order
from .back_ends import Runnable
from .compare import FLOOR, States, take_rows
from .motions.motion import Motion
from .programs import RESOLVED, Solve, in_principal_axes
from .solution import truth

PARTS = (1, 2, 4, 8, 16, 32, 64)
"""Steps in 0.1 rad, from coarse to fine."""
LEVELS = (1e-3, 1e-6)
"""Differences, rad or relative to the largest rate, at which two back ends agree."""
ELSEWHERE = 3.0
"""Error at the shortest step over the change by the last halving of the step, from which steps do not explain the error."""
CONVERGES = 0.5
"""Smallest order of a method that converges."""


class Limit(StrEnum):
    """What a back end converges to as its steps become shorter."""

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
    longest = max(own or free or able, key=lambda motion: motion.steps * motion.samples, default=None)
    return longest


@dataclass(frozen=True, eq=False)
class Run:
    """Samples of a run at the times of a motion, in the body axes of the motion, or None for a run that failed."""

    data: States

    @property
    def failed(self) -> bool:
        """Whether there are no samples."""
        return all(part is None for part in self.data)


def _run(solve: Solve, motion: Motion, principal: bool, parts: int) -> Run:
    """Return the samples of a motion with `parts` steps in 0.1 rad."""
    every = motion.steps * parts
    asked = in_principal_axes(motion) if principal else motion
    grid = Grid(motion.step / parts, every * motion.samples, every)
    try:
        answer = solve(asked.scene, grid)
    except (Unsupported, IntegrationFailed):
        return Run((None, None))
    if len(answer.t) < grid.n_samples:
        return Run((None, None))
    return Run(in_body_axes(take_rows((answer.R_WB, answer.w_WB_B), slice(1, None)), motion, asked))


def in_body_axes(data: States, motion: Motion, asked: Motion) -> States:
    """Return samples of a body in principal axes, if it was `asked` in these, in the body axes of a motion."""
    if asked is motion:
        return data
    C = motion.scene.body.R_BP
    return None if data[0] is None else data[0] @ C.T, None if data[1] is None else data[1] @ C.T


def apart(first: States, second: States, scale: float) -> tuple[float, float]:
    """Return the largest differences of two motions: of attitudes, rad, and of rates, relative; nan where one has none."""
    with np.errstate(all="ignore"):
        turned = (
            math.nan if first[0] is None or second[0] is None else float(np.max(angle_between(first[0], second[0]), initial=0))
        )
        rates = math.nan
        if first[1] is not None and second[1] is not None:
            rates = float(np.linalg.norm(first[1] - second[1], axis=1).max(initial=0)) / scale
    return turned, rates


def self_order(runs: Sequence[Run], steps: Sequence[float], floor: float) -> tuple[float, Array]:
    """Return the order by which motions approach each other as the step becomes shorter, and their differences.

    It needs no exact motion, so that wrong equations do not change it. It is nan if all differences are round-off.
    """
    rates = [float(np.abs(run.data[1]).max()) for run in runs if run.data[1] is not None]
    scale = max(rates, default=1.0) or 1.0

    def gap(first: Run, second: Run) -> float:
        turned, other = apart(first.data, second.data, scale)
        return other if math.isnan(turned) else turned

    gaps = np.array([gap(first, second) for first, second in pairwise(runs)])
    good = [k for k in range(len(gaps)) if floor < gaps[k] < 1.0]
    slopes = [math.log(gaps[i] / gaps[j]) / math.log(steps[i] / steps[j]) for i, j in pairwise(good) if j == i + 1]
    return (float(slopes[-1]) if slopes else math.nan), gaps


def measured_order(found: Runnable, motions: Sequence[Motion]) -> int | None:
    """Return the order of a back end by its own convergence, 1 to 4; None if its motions do not depend on the step.

    If the motions do not approach each other, it is 1: the order with the largest tolerances.
    """
    orders, depends = [], False
    floor = RESOLVED["f32" if found.single else "f64"]
    for motion in motions:
        parts = PARTS[:5]
        runs = [_run(found.solve, motion, found.principal, n) for n in parts]
        slope, gaps = self_order(runs, [motion.step / n for n in parts], floor)
        depends = depends or bool((gaps > floor).any())
        if not math.isnan(slope):
            orders.append(slope)
    if not orders:
        return 1 if depends else None
    return int(np.clip(math.floor(float(np.median(orders)) + 0.3), 1, 4))


def sweep(first: Runnable, second: Runnable, motion: Motion, tell: Callable[[str], object] = lambda what: None) -> Sweep:
    """Run a motion with several steps, and with the other settings of both back ends. Parameters as in `parity`."""
    sides, steps = (first, second), [motion.step / n for n in PARTS]
    runs: list[list[Run]] = []
    for side in sides:
        tell(f"{side.name}: steps of {motion.name}")
        runs.append([_run(side.solve, motion, side.principal, n) for n in PARTS])
    t = np.array(motion.t)
    exact = truth(motion.scene, 0.0, t)
    scale = float(np.linalg.norm(exact[1], axis=1).max()) or 1.0
    parts_of = [next((run.data for run in some if not run.failed), (None, None)) for some in runs]
    part = 0 if all(data[0] is not None for data in parts_of) else 1

    def error(run: Run) -> float:
        return math.nan if run.failed else _finite(apart(run.data, exact, scale)[part])

    def between(a: Run, b: Run) -> float:
        return math.nan if a.failed or b.failed else _finite(apart(a.data, b.data, scale)[part])

    errors = [[error(run) for run in some] for some in runs]
    gaps = [between(a, b) for a, b in zip(*runs, strict=True)]
    series = [Series("step", "", tuple(steps), tuple(errors[0]), tuple(errors[1]), tuple(gaps))]
    for k, side in enumerate(sides):
        other = runs[1 - k][-1]
        for setting in side.settings:
            tell(f"{side.name}: {setting.name}")
            # A number, such as a tolerance or a number of substeps, shows most where the step is coarse.
            parts = PARTS[0] if isinstance(setting.values[0], int | float) else PARTS[-1]
            made = [_run(solve, motion, side.principal, parts) for solve in setting.solvers]
            own, theirs = tuple(map(error, made)), (error(other),) * len(made)
            both = (own, theirs) if k == 0 else (theirs, own)
            series.append(Series(setting.name, side.name, setting.values, *both, tuple(between(run, other) for run in made)))
    convergences = [
        _convergence(some, steps, values, side.single) for some, values, side in zip(runs, errors, sides, strict=True)
    ]
    return Sweep(
        motion.name,
        ("rad", "of the largest rate")[part],
        tuple(series),
        convergences[0],
        convergences[1],
        observed_order(steps, gaps),
    )


def _finite(x: float) -> float:
    return x if math.isfinite(x) else math.nan


def _convergence(runs: Sequence[Run], steps: Sequence[float], errors: Sequence[float], single: bool) -> Convergence:
    floor = RESOLVED["f32"] if single else FLOOR
    own, gaps = self_order(runs, steps, RESOLVED["f32" if single else "f64"])
    order, last = observed_order(steps, errors), errors[-1]
    if math.isnan(last):
        limit = Limit.UNKNOWN
    elif last <= floor:
        limit = Limit.EXACT
    elif last > ELSEWHERE * gaps[-1]:
        limit = Limit.OTHER
    elif not order.reason and order.slope >= CONVERGES:
        limit = Limit.EXACT
    else:
        limit = Limit.NOTHING
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
        return f"{name} is within {error} of the exact motion at the shortest step, and its error does not fall with the step"
    return f"{name} converges to the exact motion with order {order.slope:.2f} ± {max(order.stderr, 0.01):.2f}"


def sentences(first: str, second: str, result: Sweep) -> list[str]:
    """Return what a sweep shows: how each back end converges, whether both approach each other, and where they agree."""
    out = [sentence(first, result.first, result.unit), sentence(second, result.second, result.unit)]
    limits, steps = (result.first.limit, result.second.limit), result.steps
    if limits == (Limit.OTHER, Limit.OTHER) and steps.between[-1] < 0.1 * min(result.first.error, result.second.error):
        out.append(
            f"both converge to each other ({number(steps.between[-1])} {result.unit} at the shortest step), but not to the "
            "exact motion"
        )
    for series in result.series:
        what = "a step" if series.setting == "step" else f"{series.setting} of {series.of}"
        for level in LEVELS:
            value = series.agree(level)
            shown = value if not isinstance(value, float) else f"{number(value, 3)}{' s' * (series.setting == 'step')}"
            where = f"from {what} of {shown} on" if series.setting == "step" else f"from {what} = {shown} on"
            if value is None:
                where = f"at no value of {what}" if series.setting != "step" else "at no step of the sweep"
            out.append(f"they agree to {number(level)} {result.unit} {where}")
    return out
