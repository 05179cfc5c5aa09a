"""Reduce the step, or the tolerance, from probe to probe until the wanted error may be expected over the duration."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from conservative.attitude import Array
from conservative.errors import BadInput
from conservative.method import Method
from conservative.methods.automatic import ATTEMPTS
from conservative.methods.search import stops_falling
from conservative.methods.trials import ASYMPTOTIC
from conservative.outcome import OutcomeKind

from ..measures.convergence_order import MIN_POINTS
from ..studies.selection import at_tolerance, tolerance_setting
from .probe import RUN_LIMIT, Conditions, Probe

SMALLEST_CUT, DEFAULT_CUT = 1 / 16, 1 / 8
"""Smallest factor by which a step is cut from one probe to the next; and the factor used when a probe gave no usable error."""
LONGER = 8
"""Step of the long run, relative to the candidate step."""
TIGHTEST = -16
"""Smallest tolerance asked for, power of ten: a rounding unit."""
LARGEST_TOLERANCE_CUT = 4
"""Largest cut of a tolerance from one probe to the next, powers of ten."""
COARSEN_BELOW = 1 / 16
"""Share of the wanted error below which a longer step is tried, too."""
Aim = Callable[[Probe], float]
"""The error, rad, that is compared with the wanted one."""


@dataclass(frozen=True)
class Refinement:
    """The probes of a method, coarse to fine: over a short part of the motion, then over as much of it as a run may take."""

    short: tuple[Probe, ...]
    long: tuple[Probe, ...]

    @property
    def probes(self) -> tuple[Probe, ...]:
        """All of them."""
        return self.short + self.long

    @property
    def last(self) -> tuple[Probe, ...]:
        """Those that count: the long ones where there are any."""
        return self.long or self.short

    def best(self, target: float) -> Probe:
        """Return the coarsest that may be expected to have the error; else the one that comes nearest."""
        good = [probe for probe in self.last if probe.expected <= target]
        if good:
            return max(good, key=lambda probe: probe.setting)
        return min(reversed(self.last), key=lambda probe: (probe.expected, -probe.holds))

    def converging(self) -> tuple[Array, Array]:
        """Return settings (n,) and errors (n,) that an order is fitted to: of short ones over the same time and not lost."""
        length = self.short[0].length
        found = {p.setting: p.error for p in self.short if math.isclose(p.length, length) and p.error < ASYMPTOTIC}
        return np.array(list(found)), np.array(list(found.values()))


def refine(conditions: Conditions, method: Method, dt: float) -> Refinement:
    """Return the probes of a method from a step, or the tolerance it has, on, until one may be expected to have the error.

    Where the truth is known for longer, short probes only have to be good enough for an error that grows linearly, and long
    ones find out.
    """
    more = conditions.truth_until > conditions.short * (1 + 1e-9) and conditions.duration > conditions.short

    def expect_linear(probe: Probe) -> float:
        """Return the error, rad, to expect over the duration if that of a short probe grows linearly."""
        law = probe.error_law
        return law.error * max(1.0, conditions.duration / law.length) if law and law.error < ASYMPTOTIC else math.inf

    aim = expect_linear if more else expect
    short = _refine_until(conditions, [conditions.probe(method, dt, math.nan, long=False)], aim, long=False)
    if not more or aim(short[-1]) > conditions.target:
        return Refinement(tuple(short), ())
    return Refinement(tuple(short), tuple(refine_long(conditions, short)))


def expect(probe: Probe) -> float:
    """Return the error, rad, that a probe makes expect over the duration."""
    return probe.expected


def refine_long(conditions: Conditions, short: list[Probe]) -> list[Probe]:
    """Return the long probes that follow short ones; the last has a longer step where the error is far below the wanted one."""
    last = short[-1]
    method = last.method
    long = [conditions.probe(method, last.dt, last.cost, True, short)]
    if method.order is not None and long[0].length < conditions.duration * (1 - 1e-9):
        # The affordable run is shorter than the duration: one at a longer step, which gets further, shows how errors grow.
        longer = min(LONGER * last.dt, short[0].dt)
        ahead = conditions.probe(method, longer, last.cost * last.dt / longer, True)
        long = [ahead, conditions.probe(method, last.dt, last.cost, True, (ahead,))]
    first = long[-1]
    long = _refine_until(conditions, long, expect, long=True)
    if method.order is not None and first.expected < COARSEN_BELOW * conditions.target:
        # At most four times: the error must still shrink with its order where the step comes from.
        factor = min(4.0, (conditions.target / max(first.expected, 1e-300)) ** (1 / method.order))
        longer = conditions.step_at_most(first.dt * factor)
        long += [conditions.probe(method, longer, first.cost * first.dt / longer, True)] if longer > first.dt else []
    return long


def _refine_until(conditions: Conditions, probes: list[Probe], aim: Aim, long: bool) -> list[Probe]:
    adaptive = tolerance_setting(probes[0].method) is not None
    while len(probes) < ATTEMPTS and aim(probes[-1]) > conditions.target:
        if at_round_off(probes) or probes[-1].outcome.kind is OutcomeKind.TIMEOUT:  # finer runs would take even longer
            break
        finer = (_tighten_tolerance if adaptive else _shorten_step)(conditions, probes, aim(probes[-1]))
        if finer is None:
            break
        probes.append(conditions.probe(*finer, long, tuple(probes)))
    return probes


def at_round_off(probes: Sequence[Probe]) -> bool:
    """Whether finer settings have stopped helping where they once did: round-off."""
    return stops_falling([probe.expected for probe in probes if probe.expected < ASYMPTOTIC])


def _shorten_step(conditions: Conditions, probes: list[Probe], expected: float) -> tuple[Method, float, float] | None:
    """Return method, next step and its cost; None where the cost allows none."""
    last = probes[-1]
    per_step = min((probe.cost * probe.dt for probe in probes if probe.outcome.ok), default=math.nan)
    factor = DEFAULT_CUT
    if expected < math.inf and last.method.order is not None:
        factor = min(0.8, max(SMALLEST_CUT, (conditions.target / expected) ** (1 / last.method.order)))
    growing = sum(conditions.shows_growth(probe) for probe in probes)
    if conditions.shows_growth(last) and growing < MIN_POINTS and per_step * conditions.short <= RUN_LIMIT * last.dt / 2:
        factor = max(factor, 1 / 2)  # so that there is an order to be seen
    dt = conditions.step_at_most(last.dt * factor)
    if dt < per_step / conditions.cost_limit:
        dt = conditions.step_at_least(per_step / conditions.cost_limit)
    return (last.method, dt, per_step / dt) if dt < last.dt * (1 - 1e-9) else None


def _tighten_tolerance(conditions: Conditions, probes: list[Probe], expected: float) -> tuple[Method, float, float] | None:
    """Return method with the next tolerance, a power of ten, and its cost; None if there is none that the cost limit allows."""
    last = probes[-1]
    name = tolerance_setting(last.method)
    wanted = math.floor(math.log10(conditions.target / expected)) if expected < math.inf else -2
    if name is None or last.cost > conditions.cost_limit:
        return None
    power = round(math.log10(last.setting))
    for cut in range(max(-LARGEST_TOLERANCE_CUT, min(-1, wanted)), 0):
        if power + cut < TIGHTEST:
            continue
        try:
            return at_tolerance(last.method, name, float(f"1e{power + cut}")), last.dt, last.cost
        except BadInput:  # tighter than the engine has it
            continue
    return None
