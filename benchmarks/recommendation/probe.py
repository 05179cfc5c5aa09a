"""Probe runs: one method at one setting, its error, and the error to expect at the end of the duration.

The times of samples of all runs are multiples of one spacing, a round number. Steps are that spacing divided or multiplied by a
product of twos and fives. So steps are numbers that people type, and one reference solution serves all runs.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from conservative.attitude import Array, angle_between
from conservative.grid import Grid
from conservative.method import Method
from conservative.methods.search import SAFETY
from conservative.methods.trials import ASYMPTOTIC
from conservative.outcome import Outcome
from conservative.scene import Scene

from ..studies.case import Case, Success
from ..studies.selection import tolerance_setting
from ..studies.study import HANG_LIMIT
from ..studies.time_limit import attempt_within
from .extrapolation import Amplification, Drift, ErrorLaw, Scaling, extrapolate_drifts, fit_law

RUN_LIMIT, LONG_RUN_LIMIT = 0.1, 0.3
"""Longest run of a short and of a long probe, s of wall time: with a short step it covers less of the motion."""
LONG_SAMPLES = 256
LEAST_SAMPLES = 4
STEPS = 8
"""Least number of steps in a short window."""
MUCH_LONGER = 4
"""Use the coarser run's law only if that run is this many times longer."""

_ROUND = sorted({2**a * 5**b for a in range(44) for b in range(19) if 2**a * 5**b <= 10**13})


@dataclass(frozen=True)
class Probe:
    """One run.

    Attributes
    ----------
    method, dt
        Method, and its step, s; for an adaptive method the distance of samples.
    length, error
        Of the run, s, and its largest attitude error against the truth, rad; nan where it failed.
    expected, law
        Expected largest error over the whole duration, rad, infinite where the attitude is lost; and the reason, in words.
    holds
        How long the error is expected to stay within the one that is wanted, s.
    error_law
        How the error grows; None where the run failed.
    drifts
        Of the invariants.
    cost
        Wall time per simulated second of this one run, s/s, to plan with; nan where it failed. Not interleaved.
    outcome
        How it ended.
    """

    method: Method
    dt: float
    length: float
    error: float
    expected: float
    law: str
    holds: float
    error_law: ErrorLaw | None
    drifts: tuple[Drift, ...]
    cost: float
    outcome: Outcome

    @property
    def setting(self) -> float:
        """The tolerance of an adaptive method, else the step, s."""
        name = tolerance_setting(self.method)
        return self.dt if name is None else float(getattr(self.method, name))


@dataclass(frozen=True, eq=False)
class Conditions:
    """The conditions under which all probes of a scene run.

    Attributes
    ----------
    scene, error, duration
        Scene, wanted attitude error, rad, and duration, s.
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
        Growth of a disturbance.
    time_limit
        Time, s, after which a probe is ended.
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
    time_limit: float = HANG_LIMIT

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
        """Run a method and return the probe.

        Parameters
        ----------
        method, dt
            Method, and its step, s, which an adaptive method ignores.
        cost
            Expected cost, s/s; NaN if unknown.
        long
            Which window.
        before
            Probes at longer steps.
        """
        adaptive = tolerance_setting(method) is not None
        samples = self.window(self.spacing if adaptive else dt, cost, long)
        each = 1 if adaptive else round(samples.dt / dt)
        grid = samples if adaptive else Grid(dt, samples.n_steps * each, each)
        outcome = attempt_within(self.time_limit, Case("recommendation", self.scene, method, grid))
        length = samples.dt * samples.n_steps
        if not isinstance(outcome, Success):
            why = outcome.outcome
            return Probe(method, grid.dt, length, math.nan, math.inf, "the run failed", 0.0, None, (), math.nan, why)
        return self._evaluate(method, grid, samples, outcome, before)

    def _evaluate(self, method: Method, grid: Grid, samples: Grid, outcome: Success, before: Sequence[Probe]) -> Probe:
        trajectory = outcome.trajectory
        error = angle_between(self.truth(samples), trajectory.R_WB)
        found = extrapolate_drifts(trajectory, self.duration)
        length, largest = float(trajectory.t[-1]), float(error.max())
        # A steady change of energy or momentum is one of the speed at which the body goes round.
        phase = self.rate * max((abs(drift.slope) for drift in found if drift.secular), default=0.0)
        law = fit_law(trajectory.t, error, phase, self.amplification.excess(length, self.duration))
        law = self._carry_over(method, grid.dt, length, before) or law
        exceeded = error > self.error
        holds = float(trajectory.t[np.argmax(exceeded)]) if exceeded.any() else max(length, law.find_duration(self.error))
        expected, cost = law.extrapolate(self.duration), outcome.cost.first_call / length
        return Probe(
            method, grid.dt, length, largest, expected, law.describe(self.duration), holds, law, found, cost, trajectory.outcome
        )

    def _carry_over(self, method: Method, dt: float, length: float, before: Sequence[Probe]) -> ErrorLaw | None:
        """Return the law of the coarser setting that ran longest, carried to a finer one by the method's order.

        A run of a few turns at a short step shows round-off and the first oscillation, not the law by which errors grow. None
        where the finer run is about as long itself.
        """
        whole = [probe for probe in before if self.shows_growth(probe)]
        name = tolerance_setting(method)
        if not whole or (name is None and method.order is None):
            return None
        base = max(whole, key=lambda probe: (probe.length, -probe.setting))
        enough = min(base.length / MUCH_LONGER, self.duration)
        if length >= max(enough, min(self.short, self.duration)) * (1 - 1e-9):
            return None
        assert base.error_law is not None  # `shows_growth` requires it
        if name is not None:
            tolerance = getattr(method, name)
            scaling = Scaling(name, base.setting, tolerance / base.setting, None)
        else:
            assert method.order is not None  # checked above
            scaling = Scaling("dt", base.dt, (dt / base.dt) ** method.order, method.order)
        carried = base.error_law.scale(scaling)
        # Round-off: a random walk of the rate by a rounding unit a step.
        rounding = self.rate * float(np.finfo(float).eps) / 2 * math.sqrt(self.duration / dt)
        return replace(carried, linear=carried.linear + rounding)

    def shows_growth(self, probe: Probe) -> bool:
        """Whether a probe shows how its error grows: it ran over a whole short window and was not lost."""
        whole = probe.length >= min(self.short, self.duration) * (1 - 1e-9)
        return whole and probe.error_law is not None and probe.error_law.scaling is None and probe.error < ASYMPTOTIC
