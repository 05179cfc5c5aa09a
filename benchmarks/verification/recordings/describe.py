"""Descriptions of recordings: rows, rate, gaps, sign changes, jitter, digits, noise, and properties that no row shows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array, angle_between
from conservative.number_text import number

from ..compare import FEWEST_FOR_NOISE, FLOOR, QUARTER, Compared, estimate_noise

GAP = 1.5
"""Smallest time between two rows, in typical times, in which rows are missing."""
DOUBLE = 1e-9
"""Rounding, rad or relative to the largest rate, below which a quantity has the digits of double precision."""
STEADY = 1e-3
"""Smallest jitter that is described, relative to the time between two rows."""

AS_NOISE = 1.3
"""Largest size of rows about rest, in units of their noise, that noise alone may have."""


@dataclass
class Survey:
    """Counts over all rows that are compared, chunk by chunk. Times are in the unit of the file.

    `typical` is the median time between two rows in the first chunk. `steps`, `total` and `squares` are the number, the sum and
    the sum of squares of times between rows that are no gaps.
    """

    typical: float = math.nan
    rows: int = 0
    first: float = math.nan
    last: float = math.nan
    steps: int = 0
    total: float = 0.0
    squares: float = 0.0
    gaps: int = 0
    longest: float = 0.0
    sign_changes: int = 0
    before: Array = field(default_factory=lambda: np.empty(0))

    def add(self, t: Array, quaternions: Array) -> None:
        """Count rows at times (n,), with the quaternions (n, 4) of the file or (n, 0)."""
        if not len(t):
            return
        steps = np.diff(t, prepend=self.last) if self.rows else np.diff(t)
        if math.isnan(self.typical) and len(steps):
            self.typical = float(np.median(steps))
        usual = steps <= GAP * self.typical
        # Relative to the typical step, so that sums of squares keep their digits.
        off = steps[usual] - self.typical
        self.steps, self.total, self.squares = (
            self.steps + len(off),
            self.total + float(off.sum()),
            self.squares + float((off * off).sum()),
        )
        self.gaps += int((~usual).sum())
        self.longest = max(self.longest, float(steps[~usual].max(initial=0.0)))
        if quaternions.shape[1]:
            q = np.vstack([self.before, quaternions]) if self.before.size else quaternions
            self.sign_changes += int(((q[1:] * q[:-1]).sum(axis=1) < 0).sum())
            self.before = q[-1]
        self.first = float(t[0]) if not self.rows else self.first
        self.last, self.rows = float(t[-1]), self.rows + len(t)

    def describe(self, unit: float) -> Description:
        """Return the description of the rows and their times; `unit` is the unit of the time, s."""
        mean = self.total / self.steps if self.steps else math.nan
        jitter = math.sqrt(max(self.squares / self.steps - mean * mean, 0.0)) if self.steps > 1 else 0.0
        step = self.typical + mean if self.steps else self.typical
        # Round-off of times is no jitter.
        jitter = 0.0 if jitter <= max(STEADY * step, 2 * float(np.spacing(abs(self.last)))) else jitter
        return Description(
            self.rows,
            (self.last - self.first) * unit,
            1 / (step * unit),
            self.gaps,
            self.longest * unit,
            self.sign_changes,
            jitter * unit,
        )


@dataclass(frozen=True)
class Description:
    """The description of a recording.

    Attributes
    ----------
    rows, duration, rate
        Number of rows that are compared, the time from the first to the last one, s, and rows per second where none is missing.
    gaps, longest_gap
        Number of times between two rows in which rows are missing, and the longest of them, s.
    sign_changes
        Number of rows in which the quaternion of the file changes its sign.
    jitter
        Standard deviation of the time between two rows, s, without gaps; 0 for equal times.
    digits
        Largest rounding of times, s, attitudes, rad, and rates, rad/s, by the digits of the file.
    noise
        Standard deviation of the noise of one axis of attitudes, rad, and of rates, rad/s; 0 if none is found.
    left_out
        Numbers of rows that are not compared, by the reason.
    """

    rows: int
    duration: float
    rate: float
    gaps: int = 0
    longest_gap: float = 0.0
    sign_changes: int = 0
    jitter: float = 0.0
    digits: tuple[float, float, float] = (0.0, 0.0, 0.0)
    noise: tuple[float, float] = (0.0, 0.0)
    left_out: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))

    def lines(self, attitudes: bool, rates: bool, scale: float, degrees: bool = False) -> tuple[str, str]:
        """Return two sentences: on the rows and their times, and on the digits and noise of values.

        `scale` is the largest rate, rad/s; `degrees` is True for rates in deg/s.
        """
        times = [f"{self.rows:,} rows over {number(self.duration, 4)} s at {number(self.rate, 4)} Hz"]
        if self.gaps:
            what = "one gap of" if self.gaps == 1 else f"{self.gaps:,} gaps, the longest"
            times.append(f"{what} {number(self.longest_gap, 3)} s")
        if self.jitter:
            times.append(f"the time between rows varies by {number(self.jitter)} s")
        if self.sign_changes:
            times.append(f"the quaternion changes its sign {_times(self.sign_changes)}")
        unit, size = ("deg/s", 180 / math.pi) if degrees else ("rad/s", 1.0)
        kinds = [("attitudes", attitudes, self.noise[0], self.digits[1], 1.0, "rad", 1.0)]
        kinds += [("rates", rates, self.noise[1], self.digits[2], scale, unit, size)]
        values = []
        for name, there, noise, digits, largest, of, factor in kinds:
            if there and noise > max(digits, DOUBLE * largest):
                values.append(f"{name} with noise of {number(noise * factor)} {of} in each axis")
            elif there and digits > DOUBLE * largest:
                values.append(f"{name} rounded to {number(2 * digits * factor, 1)} {of}")
            elif there:
                values.append(f"{name} in double precision")
        left = [f"{count:,} row{'s' * (count > 1)} {reason}" for reason, count in self.left_out.items()]
        second = "; ".join([" and ".join(values), *([f"left out: {', '.join(left)}"] if left else [])])
        return f"{'; '.join(times)}.", f"{second[:1].upper()}{second[1:]}."


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count:,} times"


def at_rest(case: Compared) -> bool:
    """Return whether neither the rows nor the exact motion move by more than is allowed."""
    still = np.broadcast_to(case.exact[0][:1], case.exact[0].shape), np.zeros_like(case.exact[1])
    moved = case.apart(case.exact, still), case.errors(*still).max(axis=1)
    return bool((np.maximum(*moved) <= case.allowed).all())


def only_noise(case: Compared) -> bool:
    """Return whether the rows may be noise about a body at rest: their noise is as large as all of their motion."""
    if len(case.t) < FEWEST_FOR_NOISE or case.gap > QUARTER:  # turns from row to row look like noise
        return False
    (R, w), noise = case.data, estimate_noise(case.t, case.data)[0]
    rest = Rotation.from_matrix(np.eye(3)[None] if R is None else R)
    turns = (rest.mean().inv() * rest).as_rotvec()
    sizes = [float(np.sqrt(np.mean(np.square(x)))) for x in (turns, np.zeros(3) if w is None else w)]
    least = FLOOR, 0.0  # round-off of attitudes is no noise
    return all(
        x is None or low < size < AS_NOISE * each
        for x, size, each, low in zip(case.data, sizes, noise.tolist(), least, strict=True)
    )


def unseen(case: Compared) -> list[str]:
    """Return sentences on what the rows of a right recording do not show, of a free body without a rotor."""
    (R, w), body = case.exact, case.scene.body
    if not case.scene.free or body.rotor_momentum is not None:
        return []
    if at_rest(case):
        return ["The body is at rest in all rows: they do not show its moments of inertia."]
    constant = np.linalg.norm(w - w[0], axis=1).max() <= case.allowed[1] * case.scale
    if constant and case.data[0] is not None and angle_between(R, R[:1]).max() <= case.allowed[0]:
        return ["The motion is smaller than the allowed error: a body that stands still would be right, too."]
    if constant:
        what = "the moments of inertia" if case.data[0] is not None else "the moments of inertia, nor whether the body turns"
        return [f"The rates are constant: they do not show {what}."]
    if len(np.unique(np.round(body.moments / body.moments[0], 12))) < 3:
        return ["Two moments are equal: a turn of the body axes about the third axis does not change the motion."]
    return []
