"""Growth of errors and drifts with time: extrapolation from a short run to a long one by a stated law."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from conservative.attitude import Array
from conservative.invariants import sizes
from conservative.methods.trials import ASYMPTOTIC
from conservative.number_text import number
from conservative.trajectory import Trajectory

from ..measures.errors import is_lost, secular_slope

EQUAL = 1e-9
"""Times and steps that differ by less than this share are equal."""
TREND = 0.5
"""Share of the largest drift that a straight line must explain in a secular drift."""
SIGNIFICANT = 3.0
"""Standard errors between the slope of a secular drift and zero."""
FASTER_THAN_LINEAR = 10.0
"""A motion is unstable if it amplifies a disturbance by this factor more than in proportion to time."""


@dataclass(frozen=True)
class ExpectedDrift:
    """Change of an invariant relative to its reference scale.

    `measured` is the largest drift of the run. `expected` is the largest drift over the duration: proportional to time if the
    drift is `secular`, otherwise as measured. `slope` is the slope of a fitted line, 1/s.
    """

    name: str
    measured: float
    expected: float
    slope: float
    secular: bool


def extrapolate_drifts(trajectory: Trajectory, duration: float) -> tuple[ExpectedDrift, ...]:
    """Return the drift of every invariant of a run, measured and expected over `duration`, s."""
    drifts = []
    for invariant in trajectory.scene.invariants:
        relative = trajectory.drift(invariant)
        largest = float(sizes(relative).max())
        slope, stderr = secular_slope(trajectory.t, relative)
        length = float(trajectory.t[-1])
        secular = abs(slope) > SIGNIFICANT * stderr and abs(slope) * length > TREND * largest
        factor = max(1.0, duration / length) if secular else 1.0
        drifts.append(ExpectedDrift(invariant.name, largest, largest * factor, slope, secular))
    return tuple(drifts)


@dataclass(frozen=True)
class ErrorLaw:
    """Attitude error over time, from a run that is shorter than the duration.

    Attributes
    ----------
    length, error
        Length of the run, s, and its largest attitude error, rad.
    exponent
        p of t^p between half the run and all of it.
    linear, quadratic
        Coefficients a and b of a t + b t^2, rad/s and rad/s^2. b is the larger of two values: the fitted one, and the effect of
        a steady drift of an invariant on the phase.
    excess
        Additional factor by which the motion itself amplifies errors between the length and the duration.
    carried
        Text on the coarser setting from which this law was scaled; "" for a law of the run itself.
    """

    length: float
    error: float
    exponent: float
    linear: float
    quadratic: float
    excess: float
    carried: str = ""

    def extrapolate(self, duration: float) -> float:
        """Return the expected error over `duration` s, rad; infinite if the error of the run is too large to extrapolate."""
        if self.error >= ASYMPTOTIC:
            return math.inf
        if self.is_measured(duration):
            return self.error
        return self.excess * max(self.error, self.linear * duration + self.quadratic * duration**2)

    def find_duration(self, error: float) -> float:
        """Return the time, s, up to which the expected error stays within `error`, rad, without amplification by the motion."""
        if not self.linear + self.quadratic > 0:
            return math.inf
        root = math.sqrt(self.linear**2 + 4 * self.quadratic * error)
        return 2 * error / (self.linear + root)

    def is_measured(self, duration: float) -> bool:
        """Return whether the run covers the duration."""
        return not self.carried and self.length >= duration * (1 - EQUAL)

    def scale(self, factor: float, carried: str) -> ErrorLaw:
        """Return the law of a finer setting, whose errors are `factor` times as large."""
        linear, quadratic = self.linear * factor, self.quadratic * factor
        return replace(self, error=self.error * factor, linear=linear, quadratic=quadratic, carried=carried)

    def describe(self, duration: float) -> str:
        """Return the law of `extrapolate` in words."""
        if self.is_measured(duration):
            return f"measured over all {duration:g} s"
        run = f"measured over {self.length:.3g} s{self.carried}"
        if self.error >= ASYMPTOTIC:
            return f"{run}, where {'the attitude is lost' if is_lost(self.error) else 'the error is too large to extrapolate'}"
        if math.isinf(self.excess):
            return f"{run}; cannot be extrapolated to {duration:g} s: the motion amplifies errors without bound"
        steady, growing = self.linear * duration, self.quadratic * duration**2
        kind = "linearly" if growing <= 0.1 * steady else "quadratically" if steady <= 0.1 * growing else "as a t + b t^2"
        times = f", times {number(self.excess)} as the motion amplifies errors" if self.excess > FASTER_THAN_LINEAR else ""
        return f"{run} (grew as t^{self.exponent:.1f}), extrapolated {kind} to {duration:g} s{times}"


def fit_law(t: Array, error: Array, phase_acceleration: float, excess: float) -> ErrorLaw:
    """Return the law of an error.

    E1 is the largest error over the first half of the run, and E2 over the whole run. If the error grows faster than t and more
    slowly than t^2, a t + b t^2 goes through both. If it grows more slowly, b is 0. If it grows faster, a is 0.

    Parameters
    ----------
    t, error
        Times (n,), s, from 0, and attitude errors (n,), rad.
    phase_acceleration
        Rate at which a steady drift of an invariant changes the angular velocity, rad/s^2.
    excess
        See `ErrorLaw`.
    """
    length, whole = float(t[-1]), float(error.max())
    half = float(error[t <= length / 2 * (1 + EQUAL)].max())
    exponent = math.log2(whole / half) if half > 0 else 0.0
    b = min(max(2 * (whole - 2 * half) / length**2, 0.0), whole / length**2)
    a = max(whole / length - b * length, 0.0)
    return ErrorLaw(length, whole, exponent, a, max(b, phase_acceleration / 2), excess)


@dataclass(frozen=True, eq=False)
class Amplification:
    """Growth of a small relative change of the initial rates, the `disturbance`, as long as the two motions are comparable.

    `factor` (n,) is the largest difference of the attitudes up to the times t (n,), s, in rad, divided by the disturbance.
    `label` belongs to the method that integrated both motions. If `ends`, they are not comparable any more after t[-1].
    """

    t: Array
    factor: Array
    disturbance: float
    label: str
    ends: bool = False

    @property
    def final_size(self) -> float:
        """Largest difference of the attitudes, rad."""
        return float(self.factor[-1]) * self.disturbance

    @property
    def steepness(self) -> float:
        """Final disturbance divided by a straight line through its value after an eighth of the samples."""
        early = max(1, (len(self.t) - 1) // 8)
        if self.factor[early] <= 0:
            return math.inf if self.factor[-1] > 0 else 1.0
        return float(self.factor[-1] / self.factor[early] * self.t[early] / self.t[-1])

    @property
    def unstable(self) -> bool:
        """True if the disturbance grows far more than in proportion to time."""
        return self.steepness > FASTER_THAN_LINEAR

    def excess(self, start: float, stop: float) -> float:
        """Return the growth between two times, s, relative to one in proportion to time; infinite if an unstable one ends."""
        end = float(self.t[-1])
        if self.ends and self.unstable and end < stop:
            return math.inf
        last = min(stop, end)
        if last <= start:
            return 1.0
        before, after = np.interp([start, last], self.t, self.factor).tolist()
        return max(1.0, after / before * start / last) if before > 0 else 1.0


def amplification_of(t: Array, factor: Array, disturbance: float, label: str) -> Amplification:
    """Return the amplification up to the time at which the two motions become unrelated."""
    apart = factor * disturbance > ASYMPTOTIC
    n = max(2, int(np.argmax(apart))) if apart.any() else len(t)
    return Amplification(t[:n], factor[:n], disturbance, label, n < len(t))
