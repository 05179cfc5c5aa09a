"""Made-up versions of an engine: observations with chosen figures."""

from dataclasses import replace
from pathlib import Path

from conservative.benchmarks.measures.change import Range
from conservative.benchmarks.measures.convergence_order import Order
from conservative.benchmarks.versions.comparison import Comparison, Line
from conservative.benchmarks.versions.engine import Observation
from conservative.benchmarks.versions.version import Version
from conservative.outcome import Outcome, OutcomeKind
from conservative.references.environments.environment import Environment

TIMES = (1e-6, 1.02e-6, 1.01e-6)
"""Times of a step, s, on an idle machine."""


def near(value, relative=0.01):
    """Return a spread about a value."""
    return Range(value, *sorted((value * (1 - relative), value * (1 + relative))))


GOOD = Observation(
    scene="brick",
    setting="midpoint",
    version="1.0",
    label="made==1.0/midpoint",
    dt=0.01,
    attitude_order=Order(2.0, 0.01),
    rates_order=Order(2.01, 0.01),
    error=near(3e-3),
    drifts={"energy": near(2e-13, 0.2), "momentum": near(9e-3)},
)
"""Order 2, energy conserved."""
BAD = replace(
    GOOD,
    attitude_order=Order(0.99, 0.01),
    rates_order=Order(0.98, 0.02),
    error=near(2.9),
    drifts={"energy": near(-0.17), "momentum": near(0.09)},
)
"""Order 1, energy lost."""
FAILED = Observation(
    scene="brick",
    setting="midpoint",
    version="1.0",
    label="made==1.0/midpoint",
    dt=0.01,
    outcome=Outcome(OutcomeKind.DIVERGED, "why", time=0.5),
)
"""A run that fails."""


def history(*observations, times=()):
    """Return the comparison of one setting on one scene: versions 1.0, 2.0 and so on."""
    names = [f"{number}.0" for number in range(1, len(observations) + 1)]
    seen = tuple(replace(each, version=name) for each, name in zip(observations, names, strict=True))
    line = Line("brick", "midpoint", seen, dict(zip(names, times, strict=False)))
    return Comparison(tuple(versions(*names)), (line,))


def versions(*names):
    """Return made-up versions of an engine."""
    return [Version(name, "", Environment("made", name, Path(), "Python 3.11.7", (f"made=={name}",))) for name in names]
