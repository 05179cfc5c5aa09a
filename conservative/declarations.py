"""What a family of methods says about itself, as frozen values on its class: whoever needs to know it asks there."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from enum import StrEnum
from functools import lru_cache, wraps
from typing import Any


class Role(StrEnum):
    """Which side a method is on."""

    OURS = "ours"
    """Compared with the engines in verdicts; its time is gated."""
    ENGINE = "engine"
    """Somebody else's code."""
    TRUTH = "truth"
    """Measured against, never a competitor."""


@dataclass(frozen=True)
class Candidacy:
    """How a family takes part in the automatic choice of a method, `integrate(scene, error=...)`.

    Attributes
    ----------
    rank
        Families are tried in the order of their ranks, those of equal rank in that of their names.
    group
        Of the families of a group only the first that supports the scene is probed; "" for a family outside all groups.
    exact
        Whether there is no truncation error: the first such family that supports the scene is taken, and no other is probed.
    longest
        Longest step that is probed, rad turned at most: at longer ones it does not win, and takes its time.
    """

    rank: int = 10
    group: str = ""
    exact: bool = False
    longest: float = math.inf


@dataclass(frozen=True)
class Cost:
    """What the work of a method costs on one and the same machine, ns: the automatic choice compares nothing but ratios.

    Attributes
    ----------
    step
        Cost of a step besides its corrections.
    correction
        Cost of a correction of the nonlinear solver.
    corrections
        Corrections that a step takes at the least: what is too dear even so is not tried.
    """

    step: float
    correction: float = 0.0
    corrections: float = 1.0

    @property
    def least(self) -> float:
        """Least cost of a step with the number of corrections that it takes at least, ns."""
        return self.step + self.correction * self.corrections


@dataclass(frozen=True)
class SameErrors:
    """The claim that two methods make the same attitude errors at the same steps.

    Attributes
    ----------
    words
        The claim.
    methods
        Names of both, with the settings that are not defaults.
    tolerance
        Difference, relative to the error of the second, up to which two errors are the same.
    free
        Whether the claim is about free bodies only.
    """

    words: str
    methods: tuple[str, str]
    tolerance: float
    free: bool = False


@dataclass(frozen=True)
class BetterEnergy:
    """The claim that a method at its longest step drifts less in energy than another one at its shortest.

    Attributes
    ----------
    words
        The claim, to which a report adds how much longer the step is.
    better, worse
        Names of the methods, with the settings that are not defaults.
    """

    words: str
    better: str
    worse: str


Comparison = SameErrors | BetterEnergy


@dataclass(frozen=True)
class Claims:
    """What somebody claims of a family. `Method.order` and `Method.conserves` say what; this says where, and what else.

    Attributes
    ----------
    source
        Where the claims are made.
    drift_per_step
        Relative drift in each step that conserved quantities may have, where the claim is about the tolerance of an iteration;
        None where it is about round-off.
    comparisons
        Claims about two methods.
    """

    source: str
    drift_per_step: float | None = None
    comparisons: tuple[Comparison, ...] = ()


README = "conservative/README.md, Methods"
"""Source of what this project claims of its own methods."""


@lru_cache(maxsize=1024)
def settings_text(value: Any) -> str:
    """Return the settings of a frozen value that differ from their defaults: `tol=1e-09,frame=body`."""
    settings = ((field.name, getattr(value, field.name), field.default) for field in fields(value))
    return ",".join(f"{name}={setting}" for name, setting, default in settings if setting != default)


def refuse_time(unsupported: Callable[[Any, Any], str | None]) -> Callable[[Any, Any], str | None]:
    """Return a `Method.unsupported` that refuses potentials which depend on the time, unless the method takes them."""

    @wraps(unsupported)
    def reason(method: Any, scene: Any) -> str | None:
        if getattr(scene.potential, "time_dependent", False) and not method.time_dependent:
            return "it is for fields that do not depend on the time; integrate(scene, error=1e-9) chooses a method for others"
        return unsupported(method, scene)

    return reason
