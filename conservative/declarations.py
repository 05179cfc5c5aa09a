"""What a family of methods says about itself, as frozen values on its class: whoever needs to know it asks there."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from enum import StrEnum
from functools import lru_cache, wraps
from typing import Any, NamedTuple

from .version import VERSION


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


def setting_texts(value: Any) -> dict[str, str]:
    """Return the texts of the settings of a frozen value that differ from their defaults, such as `tol=1e-09`, by name."""
    settings = ((field.name, getattr(value, field.name), field.default) for field in fields(value))
    return {name: f"{name}={setting}" for name, setting, default in settings if setting != default}


@lru_cache(maxsize=1024)
def settings_text(value: Any) -> str:
    """Return the settings of a frozen value that differ from their defaults: `tol=1e-09,frame=body`."""
    return ",".join(setting_texts(value).values())


def refuse_time(unsupported: Callable[[Any, Any], str | None]) -> Callable[[Any, Any], str | None]:
    """Return a `Method.unsupported` that refuses potentials which depend on the time, unless the method takes them."""

    @wraps(unsupported)
    def reason(method: Any, scene: Any) -> str | None:
        if getattr(scene.potential, "time_dependent", False) and not method.time_dependent:
            return "it is for fields that do not depend on the time; integrate(scene, error=1e-9) chooses a method for others"
        return unsupported(method, scene)

    return reason


class Maker(NamedTuple):
    """The package that computes, and its version; empty if the package is not an installed one."""

    package: str
    version: str = ""

    def __str__(self) -> str:
        return f"{self.package}=={self.version}" if self.version else self.package


@lru_cache(maxsize=256)
def maker_of(kind: type) -> Maker:
    """Return the package that a class is from."""
    package = kind.__module__.partition(".")[0]
    if package == __package__:
        return Maker(package, VERSION)
    from importlib import metadata

    try:
        return Maker(package, metadata.version(package))
    except metadata.PackageNotFoundError:
        return Maker(package)
