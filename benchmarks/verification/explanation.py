"""A mistake, or several at once, that was tried as an explanation of a recorded motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from conservative.attitude import Array

from .compare import HOPELESS, MOST_NOISE, Compared, Solution
from .finding import Cause
from .mistakes.mistake import Mistake, Number

HALF, PROVEN = 0.5, 0.2
"""Shares of the error that an explanation may leave, and that the best one may leave if noise could hide its cause."""
OWN_SHARE = 0.02
"""Share of the effect of a mistake, found in another motion, that the steps of a program may change."""
OWN_ERROR = 3.0
"""Allowed errors that a program may leave with a mistake: its steps have errors on the motion with the mistake, too."""


INTERVAL = 1e-6
"""Change of numbers from which their intervals are computed."""
EXACT = 1e-9
"""Interval, relative to a number (or to 1e-3), below which a sentence has the number alone."""


class Measured(float):
    """A fitted number, which is formatted with its `interval`: two standard deviations for the noise of the rows."""

    interval: float

    def __new__(cls, value: float, interval: float) -> Measured:
        """Return a number with an interval."""
        made = super().__new__(cls, value)
        made.interval = interval
        return made

    def __format__(self, spec: str) -> str:
        """Return the number with as many digits as its interval has, and the interval."""
        if not self.interval > EXACT * max(abs(self), 1e-3):
            return format(0.0 if abs(self) <= self.interval else float(self), spec)
        if abs(self) < 0.1 * self.interval:
            return f"0 ± {self.interval:.1g}"
        digits = math.floor(math.log10(abs(self))) - math.floor(math.log10(self.interval)) + 1
        sign = "+" if spec.startswith("+") else ""
        return f"{float(self):{sign}.{max(1, digits)}g} ± {self.interval:.1g}"


@dataclass(frozen=True)
class Trial:
    """Mistakes that are tried together.

    Attributes
    ----------
    mistakes
        One or several.
    build
        From a case to the motion with the mistakes, as a function of initial states and numbers; None if they make no
        difference, or if the case does not have what they need.
    numbers
        Numbers that `build` takes; by default all of the mistakes.
    remark
        End of the sentence.
    anew
        For a mistake with numbers that belong to each recording, such as the time at which a body falls asleep: from another
        case to the explanation.
    """

    mistakes: tuple[Mistake, ...]
    build: Callable[[Compared], Solution | None]
    numbers: tuple[Number, ...] = ()
    remark: str = ""
    anew: Callable[[Compared], Explanation | None] | None = None

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the mistakes."""
        return tuple(mistake.key for mistake in self.mistakes)

    def sentence(self, values: Mapping[str, float]) -> str:
        """Return the sentences of the mistakes, with numbers."""
        return ". ".join(mistake.sentence.format(**values) for mistake in self.mistakes) + self.remark


@dataclass(frozen=True)
class Explanation:
    """Mistakes that were tried: their keys, the sentence that they state about the file, and their numbers in SI units.

    `left` and `plain` are the largest errors with them and without, over the rows that they were tried on: of attitudes, rad,
    and of rates, relative to the largest. `share` is the share of the error that is left, `size` the root of the mean square in
    units of the noise, and `explains` is True if what is left is allowed. `numbers` counts the fitted ones, and `made` is
    the motion (n, 3, 3), (n, 3). `rest` is the share of the root of the mean square. `trial` applies the mistakes again.
    `of_program` is True if a program answered, and not a file.
    """

    keys: tuple[str, ...]
    sentence: str
    values: dict[str, float]
    left: list[float]
    plain: list[float]
    share: float
    size: float = math.inf
    explains: bool = False
    numbers: int = 0
    made: tuple[Array, Array] | None = field(default=None, compare=False, repr=False)
    rest: float = 0.0
    trial: Trial | None = field(default=None, compare=False, repr=False)
    of_program: bool = False

    @property
    def name(self) -> str:
        """The keys as one text."""
        return self.cause.key

    @property
    def cause(self) -> Cause:
        """The mistakes as the cause of a finding, with the error of attitudes or rates, whichever is larger without them."""
        worst = int(np.argmax(self.plain))
        mistakes = () if self.trial is None else self.trial.mistakes
        remedies = filter(None, (mistake.remedy if self.of_program else mistake.option for mistake in mistakes))
        values = MappingProxyType(self.values)
        return Cause(self.keys, self.sentence, self.left[worst], self.plain[worst], values, "; ".join(remedies))

    def with_intervals(self, case: Compared) -> Explanation:
        """Return the explanation with intervals of the fitted numbers, if its motion is a function of them."""
        trial = self.trial
        motion = None if trial is None or not trial.numbers else trial.build(case)
        if trial is None or motion is None or any(number.name not in self.values for number in trial.numbers):
            return self
        if self.sentence != trial.sentence(self.values):  # it says more than its numbers
            return self
        values = [self.values[number.name] for number in trial.numbers]
        intervals = 2 * case.deviations(motion, np.array([*[0.0] * 6, *values]), INTERVAL)[6:]
        if not np.isfinite(intervals).all():
            return self
        measured = {
            number.name: Measured(x, d)
            for number, x, d in zip(trial.numbers, values, intervals.tolist(), strict=True)
            if d < max(1.0, abs(x))  # the rows do not determine the others
        }
        known = self.values | measured
        return replace(self, values=known, sentence=trial.sentence(known))

    def again(self, case: Compared) -> Explanation | None:
        """Return the explanation of another case by the same mistakes with the same numbers, without any fit.

        None if they make no difference there, or cannot be applied.
        """
        if self.trial is None:
            return None
        if self.trial.anew is not None:
            return self.trial.anew(case)
        motion = self.trial.build(case)
        if motion is None:
            return None
        values = np.array([self.values[number.name] for number in self.trial.numbers])
        R, w = case.evaluate(motion, np.concatenate([np.zeros(6), values])[None])
        made = R[0], w[0]
        if (case.apart(made, case.exact) <= case.allowed).all():
            return None
        return explain(case, self.trial, made, self.values, self.numbers, OWN_SHARE)

    def refit(self, case: Compared) -> Explanation | None:
        """Return the explanation of another case by the same mistakes, whose numbers are fitted to it from these on."""
        if self.trial is None or self.trial.anew is not None:
            return None
        fitted = {number.name for number in self.trial.numbers}
        others = {name: value for name, value in self.values.items() if name not in fitted}
        return attempt(case, self.trial, [self.values[number.name] for number in self.trial.numbers], known=others)


def explain(
    case: Compared,
    trial: Trial,
    made: tuple[Array, Array],
    values: Mapping[str, float] = MappingProxyType({}),
    numbers: int | None = None,
    share: float = 0.0,
) -> Explanation:
    """Return the explanation by the motion that mistakes make; `numbers` counts those that were fitted, by default all.

    `share` is the share of the error that the steps of a program may leave, beside its tolerance.
    """
    plain, error = case.plain.max(axis=1), case.errors(*made)
    rest = case.size(error) / max(case.size(case.plain), 1e-15)
    return Explanation(
        trial.keys,
        trial.sentence(values),
        dict(values),
        error.max(axis=1).tolist(),
        plain.tolist(),
        float(error.max() / max(plain.max(), 1e-15)),
        case.size(error),
        _is_allowed(case, made, error, share * plain) and rest < HALF,
        len(values) if numbers is None else numbers,
        made,
        rest,
        trial,
        case.step is not None,
    )


def _is_allowed(case: Compared, made: tuple[Array, Array], error: Array, more: Array) -> bool:
    """Return whether a mistake may leave errors (2, n).

    A program with a mistake has an error of its steps as well: some tolerances, or errors `more` (2,) that are proportional to
    the step and to the effect of the mistake, such as of damping after each step.
    """
    if case.step is None:
        if any(case.open):
            error = np.where(case.leaves_noise(*made)[:, None], 0.0, error)
        return case.passes(error)
    return bool((error.max(axis=1) <= np.maximum(OWN_ERROR * case.allowed, more)).all())


def attempt(
    case: Compared,
    trial: Trial,
    start: Sequence[float] | None = None,
    small: float = 1e-6,
    most: int = 8,
    known: Mapping[str, float] = MappingProxyType({}),
    ranked: bool = False,
) -> Explanation | None:
    """Return the explanation by a motion whose initial state and other numbers are fitted as far as they are open.

    `start` are the numbers to start with, SI, and `small` is their change for slopes in their units; `most` is the number of
    iterations. Mistakes that explain too little of the first rows are not tried on all. `known` are other numbers of the
    sentence, which `build` has. None if the mistakes cannot be applied, or cannot explain the first rows to first order, which
    is not asked again if the mistakes are `ranked` by it.
    """
    if case.screen is not None:
        explanation = _attempt(case.screen, trial, start, small, most, known, ranked)
        if explanation is None or (not explanation.explains and explanation.rest > HALF):
            return explanation
        start = [explanation.values[number.name] for number in trial.numbers]
    return _attempt(case, trial, start, small, most, known, ranked)


def _attempt(
    case: Compared,
    trial: Trial,
    start: Sequence[float] | None,
    small: float,
    most: int,
    known: Mapping[str, float],
    ranked: bool,
) -> Explanation | None:
    motion = trial.build(case)
    if motion is None:
        return None
    units = np.array([number.size(case.scale) for number in trial.numbers])
    p = np.array([number.start for number in trial.numbers] if start is None else start, float) / units

    def scaled(R: Array, w: Array, p: Array, n: int) -> tuple[Array, Array]:
        return motion(R, w, p * units, n)

    small_changes = np.full(len(p), small)
    if not ranked and not case.may_explain(scaled, p, small_changes):
        return None
    _, p, made = case.change(free=()).fit(scaled, p, small_changes, most)
    error = case.errors(*made)
    near = (error.max(axis=1) <= HOPELESS * np.where(case.open, MOST_NOISE, case.noise) * case.growth).any()
    if case.free and near and not case.passes(error):
        _, p, made = case.fit(scaled, p, small_changes, most)
    names = (number.name for number in trial.numbers)
    return explain(case, trial, made, dict(zip(names, (p * units).tolist(), strict=True)) | dict(known))
