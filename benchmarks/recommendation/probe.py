"""Probe runs: one method at one setting, its error, and the error to expect at the end of the duration.

All runs are sampled at multiples of one spacing, a round number. Steps are that spacing divided or multiplied by a product of
twos and fives. So steps are numbers that people type, and one reference solution serves all runs.
"""

from __future__ import annotations

import bisect
import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from conservative.attitude import Array, angle_between
from conservative.errors import AccuracyNotReached
from conservative.features import Feature
from conservative.grid import Grid, count_steps
from conservative.integration.one import integrate
from conservative.method import Method
from conservative.methods.search import SAFETY, find_cheapest
from conservative.methods.trials import ASYMPTOTIC, trials_of
from conservative.methods.units import bound_rate
from conservative.outcome import Outcome
from conservative.references.exact.method import Exact
from conservative.references.truth import Truth, reference
from conservative.scene import Scene

from ..measures.timing import wall_time
from ..studies import step_ladder
from ..studies.case import Case
from ..studies.selection import tolerance_setting
from ..studies.time_limit import attempt_within
from .growth import EQUAL, Amplification, ErrorLaw, ExpectedDrift, amplification_of, extrapolate_drifts, fit_law

CLOSED_RADIANS, RADIANS = 60.0, 30.0
"""Length of short probes, rad, with a closed form and with multi-precision, which takes a second for ten radians."""
SAMPLES = 32
"""Least number of samples of a short probe."""
RUN_LIMIT, LONG_RUN_LIMIT = 0.1, 0.3
"""Wall time, s, of a short and of a long probe; with a short step it covers less of the motion."""
LONG_SAMPLES = 256
"""Largest number of samples of a probe."""
FINER = 10
"""Spacings between two samples, if a window is long enough: round steps near that interval are multiples of the spacing."""
LEAST_SAMPLES = 4
"""Least number of samples of a window."""
STEPS = 8
"""Least number of steps in a short window."""
MUCH_LONGER = 4
"""The law of a coarser run is used only if that run is this many times as long."""
DISTURBANCE = 1e-9
"""Relative change of the initial rates."""
AFFORDABLE = 0.3
"""Wall time, s, of each of the two disturbed runs if there is no closed form."""
DENSE = 256
"""Number of samples of a disturbed motion in closed form; a computed one has an eighth of them to twice as many."""
MOST_GRIDS = 16
"""Number of grids whose exact attitudes are stored. Methods with the same samples share them."""

_ROUND = sorted({2**a * 5**b for a in range(44) for b in range(19) if 2**a * 5**b <= 10**13})


@dataclass(frozen=True)
class Probe:
    """One run.

    Attributes
    ----------
    method, dt
        The method and its step, s; for an adaptive method the sampling interval.
    length, error
        Length of the run, s, and its largest attitude error, rad; nan if it failed.
    expected, law
        Expected largest error over the whole duration, rad (infinite if it cannot be extrapolated), and how it was found, in
        words.
    holds
        Time, s, up to which the error is expected to stay within the requested one.
    error_law
        Growth of the error; None if the run failed.
    drifts
        Drifts of the invariants.
    cost
        Wall time per simulated second of this one run, s/s, for planning; nan if it failed.
    outcome
        Outcome of the run.
    """

    method: Method
    dt: float
    length: float
    error: float
    expected: float
    law: str
    holds: float
    error_law: ErrorLaw | None
    drifts: tuple[ExpectedDrift, ...]
    cost: float
    outcome: Outcome

    @property
    def setting(self) -> float:
        """The tolerance of an adaptive method, otherwise the step, s."""
        name = tolerance_setting(self.method)
        return self.dt if name is None else float(getattr(self.method, name))


@dataclass(frozen=True, eq=False)
class Question:
    """The question that a recommendation answers: which settings keep the attitude error, rad, on a scene over a duration, s.

    `methods` are the engines to probe, `missing` the names of those that are not installed. A setting may cost `cost_limit` of
    wall time per simulated second, s/s; a run of an engine is stopped after `time_limit`, s.
    """

    scene: Scene
    error: float
    duration: float
    methods: tuple[Method, ...]
    missing: tuple[str, ...]
    cost_limit: float
    time_limit: float


@dataclass(frozen=True, eq=False)
class Conditions(Question):
    """A question with the conditions under which all of its probes run.

    `spacing` is the sampling interval, s, and `samples` the number of samples in a short window. `truth` returns the attitudes
    (n, 3, 3) of the reference solution on a grid that ends at `truth_until`, s, or before. `rate` is the largest angular speed,
    rad/s.
    """

    spacing: float
    samples: int
    reference: Truth
    truth: Callable[[Grid], Array]
    truth_until: float
    rate: float

    @property
    def short(self) -> float:
        """Length of a short window, s."""
        return self.samples * self.spacing

    @property
    def longest_step(self) -> float:
        """Longest step to try, s: a window has `LEAST_SAMPLES` of them, and loads are resolved."""
        return min(self.short / LEAST_SAMPLES, self.scene.smoothness(self.duration).step if self.scene.loads else math.inf)

    @property
    def target(self) -> float:
        """Error that settings are chosen for, rad."""
        return SAFETY * self.error

    @cached_property
    def amplification(self) -> Amplification:
        """Growth of a small change of the initial rates, from two closed forms, otherwise from two runs of our own method."""
        scene = self.scene
        size = float(np.linalg.norm(scene.w_WB_B0)) or self.rate
        disturbed = scene.rename(scene.name, w_WB_B0=scene.w_WB_B0 + DISTURBANCE * size * np.array([0.48, 0.64, 0.6]))
        exact = Exact().unsupported(scene) is None and Exact().unsupported(disturbed) is None
        until = self.duration
        method, dt = (Exact(), until) if exact else self.choose_ours(error=DISTURBANCE / 100)
        if not exact:  # as far as the method gets within the wall time
            n = max(1, math.ceil(self.short / dt))
            run = method.prepare(scene, Grid(dt, n, n))
            run()
            until = min(until, AFFORDABLE * n * dt / wall_time(run))
        times, factors = [], []
        for end in sorted({min(until, self.short), until}):
            n = DENSE if exact else max(DENSE // 8, math.ceil(end / dt))
            grid = Grid(end / n, n, max(1, n // DENSE))
            pair = [method.solve(start, grid) for start in (scene, disturbed)]
            shared = min(map(len, pair))
            times.append(pair[0].t[:shared])
            factors.append(angle_between(pair[0].R_WB[:shared], pair[1].R_WB[:shared]) / DISTURBANCE)
        t, factor = np.concatenate(times), np.concatenate(factors)
        order = np.argsort(t, kind="stable")
        return amplification_of(t[order], np.maximum.accumulate(factor[order]), DISTURBANCE, method.label)

    def round_step(self, dt: float, up: bool = False) -> float:
        """Return the longest round step, s, of at most dt, or if `up` the shortest of at least dt."""
        longer = dt >= self.spacing
        ratio = dt / self.spacing if longer else self.spacing / dt
        if up is longer:
            number = _ROUND[bisect.bisect_left(_ROUND, ratio * (1 - EQUAL))]
        else:
            number = _ROUND[bisect.bisect_right(_ROUND, ratio * (1 + EQUAL)) - 1]
        return self.spacing * number if longer else self.spacing / number

    def choose_ours(self, methods: Sequence[Method] | None = None, error: float | None = None) -> tuple[Method, float]:
        """Return the method of the automatic choice for a short window, among all candidates or some, and its round step, s.

        The error, rad, is by default the window's share of the target.
        """
        wanted = self.target * min(1.0, self.short / self.duration) if error is None else error
        method, dt = find_cheapest(trials_of(self.scene), wanted, self.short, methods, bodies=1000)
        return method, self.round_step(min(dt, self.short / STEPS))

    def window(self, dt: float, cost: float, long: bool) -> Grid:
        """Return the samples of a run with steps of at most dt, s, that cost `cost` s/s: as far as the time limit allows.

        A short window has few samples. A long one extends as far as there is truth to measure errors by.
        """
        least = max(1, round(dt / self.spacing))
        affordable = (LONG_RUN_LIMIT if long else RUN_LIMIT) / cost if cost > 0 else math.inf
        length = min(self.duration, affordable, self.truth_until if long else self.short)
        if length >= LEAST_SAMPLES * math.lcm(least, FINER) * self.spacing:
            least = math.lcm(least, FINER)
        sampling = least * count_steps(length, LONG_SAMPLES * least * self.spacing)
        n = max(LEAST_SAMPLES, count_steps(length, sampling * self.spacing))
        return Grid(sampling * self.spacing, n)

    def probe(self, method: Method, dt: float, cost: float, long: bool, before: Sequence[Probe] = ()) -> Probe:
        """Run a method and return the probe.

        Parameters
        ----------
        method, dt
            The method and its step, s, which an adaptive method ignores.
        cost
            Expected wall time per simulated second, s/s; NaN if unknown.
        long
            True for the long window, False for the short one.
        before
            Probes at longer steps.
        """
        adaptive = tolerance_setting(method) is not None
        samples = self.window(self.spacing if adaptive else dt, cost, long)
        stride = 1 if adaptive else round(samples.dt / dt)
        grid = samples if adaptive else Grid(dt, samples.n_steps * stride, stride)
        run = attempt_within(self.time_limit, Case("recommendation", self.scene, method, grid))
        if isinstance(run, Outcome):
            length = samples.dt * samples.n_steps
            return Probe(method, grid.dt, length, math.nan, math.inf, "the run failed", 0.0, None, (), math.nan, run)
        trajectory = run.trajectory
        length, error = float(trajectory.t[-1]), angle_between(self.truth(samples), trajectory.R_WB)
        drifts = extrapolate_drifts(trajectory, self.duration)
        # A steady change of energy or momentum changes the angular velocity steadily.
        phase = self.rate * max((abs(drift.slope) for drift in drifts if drift.secular), default=0.0)
        law = self._carry_over(method, grid.dt, length, before)
        law = law or fit_law(trajectory.t, error, phase, self.amplification.excess(length, self.duration))
        exceeded = error > self.error
        return Probe(
            method,
            grid.dt,
            length,
            error=float(error.max()),
            expected=law.extrapolate(self.duration),
            law=law.describe(self.duration),
            holds=float(trajectory.t[np.argmax(exceeded)]) if exceeded.any() else max(length, law.find_duration(self.error)),
            error_law=law,
            drifts=drifts,
            cost=run.cost.first_call / length,
            outcome=trajectory.outcome,
        )

    def _carry_over(self, method: Method, dt: float, length: float, before: Sequence[Probe]) -> ErrorLaw | None:
        """Return the law of the coarser setting that ran longest, scaled to a finer one by the order of the method.

        A run of a few turns at a short step shows round-off and the first oscillation, not the law by which errors grow. The
        result is None if the finer run is about as long as the coarser one.
        """
        whole = [probe for probe in before if self.shows_growth(probe)]
        name = tolerance_setting(method)
        if not whole or (name is None and method.order is None):
            return None
        base = max(whole, key=lambda probe: (probe.length, -probe.setting))
        enough = min(base.length / MUCH_LONGER, self.duration)
        if length >= max(enough, min(self.short, self.duration)) * (1 - EQUAL):
            return None
        assert base.error_law is not None  # `shows_growth` requires it
        if name is not None:  # the error is proportional to a tolerance
            factor, where = getattr(method, name) / base.setting, f"{name} = {base.setting:g}, carried here in proportion to it"
        else:
            assert method.order is not None  # checked above
            factor, where = (dt / base.dt) ** method.order, f"dt = {base.dt:.3g} s, carried here by order {method.order}"
        carried = base.error_law.scale(factor, f" at {where}")
        # Round-off: a random walk of the rate by a rounding unit a step.
        rounding = self.rate * float(np.finfo(float).eps) / 2 * math.sqrt(self.duration / dt)
        return replace(carried, linear=carried.linear + rounding)

    def shows_growth(self, probe: Probe) -> bool:
        """Return whether a probe covered a whole short window with a small error, so that it shows how errors grow."""
        whole = probe.length >= min(self.short, self.duration) * (1 - EQUAL)
        return whole and probe.error_law is not None and not probe.error_law.carried and probe.error < ASYMPTOTIC


def prepare_conditions(asked: Question) -> Conditions:
    """Return the conditions of all probes."""
    scene, duration = asked.scene, asked.duration
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyNotReached)  # only the angular velocity is used
        until = min(duration, 2 * CLOSED_RADIANS / bound_rate(scene))
        trial = integrate(scene, error=1e-3, t_end=until, on_failure="return")
    rate = max(float(np.linalg.norm(trial.w_WB_B, axis=1).max()), 1 / duration)  # at least one radian in the whole duration
    closed = Exact().unsupported(scene) is None
    length = min(duration, (CLOSED_RADIANS if closed else RADIANS) / rate)
    if scene.loaded or Feature.TIME in scene.features:  # a part of the motion says nothing about the rest
        length = duration
    widest = min(length / SAMPLES, step_ladder.RADIANS / rate)
    power = math.floor(math.log10(widest))
    digit = max(digit for digit in (1, 2, 5) if digit <= widest / 10.0**power * (1 + EQUAL))
    spacing = float(f"{digit}e{power}") / FINER
    samples = count_steps(length, spacing)
    # Runs with steps longer than the spacing end up to a quarter later.
    truth = reference(scene, Grid(spacing, samples + samples // LEAST_SAMPLES + 1))

    @lru_cache(maxsize=MOST_GRIDS)
    def closed_form(grid: Grid) -> Array:
        return Exact().solve(scene, grid).R_WB

    def sampled(grid: Grid) -> Array:
        """Return the attitudes of the reference solution at multiples of the spacing."""
        return truth.trajectory.R_WB[:: round(grid.dt / spacing)][: grid.n_samples]

    return Conditions(
        **vars(asked),
        spacing=spacing,
        samples=samples,
        reference=truth,
        truth=closed_form if closed else sampled,
        truth_until=float(max(duration, truth.trajectory.t[-1]) if closed else samples * spacing),
        rate=rate,
    )
