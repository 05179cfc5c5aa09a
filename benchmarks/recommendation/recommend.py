"""Recommend a method and step of ours, and a setting of each engine, that reach an error over a duration, with their cost.

1. A trial run gives the angular velocity of the body, which determines the sampling interval and the length of probes.
2. The reference solution is confirmed by a second one. A closed form covers the whole duration, others cover the probes.
3. A disturbed start shows how the motion itself amplifies errors (1 to 3: `Conditions`).
4. Our methods are methods of the automatic choice: its first choice, and if that has no truncation error, the best general
   integrator as well. Each method is probed from coarse to fine (`refine`), and then until the error asked for lies between
   two settings that are close (`_enclose`). A stated law extrapolates errors to the duration.
5. The resulting settings are timed against each other in interleaved rounds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from operator import attrgetter

import numpy as np

from conservative import registry
from conservative.attitude import Array
from conservative.check import positive_number
from conservative.errors import BadInput, nearest
from conservative.grid import Grid
from conservative.method import Method, Role
from conservative.methods.automatic import ATTEMPTS
from conservative.methods.search import candidates, refine_until, step_factor, stops_falling
from conservative.methods.trials import ASYMPTOTIC
from conservative.outcome import Outcome, OutcomeKind
from conservative.scene import Scene

from ..measures.convergence_order import MIN_POINTS, Order, observed_order
from ..measures.timing import time_interleaved
from ..studies import selection, step_ladder
from ..studies.case import Case, Success, names_of
from ..studies.selection import tolerance_setting
from ..studies.speed import CALL, own_loop
from ..studies.study import HANG_LIMIT, Progress
from ..studies.time_limit import attempt_here
from .growth import EQUAL
from .probe import LEAST_SAMPLES, RUN_LIMIT, STEPS, Conditions, Probe, Question, prepare_conditions

COST_LIMIT = 1.0
"""Wall time per simulated second, s/s, that a setting may cost: real time."""
ROUNDS, TIMING_BUDGET = 7, 0.25
"""Rounds of timing, and the time budget, s, for all of one setting."""
COARSER_START = 4
"""First step of our methods, in units of the automatically chosen step, so that an order can be observed."""
LOOSEST = 1e-3
"""First tolerance of adaptive methods, looser than most errors asked for: on an easy motion it is enough."""
SMALLEST_CUT, DEFAULT_CUT = 1 / 16, 1 / 8
"""Smallest factor from one step to the next, and the factor if a probe has no usable error."""
LONGER = 8
"""Step of an additional long run, relative to the candidate step."""
TIGHTEST = -16
"""Exponent of the smallest tolerance: round-off."""
LARGEST_TOLERANCE_CUT = 4
"""Largest cut of a tolerance from one probe to the next, powers of ten."""
CLOSE = 1.5
"""Steps are halved or doubled until the error asked for lies between two whose ratio is at most this."""
MOST_PROBES = 2 * ATTEMPTS
PROBE_LIMIT = 0.3
"""Wall time, s, that the shortest probe at a setting may take."""


def ask(
    scene: Scene,
    error: float = 1e-6,
    duration: float | None = None,
    engine_names: Iterable[str] | None = None,
    cost_limit: float = COST_LIMIT,
    time_limit: float = HANG_LIMIT,
) -> Question:
    """Return the question of a recommendation (see `Question`), after checking the arguments.

    The default duration is the duration of the scene. Engines are named as in `("mujoco",)`; by default all that are installed.

    Raises
    ------
    BadInput
        An argument cannot be used.
    MissingEngine
        A named engine is not installed.
    """
    positive_number("error", error, "a finite attitude error above 0, rad")
    end = scene.t_end if duration is None else positive_number("t_end", duration, "a finite duration above 0, s")
    for load in scene.loads:
        load.require_times(end)
    positive_number("cost_limit", cost_limit, "a finite wall time per simulated second above 0, s/s")
    positive_number("time_limit", time_limit, "a finite duration above 0, s")
    engines = list_engines(engine_names)
    missing = tuple(method.name for method in engines if isinstance(method, selection.Missing))
    installed = tuple(method for method in engines if not isinstance(method, selection.Missing))
    return Question(scene, error, end, installed, missing, cost_limit, time_limit)


def list_engines(names: Iterable[str] | None = None) -> tuple[Method, ...]:
    """Return a method for each line of the named engines, by default of all; variants that differ in tolerance are one line.

    Named engines must be installed. By default, a `Missing` method stands for an engine that is not.

    Raises
    ------
    BadInput
        A name does not belong to an engine.
    MissingEngine
        A named engine is not installed.
    """
    wanted = [method for method in selection.methods(skip_missing=True) if method.role == Role.ENGINE]
    if names is not None:
        engines = {names_of(method)["family"] for method in wanted}.union(registry.list_engines())
        for name in names:
            if (base := registry.read_name(name, "engines").base) not in engines:
                raise BadInput("engines", repr(name), nearest(base, engines))
        wanted = list(selection.methods(names))
    lines = {selection.series(method): method for method in reversed(wanted)}
    return tuple(reversed(lines.values()))


@dataclass(frozen=True)
class Advice:
    """The recommended setting of one method. `line` is its name without the setting that is searched.

    `best` is the probe at the recommended setting, or at the nearest one if no setting reaches the error, and `reached` is true
    if the error can be expected there. `cost` is its wall time per simulated second, s/s, an interleaved minimum; NaN if it
    could not be timed. `order` is the observed one in the step; None for adaptive methods and without truncation error. The
    probes are all runs, coarse to fine. `reason` is why the method cannot be used or does not reach the error.
    """

    line: str
    role: Role
    best: Probe | None
    reached: bool
    cost: float
    order: Order | None
    probes: tuple[Probe, ...]
    reason: str

    @property
    def general(self) -> bool:
        """True for a general integrator, False for a closed form of some motions."""
        return self.best is None or not self.best.method.method_info.exact


@dataclass(frozen=True, eq=False)
class Recommendation:
    """The advice on every method, ours first, and the conditions of all probes."""

    conditions: Conditions
    advice: tuple[Advice, ...]

    @property
    def winners(self) -> dict[str, Advice | None]:
        """The cheapest advice that reaches the error: of all, of our general integrators, and of the engines."""
        good = sorted((row for row in self.advice if row.reached and not math.isnan(row.cost)), key=lambda row: row.cost)
        return {
            "cheapest": next(iter(good), None),
            "cheapest_general": next((row for row in good if row.role == Role.OURS and row.general), None),
            "cheapest_engine": next((row for row in good if row.role == Role.ENGINE), None),
        }


def recommend(asked: Question, progress: Progress = lambda share, what: None) -> Recommendation:
    """Return the advice on every method for a question from `ask`; `progress` takes the finished share and the next step.

    Raises
    ------
    Disagreement
        There is no reference solution.
    """
    progress(0.0, "reference solution")
    conditions = prepare_conditions(asked)
    starts = [conditions.choose_ours()]
    if starts[0][0].method_info.exact and (general := candidates(asked.scene, exact=False)):
        starts.append(conditions.choose_ours(general))
    starts += [(method, math.nan) for method in asked.methods]
    roles: dict[str, Role] = {}
    refinements: dict[str, Refinement | Outcome] = {}
    for i, (method, step) in enumerate(starts):
        line = selection.series(method)
        progress(0.2 + 0.7 * i / len(starts), f"probing steps or tolerances of {line}")
        roles[line] = method.role
        refinements[line] = _refine_from_start(conditions, method, step)
    progress(0.9, "timing")
    costs = time_settings(conditions, refinements)
    advice = []
    for line, refinement in refinements.items():
        if isinstance(refinement, Outcome):  # the reason why there are no probes
            advice.append(Advice(line, roles[line], None, False, math.nan, None, (), refinement.reason))
            continue
        probe = refinement.best(conditions.target)
        reached = probe.expected <= conditions.error
        order = None if probe.method.order is None else observed_order(*refinement.converging())
        reason = "" if reached else _explain_shortfall(conditions, refinement, probe)
        probes, cost = refinement.short + refinement.long, costs.get(line, math.nan)
        advice.append(Advice(line, roles[line], probe, reached, cost, order, probes, reason))
    return Recommendation(conditions, tuple(advice))


@dataclass(frozen=True)
class Refinement:
    """The probes of a method, coarse to fine: over a short part of the motion, then over as much of it as a run may take."""

    short: tuple[Probe, ...]
    long: tuple[Probe, ...] = ()

    @property
    def last(self) -> tuple[Probe, ...]:
        """The probes that count: the long ones if there are any."""
        return self.long or self.short

    def best(self, target: float) -> Probe:
        """Return the coarsest probe whose expected error is at most `target`, rad, otherwise the nearest one."""
        good = [probe for probe in self.last if probe.expected <= target]
        if good:
            return max(good, key=lambda probe: probe.setting)
        return min(reversed(self.last), key=lambda probe: (probe.expected, -probe.holds))

    def converging(self) -> tuple[Array, Array]:
        """Return settings (n,) and errors (n,) for the fit of an order: of short probes of equal length."""
        length = self.short[0].length
        errors = {p.setting: p.error for p in self.short if math.isclose(p.length, length) and p.error < ASYMPTOTIC}
        return np.array(list(errors)), np.array(list(errors.values()))


def _refine_from_start(conditions: Conditions, method: Method, step: float) -> Refinement | Outcome:
    """Return the probes of a method: ours from near the step of the automatic choice, s, engines from a coarse setting.

    The result is an outcome if the method does not support the scene.
    """
    if reason := method.unsupported(conditions.scene):
        return Outcome(OutcomeKind.UNSUPPORTED, reason)
    setting = tolerance_setting(method)
    if setting is not None:
        return refine(conditions, selection.at_tolerance(method, setting, LOOSEST), conditions.spacing)
    longest = conditions.round_step(conditions.short / STEPS)
    if method.role != Role.OURS:
        return refine(conditions, method, min(longest, conditions.round_step(step_ladder.RADIANS / conditions.rate)))
    return refine(conditions, method, step if method.order is None else min(COARSER_START * step, longest))


def refine(conditions: Conditions, method: Method, dt: float) -> Refinement:
    """Return the probes of a method from a step dt, s, or its tolerance, until the requested error can be expected.

    If the truth is known for longer than the short window, short probes only need to be good enough for an error that grows in
    proportion to time, and long probes are made as well.
    """
    longer = conditions.truth_until > conditions.short * (1 + EQUAL) and conditions.duration > conditions.short

    def expect_linear(probe: Probe) -> float:
        law = probe.error_law
        return law.error * max(1.0, conditions.duration / law.length) if law and law.error < ASYMPTOTIC else math.inf

    expect = expect_linear if longer else attrgetter("expected")
    short = _refine_until(conditions, [conditions.probe(method, dt, math.nan, long=False)], expect, long=False)
    if not longer or expect(short[-1]) > conditions.target:
        return Refinement(tuple(_enclose(conditions, short, long=False)))
    last, order = short[-1], method.order
    before: Sequence[Probe] = short
    long = []
    if order is not None and conditions.window(last.dt, last.cost, long=True).t[-1] < conditions.duration * (1 - EQUAL):
        # The affordable run is shorter than the duration. One with a longer step, which gets further, shows how errors grow.
        step = min(LONGER * last.dt, short[0].dt)
        before = long = [conditions.probe(method, step, last.cost * last.dt / step, True)]
    long = [*long, conditions.probe(last.method, last.dt, last.cost, True, before)]
    long = _refine_until(conditions, long, attrgetter("expected"), long=True)
    return Refinement(tuple(short), tuple(_enclose(conditions, long, long=True)))


def _enclose(conditions: Conditions, probes: list[Probe], long: bool) -> list[Probe]:
    """Return probes with more settings, until the error asked for lies between two that are close, if one reaches it.

    Steps are tried up to the longest that a window has samples for, and tolerances between the tolerances of the probes.
    """
    while len(probes) < MOST_PROBES:
        good = [probe for probe in probes if probe.expected <= conditions.target]
        if not good or (probes[0].method.order is None and tolerance_setting(probes[0].method) is None):
            break
        best = max(good, key=attrgetter("setting"))
        coarser = min((probe.setting for probe in probes if probe.setting > best.setting), default=math.inf)
        between = _step_between if tolerance_setting(best.method) is None else _tolerance_between
        setting = between(conditions, best, coarser)
        if setting is None:
            break
        method, dt = setting
        probes.append(conditions.probe(method, dt, best.cost * best.dt / dt, long, tuple(probes)))
    return sorted(probes, key=attrgetter("setting"), reverse=True)


def _step_between(conditions: Conditions, best: Probe, coarser: float) -> tuple[Method, float] | None:
    """Return the method and a round step, s, between the best probe's step and a coarser one that fails, or twice the best."""
    longest = conditions.longest_step
    wanted = min(2 * best.dt, longest) if math.isinf(coarser) else math.sqrt(best.dt * coarser)
    dt = conditions.round_step(wanted)
    if dt <= best.dt * (1 + EQUAL):
        dt = conditions.round_step(wanted, up=True)
    inside = best.dt * (1 + EQUAL) < dt < min(coarser * (1 - EQUAL), longest * (1 + EQUAL))
    return (best.method, dt) if inside and coarser > CLOSE * best.dt else None


def _tolerance_between(conditions: Conditions, best: Probe, coarser: float) -> tuple[Method, float] | None:
    """Return the method with a power of ten between the tolerance of the best probe and a looser one that fails."""
    name, fine = tolerance_setting(best.method), round(math.log10(best.setting))
    power = fine + 1 if math.isinf(coarser) else (fine + round(math.log10(coarser)) + 1) // 2
    if name is None or 10.0**power >= min(coarser, 10 * LOOSEST) * (1 - EQUAL) or power == fine:
        return None
    return selection.at_tolerance(best.method, name, float(f"1e{power}")), best.dt


def _refine_until(conditions: Conditions, probes: list[Probe], expect: Callable[[Probe], float], long: bool) -> list[Probe]:
    """Return probes with finer and finer settings until `expect` returns an error within the target, rad."""
    next_setting = _shorten_step if tolerance_setting(probes[0].method) is None else _tighten_tolerance

    def finer(tried: list[Probe]) -> tuple[Method, float, float] | None:
        if tried[-1].outcome.kind is OutcomeKind.TIMEOUT:  # finer runs would take even longer
            return None
        return next_setting(conditions, tried, expect(tried[-1]))

    def attempt(setting: tuple[Method, float, float]) -> Probe:
        return conditions.probe(*setting, long, tuple(probes))

    return refine_until(probes, finer, attempt, lambda probe: expect(probe) <= conditions.target, _falling_error, ATTEMPTS)


def _at_round_off(probes: Sequence[Probe]) -> bool:
    return stops_falling([_falling_error(probe) for probe in probes])


def _falling_error(probe: Probe) -> float:
    """Return the expected error, rad; inf if it is saturated, so that it shows nothing."""
    return probe.expected if probe.expected < ASYMPTOTIC else math.inf


def _shorten_step(conditions: Conditions, probes: list[Probe], expected: float) -> tuple[Method, float, float] | None:
    """Return the method, the next step, s, and its cost, s/s; None if the cost limit allows no shorter step."""
    last = probes[-1]
    per_step = min((probe.cost * probe.dt for probe in probes if probe.outcome.ok), default=math.nan)
    factor = step_factor(expected, conditions.error, last.method, SMALLEST_CUT, DEFAULT_CUT)
    growing = sum(conditions.shows_growth(probe) for probe in probes)
    if conditions.shows_growth(last) and growing < MIN_POINTS and per_step * conditions.short <= RUN_LIMIT * last.dt / 2:
        factor = max(factor, 1 / 2)  # so that an order can be observed
    dt, least = conditions.round_step(last.dt * factor), per_step * _most_per_step(conditions)
    if dt < least:
        dt = conditions.round_step(least, up=True)
    return (last.method, dt, per_step / dt) if dt < last.dt * (1 - EQUAL) else None


def _most_per_step(conditions: Conditions) -> float:
    """Return the shortest step, s, divided by the wall time of a step, s, by the limits of costs and of probes."""
    return max(1 / conditions.cost_limit, LEAST_SAMPLES * conditions.spacing / PROBE_LIMIT)


def _tighten_tolerance(conditions: Conditions, probes: list[Probe], expected: float) -> tuple[Method, float, float] | None:
    """Return the method with the next tolerance, a power of ten, the sampling interval, s, and the cost, s/s, or None."""
    last = probes[-1]
    name = tolerance_setting(last.method)
    wanted = math.floor(math.log10(conditions.target / expected)) if expected < math.inf else -2
    if name is None or last.cost > conditions.cost_limit:
        return None
    power = round(math.log10(last.setting))
    for cut in range(max(-LARGEST_TOLERANCE_CUT, min(-1, wanted), TIGHTEST - power), 0):
        with suppress(BadInput):  # tighter than the engine allows
            return selection.at_tolerance(last.method, name, float(f"1e{power + cut}")), last.dt, last.cost
    return None


def time_settings(conditions: Conditions, refinements: dict[str, Refinement | Outcome]) -> dict[str, float]:
    """Return the wall time per simulated second of the resulting settings over the motion of their probes, s/s, by line."""
    runs, lengths = {}, {}
    for line, refinement in refinements.items():
        probe = None if isinstance(refinement, Outcome) else refinement.best(conditions.target)
        if probe is None or not probe.outcome.ok:
            continue
        n = round(probe.length / probe.dt)
        grid = Grid(probe.length, 1) if tolerance_setting(probe.method) else Grid(probe.dt, n, n)
        done = attempt_here(conditions.time_limit, Case("recommendation", conditions.scene, probe.method, grid))
        if isinstance(done, Success):
            runs[line], lengths[line] = own_loop(done.run), probe.length
    timings = time_interleaved(runs, ROUNDS, CALL, TIMING_BUDGET)
    return {line: timing.minimum / lengths[line] if timing.outcome.ok else math.inf for line, timing in timings.items()}


def _explain_shortfall(conditions: Conditions, refinement: Refinement, probe: Probe) -> str:
    """Return the reason why there is no finer setting."""
    last = refinement.last
    if not probe.outcome.ok:
        return str(probe.outcome)
    if math.isinf(conditions.amplification.excess(probe.length, conditions.duration)):
        return "the motion amplifies errors without bound"
    if last[-1].cost > conditions.cost_limit / 2:
        return f"anything finer costs more than {conditions.cost_limit:g} s per simulated second"
    if last[-1].cost * _most_per_step(conditions) > 1 / 2:
        return f"a probe of anything finer takes longer than {PROBE_LIMIT:g} s"
    if _at_round_off(last):
        return "finer settings do not help: round-off"
    if tolerance_setting(probe.method) is not None:
        return "it has no tighter tolerance"
    return f"not within {len(last)} probes"
