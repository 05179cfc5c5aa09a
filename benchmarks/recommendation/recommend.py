"""Which method and step of ours, and which setting of each engine, reach an error over a duration, and at what cost.

1. A trial run gives the rate of the body. The spacing of samples and the length of probes follow from it.
2. The reference solution is confirmed by a second one. A closed form covers the whole duration, others cover the probes.
3. A disturbed start shows how the motion itself amplifies errors (all three: `motion`).
4. Each method is probed from coarse to fine (`probe`, `search`). A stated law carries errors to the duration (`extrapolation`).
5. The settings found are timed against each other in interleaved rounds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from conservative.check import positive_number
from conservative.errors import BadInput, nearest
from conservative.grid import Grid
from conservative.method import Method, Role
from conservative.outcome import Outcome
from conservative.references.truth import Truth
from conservative.scene import Scene

from ..measures.convergence_order import Order, observed_order
from ..measures.timing import time_interleaved
from ..studies import selection, step_ladder
from ..studies.case import Case, Success, fail_unsupported
from ..studies.study import HANG_LIMIT
from ..studies.time_limit import attempt_here
from .motion import choose_ours, prepare_conditions
from .probe import STEPS, Conditions, Probe
from .search import Refinement, at_round_off, refine

Progress = Callable[[float, str], None]

COST_LIMIT = 1.0
"""Wall time per simulated second, s/s, that a setting may cost: as fast as the body itself."""
RUN_TIME = 0.005
"""Target duration of a timed run, s."""
ROUNDS, TIMING_BUDGET = 7, 0.25
COARSER_START = 4
"""Factor from the step of the automatic choice to the first step of ours, so that an order can be seen."""
LOOSEST = 1e-3
"""Largest first tolerance of adaptive methods."""


@dataclass(frozen=True, eq=False)
class Question:
    """Checked arguments of `ask`. `missing` are engines that are not installed."""

    scene: Scene
    error: float
    duration: float
    methods: tuple[Method, ...]
    missing: tuple[str, ...]
    cost_limit: float
    time_limit: float = HANG_LIMIT


def ask(
    scene: Scene,
    error: float = 1e-6,
    duration: float | None = None,
    engine_names: Iterable[str] | None = None,
    cost_limit: float = COST_LIMIT,
    time_limit: float = HANG_LIMIT,
) -> Question:
    """Check the arguments of a recommendation.

    Parameters
    ----------
    scene
        The body, its start and its field.
    error
        Largest attitude error over the duration, rad.
    duration
        s; by default that of the scene.
    engine_names
        Engines, such as `("mujoco",)`; by default all that are installed.
    cost_limit
        Wall time per simulated second, s/s, that a setting may cost.
    time_limit
        Wall time, s, after which the run of an engine is stopped.

    Raises
    ------
    BadInput
        An argument cannot be used.
    MissingEngine
        A named engine is not installed.
    """
    positive_number("error", error, "a finite attitude error above 0, rad")
    end = scene.t_end if duration is None else positive_number("duration", duration, "a finite duration above 0, s")
    positive_number("cost_limit", cost_limit, "a finite wall time per simulated second above 0, s/s")
    positive_number("time_limit", time_limit, "a finite duration above 0, s")
    found = list_engines(engine_names)
    missing = tuple(method.name for method in found if isinstance(method, selection.Missing))
    methods = tuple(method for method in found if not isinstance(method, selection.Missing))
    return Question(scene, error, end, methods, missing, cost_limit, time_limit)


def list_engines(names: Iterable[str] | None = None) -> tuple[Method, ...]:
    """Return a method for each line of the named engines, by default of all; variants that differ in tolerance are one line.

    Named engines must be installed. By default, a `Missing` method stands for an engine that is not.

    Raises
    ------
    BadInput
        A name is not that of an engine.
    MissingEngine
        A named engine is not installed.
    """
    everything = [method for method in selection.methods(skip_missing=True) if method.role == Role.ENGINE]
    if names is None:
        wanted: Iterable[Method] = everything
    else:
        known = {method.name.partition(":")[0] for method in everything}
        for name in names:
            if name.partition(":")[0] not in known:
                raise BadInput("engine", repr(name), nearest(name, known))
        wanted = selection.methods(names)
    lines = {selection.series(method): method for method in reversed(tuple(wanted))}
    return tuple(reversed(lines.values()))


@dataclass(frozen=True)
class Advice:
    """The recommended setting of one method.

    Attributes
    ----------
    line
        Name of the method without the setting that is searched.
    best
        The probe at the recommended setting; if no setting reaches the error, at the nearest one.
    reached
        Whether the wanted error may be expected.
    cost
        Wall time per simulated second at that setting, s/s, interleaved minimum; NaN if it could not be timed.
    order
        Observed order in the step; None for adaptive methods and for methods without truncation error.
    probes
        All runs, coarse to fine.
    reason
        Why the method cannot be used, or why it does not reach the error; empty if it does.
    """

    line: str
    role: Role
    best: Probe | None
    reached: bool
    cost: float
    order: Order | None
    probes: tuple[Probe, ...]
    reason: str


@dataclass(frozen=True, eq=False)
class Recommendation:
    """The advice on every method, ours first; see `Advice`.

    `conditions` are those of all probes, `truth` is the reference solution, `missing` are engines that are not installed.
    """

    conditions: Conditions
    truth: Truth
    advice: tuple[Advice, ...]
    missing: tuple[str, ...]

    @property
    def ours(self) -> Advice:
        """Advice on our own method."""
        return self.advice[0]

    @property
    def cheapest(self) -> Advice | None:
        """The cheapest advice that reaches the error; None if there is none."""
        good = [advice for advice in self.advice if advice.reached and not math.isnan(advice.cost)]
        return min(good, key=lambda advice: advice.cost, default=None)


def recommend(asked: Question, progress: Progress = lambda share, what: None) -> Recommendation:
    """Return the advice on every method for a question from `ask`; `progress` takes the finished share and the next step.

    Raises
    ------
    Disagreement
        There is no reference solution.
    """
    progress(0.0, "reference solution")
    conditions, truth = prepare_conditions(asked.scene, asked.error, asked.duration, asked.cost_limit)
    conditions = replace(conditions, time_limit=asked.time_limit)
    own, step = choose_ours(conditions, conditions.target * min(1.0, conditions.short / conditions.duration))
    roles: dict[str, Role] = {}
    refinements: dict[str, Refinement | Outcome] = {}
    for i, method in enumerate((own, *asked.methods)):
        line = selection.series(method)
        progress(0.2 + 0.7 * i / (1 + len(asked.methods)), f"probing {line}")
        roles[line] = method.role
        refinements[line] = _refine_from_start(conditions, method, step)
    progress(0.9, "timing")
    costs = time_settings(conditions, refinements)
    advice = tuple(
        _advise(conditions, line, roles[line], each, costs.get(line, math.nan)) for line, each in refinements.items()
    )
    return Recommendation(conditions, truth, advice, asked.missing)


def _refine_from_start(conditions: Conditions, method: Method, step: float) -> Refinement | Outcome:
    """Return the probes of a method from its first setting on, ours near the step of the automatic choice, others coarse.

    A method that does not support the scene has an outcome instead.
    """
    if reason := method.unsupported(conditions.scene):
        return fail_unsupported(reason).outcome
    setting = selection.tolerance_setting(method)
    if setting is not None:
        loosest = 10.0 ** math.floor(math.log10(min(LOOSEST, conditions.error)))
        return refine(conditions, selection.at_tolerance(method, setting, float(f"{loosest:.0e}")), conditions.spacing)
    longest = conditions.step_at_most(conditions.short / STEPS)
    if method.role != Role.OURS:
        return refine(conditions, method, min(longest, conditions.step_at_most(step_ladder.RADIANS / conditions.rate)))
    return refine(conditions, method, step if method.order is None else min(COARSER_START * step, longest))


def time_settings(conditions: Conditions, refinements: dict[str, Refinement | Outcome]) -> dict[str, float]:
    """Return the wall time per simulated second of the settings found, s/s, by line: interleaved minimums."""
    runs, lengths = {}, {}
    for line, refinement in refinements.items():
        probe = None if isinstance(refinement, Outcome) else refinement.best(conditions.target)
        if probe is None or not probe.outcome.ok:
            continue
        length = RUN_TIME / probe.cost
        n = max(1, round(length / probe.dt))
        adaptive = selection.tolerance_setting(probe.method) is not None
        grid = Grid(length, 1) if adaptive else Grid(probe.dt, n, n)
        outcome = attempt_here(conditions.time_limit, Case("recommendation", conditions.scene, probe.method, grid))
        if isinstance(outcome, Success):
            runs[line], lengths[line] = outcome.run, grid.dt * grid.n_steps
    found = time_interleaved(runs, ROUNDS, min_time=RUN_TIME, budget=TIMING_BUDGET)
    return {line: timing.minimum / lengths[line] if timing.outcome.ok else math.inf for line, timing in found.items()}


def _advise(conditions: Conditions, line: str, role: Role, refinement: Refinement | Outcome, cost: float) -> Advice:
    """Return the advice on one line of settings; an outcome is the reason why there are no probes."""
    if isinstance(refinement, Outcome):
        return Advice(line, role, None, False, math.nan, None, (), refinement.reason)
    probe = refinement.best(conditions.target)
    reached = probe.expected <= conditions.error
    order = None if probe.method.order is None else observed_order(*refinement.converging())
    reason = "" if reached else _explain_shortfall(conditions, refinement, probe)
    return Advice(line, role, probe, reached, cost, order, refinement.probes, reason)


def _explain_shortfall(conditions: Conditions, refinement: Refinement, probe: Probe) -> str:
    """Return why no finer setting was found."""
    last = refinement.last
    if not probe.outcome.ok:
        return str(probe.outcome)
    if math.isinf(conditions.amplification.excess(probe.length, conditions.duration)):
        return "the motion amplifies errors without bound"
    if at_round_off(last):
        return "finer settings do not help any more: round-off"
    if last[-1].cost > conditions.cost_limit / 2:
        return f"anything finer costs more than {conditions.cost_limit:g} s per simulated second"
    if selection.tolerance_setting(probe.method) is not None:
        return "it has no tighter tolerance"
    return f"not within {len(last)} probes"
