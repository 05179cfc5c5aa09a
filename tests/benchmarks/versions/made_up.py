"""Made-up versions: rows with chosen values, and sides whose times come from a formula."""

import random
from pathlib import Path

from conservative.benchmarks.gate.results import Row
from conservative.benchmarks.versions.comparison import Comparison, Line
from conservative.benchmarks.versions.times import Ratio, TimeRow
from conservative.benchmarks.versions.version import Version
from conservative.outcome import OK
from conservative.references.environments.environment import Environment
from conservative.references.worker.client import EngineCrashed

TIMED = ("brick_flip", "reduced")
STEP = 1e-6
"""Time of a step, s."""


def version(name, *packages, runtime="Python 3.11.7"):
    return Version(name, "", Environment("made-up", name, Path(), runtime, packages))


BASE, HEAD = version("was", "numpy==2.0"), version("is", "numpy==2.0")
VALUES = {
    "attitude error max": 1e-3,
    "rate error max": 1e-3,
    "energy drift max": 2e-16,
    "steps": 600.0,
    "observed order": 2.0,
}


def row(outcome=OK, method="reduced", **changes):
    """Return a row with values; `changes` replace some, and a row with another outcome has none."""
    values = {} if outcome != OK else VALUES | {name.replace("_", " "): value for name, value in changes.items()}
    spreads = dict.fromkeys(values, 0.0)
    return Row(f"brick_flip / {method}", "brick_flip", method, outcome, "", "definition", values, spreads)


def comparison(*lines, base=BASE, head=HEAD):
    """Return a comparison of lines (was, now, time): rows of both versions and their times, each may be None."""
    names = [(was or now).method for was, now, _ in lines if was or now]
    made = [Line("brick_flip", name, (was, now), time) for name, (was, now, time) in zip(names, lines, strict=True)]
    return Comparison((base, head), tuple(made))


def timed(first, again=None, reason=""):
    """Return the times of a row; ratios are (value, low, high)."""
    return TimeRow(STEP, first[0] * STEP, Ratio(*first, 7), Ratio(*again, 7) if again else None, reason)


class Side:
    """A side whose steps take `factor` times as long as usual, and each sample up to `noise` longer.

    In its process number `n` they take `spells(n)` times as long as that; with `crash` it does not survive that process.
    """

    def __init__(self, factor=1.0, noise=0.02, spells=lambda process: 1.0, crash=None):
        self.factor, self.noise, self.spells, self.crash = factor, noise, spells, crash
        self.processes, self._random = 0, random.Random(factor)

    def close(self):
        self.processes += 1

    def timed(self, scene, method, n_steps):
        if self.processes == self.crash:
            raise EngineCrashed("signal 11")
        return Run(self, n_steps)

    def seconds(self, steps):
        return steps * STEP * self.factor * self.spells(self.processes) * (1 + self.noise * self._random.random())


class Run:
    def __init__(self, side, steps):
        self.side, self.steps = side, steps

    def wall_time(self, calls):
        return calls * self.side.seconds(self.steps)
