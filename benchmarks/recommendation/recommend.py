"""Which method and step of ours, and which setting of each engine, has a wanted error over a duration, and at what cost.

1. A trial run tells how fast the body turns; from that follow the spacing of samples and the length of probes.
2. The truth: two independent ones that agree. A closed form is known over the whole duration, anything else over the probes.
3. A disturbed start tells how the motion itself amplifies errors (all three: `motion`).
4. Each method is probed from coarse to fine (`probe`, `search`). A stated law carries errors to the duration (`extrapolation`).
5. The settings found are timed against each other, interleaved.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from conservative.method import Grid, Method, Role
from conservative.outcome import Outcome
from conservative.references.truth import Truth

from ..measures.timing import time_interleaved
from ..studies import selection, step_ladder
from ..studies.case import Case, Success, fail_unsupported
from ..studies.time_limit import attempt_here
from .advice import Advice, advise
from .motion import choose_ours, prepare_conditions
from .probe import STEPS, Conditions
from .question import Question
from .search import Refinement, refine

Progress = Callable[[float, str], None]

RUN_TIME = 0.005
"""Wall time, s, that one timed run is meant to last."""
ROUNDS, TIMING_BUDGET = 7, 0.25
COARSER_START = 4
"""How much longer than the step of the automatic choice the first of our probes is, so that there is an order to be seen."""
LOOSEST = 1e-3
"""Tolerance that adaptive methods start with at most."""


@dataclass(frozen=True, eq=False)
class Recommendation:
    """What was asked, and every method's advice, ours first; see `Advice`.

    `conditions` are those of all probes, `truth` is what errors are measured against, `missing` are engines not installed.
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
        """The cheapest of all that reach the error; None where nothing does."""
        good = [advice for advice in self.advice if advice.reached and not math.isnan(advice.cost)]
        return min(good, key=lambda advice: advice.cost, default=None)


def recommend(asked: Question, progress: Progress = lambda share, what: None) -> Recommendation:
    """Return what to integrate a scene with.

    Parameters
    ----------
    asked
        From `ask`.
    progress
        Called with the share of all work that is done and what comes next.

    Raises
    ------
    Disagreement
        No truth is known.
    """
    progress(0.0, "the motion and its truth")
    conditions, truth = prepare_conditions(asked.scene, asked.error, asked.duration, asked.cost_limit)
    conditions = replace(conditions, time_limit=asked.time_limit)
    own, step = choose_ours(conditions, conditions.target * min(1.0, conditions.short / conditions.duration))
    roles: dict[str, Role] = {}
    refinements: dict[str, Refinement | Outcome] = {}
    for i, method in enumerate((own, *asked.methods)):
        line = selection.series(method)
        progress(0.2 + 0.7 * i / (1 + len(asked.methods)), f"probing {line}")
        roles[line] = method.role
        refinements[line] = refine_from_start(conditions, method, step)
    progress(0.9, "timing what was found")
    costs = time_settings(conditions, refinements)
    advice = tuple(
        advise(conditions, line, roles[line], refinement, costs.get(line)) for line, refinement in refinements.items()
    )
    return Recommendation(conditions, truth, advice, asked.missing)


def refine_from_start(conditions: Conditions, method: Method, step: float) -> Refinement | Outcome:
    """Return the probes of a method from its first setting on; the outcome of one that cannot do the scene."""
    reason = method.unsupported(conditions.scene)
    return fail_unsupported(reason).outcome if reason else refine(conditions, *first_setting(conditions, method, step))


def first_setting(conditions: Conditions, method: Method, step: float) -> tuple[Method, float]:
    """Return the method and the step to begin with: ours near the step of the automatic choice, others far off."""
    setting = selection.tolerance_setting(method)
    if setting is not None:
        loosest = 10.0 ** math.floor(math.log10(min(LOOSEST, conditions.error)))
        return selection.at_tolerance(method, setting, float(f"{loosest:.0e}")), conditions.spacing
    longest = conditions.step_at_most(conditions.short / STEPS)
    if method.role != Role.OURS:
        return method, min(longest, conditions.step_at_most(step_ladder.RADIANS / conditions.rate))
    return method, step if method.order is None else min(COARSER_START * step, longest)


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
