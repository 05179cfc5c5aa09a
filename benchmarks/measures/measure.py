"""All measures, with their texts and units."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum


class Measure(Enum):
    """A measure with its text and unit. A drift also has a quantity, which is a field of its own."""

    ATTITUDE_MAX = "attitude error max", "rad"
    ATTITUDE_FINAL = "attitude error final", "rad"
    ATTITUDE_RMS = "attitude error rms", "rad"
    RATES_MAX = "rate error max", "1"  # relative to the largest rate
    RATES_FINAL = "rate error final", "1"
    POSITION_MAX = "position error max", "m"
    POSITION_FINAL = "position error final", "m"
    DRIFT_MAX = "drift max", "1"
    DRIFT_FINAL = "drift final", "1"
    DRIFT_SLOPE = "drift slope", "1/s"
    DRIFT_SLOPE_STDERR = "drift slope stderr", "1/s"
    ORTHONORMALITY = "orthonormality max", "1"
    STEPS = "steps", "1"
    NEWTON_ITERATIONS = "newton iterations", "1"
    EVALUATIONS = "evaluations", "1"
    ORDER = "observed order", "1"
    ORDER_EXPECTED = "expected order", "1"
    ORDER_STDERR = "observed order stderr", "1"
    ORDER_RATES = "observed order rates", "1"
    ORDER_RATES_STDERR = "observed order rates stderr", "1"
    TIME_PER_STEP = "time per step", "s"
    TIME_PER_STEP_MEDIAN = "time per step median", "s"
    BODY_STEPS = "body-steps per second", "1/s"
    TIME = "time per simulated second", "s/s"
    TIME_DELIVERED = "time per simulated second, final attitude and rates delivered", "s/s"
    TIME_SAMPLED = "time per simulated second, each step kept", "s/s"
    TIME_OWN_LOOP = "time per simulated second, each step kept, engine's own loop", "s/s"
    TIME_MEDIAN = "time per simulated second median", "s/s"
    PREPARE = "prepare time", "s"
    FIRST_CALL = "first call time", "s"
    AGREEMENT = "truth agreement", "rad"
    LONGEST_STEP = "largest |w| dt that works", "rad"
    FAILING_STEP = "first |w| dt that does not", "rad"
    TURNS = "turns in the run", "1"
    GROWTH = "growth exponent", "1"
    """Exponent p of an error that grows with time as t^p: attitude error or drift."""
    TURNS_OVER = "turns over", "1"
    """How often the body turned over (`count_turns_over`)."""
    TURNS_OVER_TRUE = "turns over of the exact motion", "1"
    PRECISION = "precision of numbers", "bit"

    def __init__(self, text: str, unit: str) -> None:
        self.text, self.unit = text, unit

    @classmethod
    def from_text(cls, text: str) -> Measure:
        """Return the measure with this text. Raise `KeyError` if it does not exist."""
        return _BY_TEXT[text]

    def __str__(self) -> str:
        return self.text


_BY_TEXT = {measure.text: measure for measure in Measure}


@dataclass(frozen=True)
class Value:
    """A measure and its value in the unit of the measure; NaN if it could not be measured.

    `quantity` is the name of the invariant of a drift, and otherwise empty.
    """

    measure: Measure
    value: float
    quantity: str = ""

    @property
    def key(self) -> str:
        """Name in tables and in a baseline, such as `energy drift max`."""
        return f"{self.quantity} {self.measure.text}".lstrip()


def blanks(*measures: Measure) -> list[Value]:
    """Return measures without values."""
    return [Value(measure, math.nan) for measure in measures]
