"""Probe runs: one method at one setting, its error against the truth, and the error that this makes expect in the end.

Samples of all runs are multiples of one spacing, a round number, and steps are that spacing divided or multiplied by a product
of twos and fives: so they are numbers that people type, and one truth serves all runs of a motion that has no closed form.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from conservative.attitude import Array, angle_between
from conservative.errors import BadInput
from conservative.method import Grid, Method
from conservative.scene import Scene
from conservative.trajectory import OK

from .cases import Case, Done, attempt
from .growth import LOST, Amplification, Drift, Growth, drifts, growth
from .order import MIN_POINTS
from .selection import at_tolerance, tolerance_setting

SAFETY = 0.5
"""Share of the wanted error that settings are chosen for."""
RUN_LIMIT, LONG_RUN_LIMIT = 0.1, 0.3
"""Longest run of a short and of a long probe, s of wall time: with a short step it covers less of the motion."""
LONG_SAMPLES = 256
LEAST_SAMPLES = 4
STEPS = 8
"""Least number of steps in a short window."""
ATTEMPTS = 12
BOLDEST, BLINDLY = 1 / 16, 1 / 8
"""Largest cut of a step from one probe to the next, and the cut where a probe says nothing."""
TIGHTEST = -16
"""Smallest tolerance asked for, power of ten: a rounding unit."""
BOLDEST_TOLERANCE = 4
"""Largest cut of a tolerance from one probe to the next, powers of ten."""
COARSER = 1 / 16
"""Share of the wanted error below which a longer step is tried, too."""

_ROUND = sorted({2**a * 5**b for a in range(44) for b in range(19) if 2**a * 5**b <= 10**13})


@dataclass(frozen=True)
class Probe:
    """One run.

    Attributes
    ----------
    method, dt
        What ran; dt in s, of an adaptive method the distance of samples.
    length, error
        Of the run, s, and its largest attitude error against the truth, rad; nan where it failed.
    expected, law
        Largest error to expect over the whole duration, rad, infinite where the attitude is lost; in words how that follows.
    holds
        For how long the wanted error may be expected to hold, s.
    growth
        The law; None where the run failed.
    drifts
        Of the invariants.
    cost
        Wall time per simulated second of this one run, s/s, to plan with; nan where it failed. Not interleaved.
    status
        "ok", or what failed.
    """

    method: Method
    dt: float
    length: float
    error: float
    expected: float
    law: str
    holds: float
    growth: Growth | None
    drifts: tuple[Drift, ...]
    cost: float
    status: str

    @property
    def setting(self) -> float:
        """The tolerance of an adaptive method, else the step, s."""
        name = tolerance_setting(self.method)
        return self.dt if name is None else float(getattr(self.method, name))


Aim = Callable[[Probe], float]
"""The error, rad, that is compared with the wanted one."""


@dataclass(frozen=True, eq=False)
class Bench:
    """What all probes of a scene have in common.

    Attributes
    ----------
    scene, error, duration
        What is asked: the largest attitude error, rad, over s.
    cost_limit
        Wall time per simulated second, s/s, that a setting may cost.
    spacing, samples
        Distance of samples, s, and their number in a short window.
    truth
        From a grid to true attitudes (n, 3, 3).
    truth_until
        End of the truth, s.
    rate
        Largest angular speed, rad/s.
    amplification
        What becomes of a disturbance.
    """

    scene: Scene
    error: float
    duration: float
    cost_limit: float
    spacing: float
    samples: int
    truth: Callable[[Grid], Array]
    truth_until: float
    rate: float
    amplification: Amplification

    @property
    def short(self) -> float:
        """Length of a short window, s."""
        return self.samples * self.spacing

    @property
    def target(self) -> float:
        """Error that settings are chosen for, rad."""
        return SAFETY * self.error

    def step_at_most(self, dt: float) -> float:
        """Return the longest round step, s, of at most dt."""
        if dt >= self.spacing:
            return self.spacing * float(_ROUND[bisect.bisect_right(_ROUND, dt / self.spacing * (1 + 1e-9)) - 1])
        return self.spacing / float(_ROUND[bisect.bisect_left(_ROUND, self.spacing / dt * (1 - 1e-9))])

    def step_at_least(self, dt: float) -> float:
        """Return the shortest round step, s, of at least dt."""
        if dt >= self.spacing:
            return self.spacing * float(_ROUND[bisect.bisect_left(_ROUND, dt / self.spacing * (1 - 1e-9))])
        return self.spacing / float(_ROUND[bisect.bisect_right(_ROUND, self.spacing / dt * (1 + 1e-9)) - 1])

    def window(self, dt: float, cost: float, long: bool) -> Grid:
        """Return the samples of a run whose steps are dt s long, or shorter, and cost `cost` s/s: as far as the limit goes.

        A short window has the spacing's samples, a long one goes as far as there is truth to measure it by.
        """
        least = max(1, round(dt / self.spacing))
        affordable = (LONG_RUN_LIMIT if long else RUN_LIMIT) / cost if cost > 0 else math.inf
        length = min(self.duration, affordable, self.truth_until if long else self.short)
        sampling = least * max(1, math.ceil(length / (LONG_SAMPLES * least * self.spacing) * (1 - 1e-9)))
        n = max(LEAST_SAMPLES, math.ceil(length / (sampling * self.spacing) * (1 - 1e-9)))
        return Grid(sampling * self.spacing, n)

    def probe(self, method: Method, dt: float, cost: float, long: bool, before: Sequence[Probe] = ()) -> Probe:
        """Return what a run of a method shows.

        Parameters
        ----------
        method, dt
            What runs; dt in s, without a meaning for an adaptive method.
        cost
            What it is expected to cost, s/s; nan where nobody knows.
        long
            Which window.
        before
            Probes at longer steps.
        """
        adaptive = tolerance_setting(method) is not None
        samples = self.window(self.spacing if adaptive else dt, cost, long)
        each = 1 if adaptive else round(samples.dt / dt)
        grid = samples if adaptive else Grid(dt, samples.n_steps * each, each)
        outcome = attempt(Case("recommendation", self.scene, method, grid))
        length = samples.dt * samples.n_steps
        if not isinstance(outcome, Done):
            reason = f"{outcome.status}: {outcome.detail}" if outcome.detail else outcome.status
            return Probe(method, grid.dt, length, math.nan, math.inf, "the run failed", 0.0, None, (), math.nan, reason)
        return self._measured(method, grid, samples, outcome, before)

    def _measured(self, method: Method, grid: Grid, samples: Grid, outcome: Done, before: Sequence[Probe]) -> Probe:
        trajectory = outcome.trajectory
        error = angle_between(self.truth(samples), trajectory.R_WB)
        found = drifts(trajectory, self.duration)
        length, largest = float(trajectory.t[-1]), float(error.max())
        # A steady change of energy or momentum is one of the speed at which the body goes round.
        phase = self.rate * max((abs(drift.slope) for drift in found if drift.secular), default=0.0)
        law = growth(trajectory.t, error, phase, self.amplification.excess(length, self.duration))
        if length < min(self.short, self.duration) * (1 - 1e-9):
            law = self._carried(method, grid.dt, before) or law
        exceeded = error > self.error
        holds = float(trajectory.t[np.argmax(exceeded)]) if exceeded.any() else max(length, law.holds(self.error))
        expected, cost = law.at(self.duration), outcome.cost.first_call / length
        return Probe(
            method, grid.dt, length, largest, expected, law.law(self.duration), holds, law, found, cost, trajectory.status
        )

    def _carried(self, method: Method, dt: float, before: Sequence[Probe]) -> Growth | None:
        """Return the law of the finest setting that ran over a whole window, carried to a finer one by the method's order.

        A run of a few turns at a short step shows round-off and the first oscillation, not the law by which errors grow.
        """
        whole = [probe for probe in before if self.tells(probe)]
        if not whole or ((name := tolerance_setting(method)) is None and method.order is None):
            return None
        base = min(whole, key=lambda probe: probe.setting)
        assert base.growth is not None  # or it would tell nothing
        if name is not None:
            factor, how = (
                getattr(method, name) / base.setting,
                f" at {name} = {base.setting:g}, carried here in proportion to it",
            )
        else:
            order = method.order or 0
            factor, how = (dt / base.dt) ** order, f" at dt = {base.dt:.3g} s, carried here by order {order}"
        carried = base.growth.finer(factor, how)
        # What rounding leaves: a random walk of the rate, a rounding unit a step.
        rounding = self.rate * float(np.finfo(float).eps) / 2 * math.sqrt(self.duration / dt)
        return replace(carried, linear=carried.linear + rounding)

    def tells(self, probe: Probe) -> bool:
        """Whether a probe shows how its error grows: it ran over a whole short window and was not lost."""
        whole = probe.length >= min(self.short, self.duration) * (1 - 1e-9)
        return whole and probe.growth is not None and not probe.growth.scaled and probe.error < LOST


@dataclass(frozen=True)
class Climb:
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
        """Return settings (n,) and errors (n,) of the short ones that cover the same time: what an order is fitted to."""
        length = self.short[0].length
        found = {p.setting: p.error for p in self.short if math.isclose(p.length, length) and p.status == OK}
        return np.array(list(found)), np.array(list(found.values()))


def climbed(bench: Bench, method: Method, dt: float) -> Climb:
    """Return the probes of a method from a step, or the tolerance it has, on, until one may be expected to have the error.

    Where the truth is known for longer, short probes only have to be good enough for an error that grows linearly, and long
    ones find out. There a longer step is tried, too, where the error has turned out far smaller than wanted.
    """
    more = bench.truth_until > bench.short * (1 + 1e-9) and bench.duration > bench.short

    def linear(probe: Probe) -> float:
        longer = max(1.0, bench.duration / probe.length)
        return probe.error * longer if bench.tells(probe) else probe.expected

    aim = linear if more else lambda probe: probe.expected
    short = _refined(bench, [bench.probe(method, dt, math.nan, long=False)], aim, long=False)
    last = short[-1]
    if not more or aim(last) > bench.target:
        return Climb(tuple(short), ())
    first = bench.probe(last.method, last.dt, last.cost, True, short)
    long = _refined(bench, [first], lambda probe: probe.expected, long=True)
    if method.order is not None and first.expected < COARSER * bench.target:
        # At most four times: the error must still shrink with its order where the step comes from.
        factor = min(4.0, (bench.target / max(first.expected, 1e-300)) ** (1 / method.order))
        longer = bench.step_at_most(first.dt * factor)
        long += [bench.probe(method, longer, first.cost * first.dt / longer, True)] if longer > first.dt else []
    return Climb(tuple(short), tuple(long))


def _refined(bench: Bench, probes: list[Probe], aim: Aim, long: bool) -> list[Probe]:
    adaptive = tolerance_setting(probes[0].method) is not None
    while len(probes) < ATTEMPTS and aim(probes[-1]) > bench.target and not hopeless(probes):
        finer = (_tighter if adaptive else _shorter)(bench, probes, aim(probes[-1]))
        if finer is None:
            break
        probes.append(bench.probe(*finer, long, tuple(probes)))
    return probes


def hopeless(probes: Sequence[Probe]) -> bool:
    """Whether finer settings have stopped helping where they once did: round-off."""
    found = [probe.expected for probe in probes if probe.expected < LOST]
    return len(found) >= 3 and min(found[-2:]) > 0.7 * found[-3]


def _shorter(bench: Bench, probes: list[Probe], expected: float) -> tuple[Method, float, float] | None:
    """Return method, next step and its cost; None where the cost allows none."""
    last = probes[-1]
    per_step = min((probe.cost * probe.dt for probe in probes if probe.status == OK), default=math.nan)
    factor = BLINDLY
    if expected < math.inf and last.method.order is not None:
        factor = min(0.8, max(BOLDEST, (bench.target / expected) ** (1 / last.method.order)))
    telling = sum(bench.tells(probe) for probe in probes)
    if bench.tells(last) and telling < MIN_POINTS and per_step * bench.short <= RUN_LIMIT * last.dt / 2:
        factor = max(factor, 1 / 2)  # so that there is an order to be seen
    dt = bench.step_at_most(last.dt * factor)
    if dt < per_step / bench.cost_limit:
        dt = bench.step_at_least(per_step / bench.cost_limit)
    return (last.method, dt, per_step / dt) if dt < last.dt * (1 - 1e-9) else None


def _tighter(bench: Bench, probes: list[Probe], expected: float) -> tuple[Method, float, float] | None:
    """Return method with the next tolerance, a power of ten, and its cost; None where there is none or cost allows none."""
    last = probes[-1]
    name = tolerance_setting(last.method)
    wanted = math.floor(math.log10(bench.target / expected)) if expected < math.inf else -2
    if name is None or last.cost > bench.cost_limit:
        return None
    power = round(math.log10(last.setting))
    for cut in range(max(-BOLDEST_TOLERANCE, min(-1, wanted)), 0):
        if power + cut < TIGHTEST:
            continue
        try:
            return at_tolerance(last.method, name, float(f"1e{power + cut}")), last.dt, last.cost
        except BadInput:  # tighter than the engine has it
            continue
    return None
