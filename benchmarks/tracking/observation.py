"""What is seen of one version of an engine, with one setting, on one scene."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from conservative.outcome import OK, Outcome


@dataclass(frozen=True)
class Spread:
    """A value, and the smallest and the largest that it has when something changes that should not matter.

    For errors (rad) and drifts (relative) that is one or two steps more in the run; for times (s) it is measuring again.
    """

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Iterable[float]) -> Spread:
        """Return the spread of values, of which the first is the one that counts; nan are passed over."""
        first, *rest = values
        known = [value for value in (first, *rest) if not math.isnan(value)] or [math.nan]
        return cls(first, min(known), max(known))

    @property
    def sizes(self) -> tuple[float, float]:
        """The smallest and the largest size that it has, whatever its sign."""
        ends = sorted((abs(self.low), abs(self.high)))
        return (0.0 if self.low < 0 < self.high else ends[0]), ends[1]


NOTHING = Spread(math.nan, math.nan, math.nan)
"""The spread of what could not be measured."""


@dataclass(frozen=True)
class Fit:
    """An order of convergence: its slope and the standard error of that, nan where there is none for a reason."""

    slope: float = math.nan
    stderr: float = math.nan
    reason: str = ""


@dataclass(frozen=True)
class Point:
    """Largest errors at a step dt, s, of attitude, rad, and of rates, relative; nan where the run did not reach its end.

    `reached` is False where there was no time for the run, which says nothing of the version.
    """

    dt: float
    attitude: float
    rates: float
    reached: bool = True


@dataclass(frozen=True, kw_only=True)
class Observation:
    """What is seen of one version of an engine, with one setting, on one scene.

    Attributes
    ----------
    scene, setting, version, label
        What it is of; setting and label as the method has them.
    dt
        Step, s, of everything but the orders.
    outcome
        How the run ended.
    points
        Errors at shorter and shorter steps; none of a method whose accuracy does not depend on a step.
    attitude_order, rates_order
        Orders that the errors show, over the steps that all versions have.
    error
        Largest attitude error, rad.
    drifts
        Largest change of each invariant, relative, by its name; of one that is no vector with its sign.
    """

    scene: str
    setting: str
    version: str
    label: str
    dt: float
    outcome: Outcome = OK
    points: tuple[Point, ...] = ()
    attitude_order: Fit = Fit()
    rates_order: Fit = Fit()
    error: Spread = NOTHING
    drifts: Mapping[str, Spread] = field(default_factory=dict)
