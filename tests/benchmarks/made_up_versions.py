"""Versions of an engine that nobody measured: observations with chosen figures."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

from conservative.benchmarks.tracking.observation import Fit, Observation, Spread
from conservative.benchmarks.tracking.track import History, Line, Plan
from conservative.outcome import Outcome, OutcomeKind
from conservative.references.environments.environment import Environment

TIMES = (1e-6, 1.02e-6, 1.01e-6)
"""What a step takes, s, on a machine that has little else to do."""


def near(value, relative=0.01):
    """Return a spread about a value."""
    return Spread(value, *sorted((value * (1 - relative), value * (1 + relative))))


GOOD = Observation(
    scene="brick",
    setting="midpoint",
    version="1.0",
    label="made==1.0/midpoint",
    dt=0.01,
    attitude_order=Fit(2.0, 0.01),
    rates_order=Fit(2.01, 0.01),
    error=near(3e-3),
    drifts={"energy": near(2e-13, 0.2), "momentum": near(9e-4)},
)
"""Order 2, energy conserved."""
BAD = replace(
    GOOD,
    attitude_order=Fit(0.99, 0.01),
    rates_order=Fit(0.98, 0.02),
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
"""No end of the run."""


def history(*observations, times=()):
    """Return the history of one setting on one scene: versions 1.0, 2.0 and so on."""
    versions = [f"{number}.0" for number in range(1, len(observations) + 1)]
    environments = tuple(Environment("made", version, Path(), "3.11.7", (f"made=={version}",)) for version in versions)
    seen = tuple(replace(each, version=version) for each, version in zip(observations, versions, strict=True))
    line = Line("brick", "midpoint", seen, dict(zip(versions, times, strict=False)))
    return History(Plan(environments, (), ()), (line,))


def environments(*versions):
    """Return values that have what a plan looks at."""
    return [SimpleNamespace(engine="made", version=version) for version in versions]
