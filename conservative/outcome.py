"""Outcome of a run, its work counters, progress, and the result of an automatic choice.

An outcome is a kind from a fixed list and the fields that belong to it. It becomes text only for display.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Any


class OutcomeKind(StrEnum):
    """Kind of outcome: a normal end, a failure, or the reason why a run did not start."""

    OK = "ok"
    NOT_CONVERGED = "not converged"
    WRONG_BRANCH = "wrong branch"
    DIVERGED = "diverged"
    NOT_CONSERVED = "not conserved"
    """Orthonormality, or an invariant that the method conserves, exceeded the method's bound."""
    INVALID = "invalid result"
    """The result of a method has the wrong shape, type, times or number of samples."""
    TIMEOUT = "timeout"
    CRASHED = "crashed"
    UNSUPPORTED = "unsupported"
    MISSING = "missing"
    SKIPPED = "skipped"
    FAILED = "failed"
    """In benchmarks only: a test of pytest failed."""
    NO_ORDER = "no order"
    """In studies only: no order of convergence can be fitted to the errors."""


@dataclass(frozen=True)
class Outcome:
    """The outcome of a run.

    Attributes
    ----------
    kind
        Kind of outcome.
    reason
        Details in words; may be empty.
    step
        Number of the step that failed, from 1.
    time
        Time of the last valid state, s.
    residual
        Last residual of a step's equations, or last correction relative to the unknown; dimensionless.
    """

    kind: OutcomeKind
    reason: str = ""
    step: int | None = None
    time: float | None = None
    residual: float | None = None

    @property
    def ok(self) -> bool:
        """True if the run reached its end."""
        return self.kind is OutcomeKind.OK

    def __str__(self) -> str:
        """Return the outcome as text, such as `not converged in step 3 at t = 0.02 s (residual 0.1)`."""
        step = "" if self.step is None else f" in step {self.step}"
        time = "" if self.time is None else f" {'at' if step else 'after'} t = {self.time:g} s"
        residual = "" if self.residual is None else f"residual {self.residual:.3g}"
        why = "; ".join(filter(None, (self.reason, residual)))
        return f"{self.kind}{step}{time}" + (f" ({why})" if why else "")


OK = Outcome(OutcomeKind.OK)
"""The outcome of a successful run."""


@dataclass(frozen=True)
class Counters:
    """Work counters: steps, stages, corrections of the nonlinear solver, evaluations of the right-hand side.

    None means that the method or its engine does not provide the count.
    """

    steps: int
    stages: int | None = None
    iterations: int | None = None
    evaluations: int | None = None


@dataclass(frozen=True)
class Progress:
    """Progress of `integrate(scene, error=...)`. Its text is one line.

    Attributes
    ----------
    elapsed
        Time since the call, s.
    runs
        Number of finished trial runs.
    method, dt, n_steps
        The next `Method`, its step size, s, and its number of steps.
    """

    elapsed: float
    runs: int
    method: Any  # a `Method`, as in `Choice`
    dt: float
    n_steps: int

    def __str__(self) -> str:
        return f"{self.elapsed:.1f} s, {self.runs} trial runs; now {self.method.name}, {self.n_steps} steps of {self.dt:.3g} s"


@dataclass(frozen=True)
class ProgressOfMany:
    """Progress of `integrate_many`. Its text is one line.

    Attributes
    ----------
    elapsed
        Time since the start of the first block, s.
    done, total
        Numbers of finished bodies and of all bodies.
    found
        Number of finished bodies from an earlier run that was resumed.
    """

    elapsed: float
    done: int
    total: int
    found: int = 0

    @property
    def rate(self) -> float:
        """Bodies per second since the start of the first block."""
        return (self.done - self.found) / self.elapsed if self.elapsed > 0 else 0.0

    @property
    def left(self) -> float:
        """Remaining time at this rate, s; infinite if the rate is unknown."""
        return (self.total - self.done) / self.rate if self.rate > 0 else math.inf

    def __str__(self) -> str:
        """Return a line such as `12288 of 100000 bodies in 2.1 s, 5851 a second, 15 s left`."""
        left = f"{self.left:.0f} s left" if self.rate > 0 else "time left unknown"
        return f"{self.done} of {self.total} bodies in {self.elapsed:.1f} s, {self.rate:.4g} a second, {left}"


@dataclass(frozen=True)
class Choice:
    """The result of the automatic choice of `integrate(scene, error=...)`.

    Attributes
    ----------
    method, dt
        The `Method` of the trajectory and its step size, s. The steps of a method with a tolerance have any length; its dt is
        the distance of samples.
    error
        Requested attitude error over the run, rad.
    estimate
        Estimated attitude error over the run, rad, from the same run with twice the step size or a larger tolerance, and one
        from a rounded start.
    attempts
        Step sizes, s, of runs over the whole duration, and their estimates, rad; of runs with a tolerance the distance of
        samples.
    """

    method: Any  # a `Method`; its file imports this one
    dt: float
    error: float
    estimate: float
    attempts: tuple[tuple[float, float], ...]

    @property
    def reached(self) -> bool:
        """True if the estimate is at most the requested error."""
        return self.estimate <= self.error


@dataclass(frozen=True)
class ChoiceForMany(Choice):
    """The result of the automatic choice of `integrate_many(scene, ..., error=...)`; `estimate` is the largest of the examined
    bodies.

    Attributes
    ----------
    bodies
        Number of examined bodies, including the fastest ones. Errors of other bodies may be larger.
    grid
        The `Grid` of all bodies.
    """

    bodies: int = 1
    grid: Any = None  # a `Grid`; its file imports this one
