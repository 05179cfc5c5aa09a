"""How a run ended, what it cost in work, and what was chosen for it.

An end is a kind out of a fixed list, and the fields that belong to it. Text is made of it only where it is shown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Any


class OutcomeKind(StrEnum):
    """How a run ended, or why it did not start."""

    OK = "ok"
    NOT_CONVERGED = "not converged"
    WRONG_BRANCH = "wrong branch"
    DIVERGED = "diverged"
    NOT_CONSERVED = "not conserved"
    """Orthonormality, or an invariant that the method names, left the bound that the method states."""
    INVALID = "invalid result"
    """What a method gave has the wrong shape, type, times or number of samples."""
    TIMEOUT = "timeout"
    CRASHED = "crashed"
    UNSUPPORTED = "unsupported"
    MISSING = "missing"
    SKIPPED = "skipped"
    NO_ORDER = "no order"
    """Of studies alone, no end of a run: an order of convergence cannot be fitted to the errors."""


@dataclass(frozen=True)
class Outcome:
    """How a run ended.

    Attributes
    ----------
    kind
        Kind of end.
        reason
        Details in words; may be empty.
    step
        Number of the step that failed, from 1.
    time
        Time of the last good state, s.
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
        """Whether the run reached its end."""
        return self.kind is OutcomeKind.OK

    def __str__(self) -> str:
        """Return the outcome as people read it, such as `not converged in step 3 at t = 0.02 s (residual 0.1)`."""
        where = (f" in step {self.step}" if self.step is not None else "") + (
            f" {'at' if self.step is not None else 'after'} t = {self.time:g} s" if self.time is not None else ""
        )
        residual = "" if self.residual is None else f"residual {self.residual:.3g}"
        why = "; ".join(filter(None, (self.reason, residual)))
        return f"{self.kind}{where}" + (f" ({why})" if why else "")


OK = Outcome(OutcomeKind.OK)
"""The outcome of every run that reaches its end."""


@dataclass(frozen=True)
class Counters:
    """Work done: steps, stages solved, corrections of the nonlinear solver, evaluations of the right-hand side.

    None means that the method or its engine does not provide the count.
    """

    steps: int
    stages: int | None = None
    iterations: int | None = None
    evaluations: int | None = None


@dataclass(frozen=True)
class Progress:
    """How far `integrate(scene, error=...)` has got with its trial runs; its text is a line for people.

    Attributes
    ----------
    elapsed
        Time since the call, s.
    runs
        Runs made so far.
    method, dt, n_steps
        The `Method` that runs next, its step, s, and the number of its steps.
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
    """How far `integrate_many` has got; its text is a line for people.

    Attributes
    ----------
    elapsed
        Time since the first block was begun, s.
    done, total
        Bodies that are done, and all bodies.
    found
        How many of those that are done were done before, and are there because a run was resumed.
    """

    elapsed: float
    done: int
    total: int
    found: int = 0

    @property
    def rate(self) -> float:
        """Bodies a second, 1/s, since the first block was begun."""
        return (self.done - self.found) / self.elapsed if self.elapsed > 0 else 0.0

    @property
    def left(self) -> float:
        """Time that the bodies left will take at this rate, s; infinite as long as nothing is known."""
        return (self.total - self.done) / self.rate if self.rate > 0 else math.inf

    def __str__(self) -> str:
        """Return a line such as `12288 of 100000 bodies in 2.1 s, 5851 a second, 15 s left`."""
        left = f"{self.left:.0f} s left" if self.rate > 0 else "time left unknown"
        return f"{self.done} of {self.total} bodies in {self.elapsed:.1f} s, {self.rate:.4g} a second, {left}"


@dataclass(frozen=True)
class Choice:
    """What `integrate(scene, error=...)` chose.

    Attributes
    ----------
    method, dt
        The `Method` that made the trajectory, and its step, s.
    error
        Attitude error asked for over the run, rad.
    estimate
        Estimated attitude error over the run, rad, from the same run at twice the step.
    attempts
        Steps tried on the whole run, s, with the estimate of each, rad.
    """

    method: Any  # a `Method`: naming the type would close a circle, as that file imports this one
    dt: float
    error: float
    estimate: float
    attempts: tuple[tuple[float, float], ...]

    @property
    def reached(self) -> bool:
        """Whether the estimate is within what was asked for."""
        return self.estimate <= self.error


@dataclass(frozen=True)
class ChoiceForMany(Choice):
    """What `integrate_many(scene, ..., error=...)` chose; `estimate` is the largest of those bodies that were looked at.

    Attributes
    ----------
    bodies
        On how many bodies it was estimated, those that turn fastest among them. Others may be further off.
    grid
        The `Grid` of steps that all bodies have.
    """

    bodies: int = 1
    grid: Any = None  # a `Grid`, whose file is above this one
