"""How a run ended, what it cost in work, and what was chosen for it.

An end is a kind out of a fixed list, and the fields that belong to it. Text is made of it only where it is shown.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any


class OutcomeKind(StrEnum):
    """The ways in which a run can end, or not begin."""

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
        Which way.
    reason
        More about it, in words; may be empty.
    step
        Number of the step that failed, from 1.
    time
        Time of the last good state, s.
    residual
        Last size of the residual of a step's equations, or of the correction relative to the unknown; dimensionless.
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

    None means that the method does not have the thing or its engine does not tell.
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
