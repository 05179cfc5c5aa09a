"""Versions that nobody installed: rows with chosen values, and sides whose times come from a formula."""

import random
from pathlib import Path

from conservative.benchmarks.comparison.compare import Found, Place
from conservative.benchmarks.comparison.times import Ratio, Timed, TimeRow
from conservative.benchmarks.comparison.version import Version
from conservative.benchmarks.gate.results import Row, Status
from conservative.benchmarks.studies.study import Truths
from conservative.references.environments.environment import Environment
from conservative.references.worker.client import EngineCrashed
from conservative.registry import scene

PLACE = Place("brick_flip", scene("brick_flip"), "definition", Truths())
TIMED = Timed("brick_flip / reduced", "brick_flip", "reduced", PLACE.scene.dt)
STEP = 1e-6
"""Time of a step, s."""


def version(name, *packages, python="3.11.7"):
    return Version(name, "", Environment("made-up", name, Path(), python, packages))


BASE, HEAD = version("was", "numpy==2.0"), version("is", "numpy==2.0")
VALUES = {
    "attitude error max": 1e-3,
    "rate error max": 1e-3,
    "energy drift max": 2e-16,
    "steps": 600.0,
    "observed order": 2.0,
}


def found(reason="", **changes):
    """A row with values, some of which differ; with a status of its own it has none."""
    status = changes.pop("status", Status.PASSED)
    values = {} if reason else VALUES | {name.replace("_", " "): value for name, value in changes.items()}
    row = Row(TIMED.id, "brick_flip", "reduced", status, "", "definition", values, dict.fromkeys(values, 0.0))
    return Found(row, reason)


def timed(first, again=None, reason=""):
    """What was found of times: ratios as (value, low, high)."""
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

    def timed(self, scene, method, dt, n_steps):
        if self.processes == self.crash:
            raise EngineCrashed("signal 11")
        return Run(self, n_steps)

    def seconds(self, steps):
        return steps * STEP * self.factor * self.spells(self.processes) * (1 + self.noise * self._random.random())


class Run:
    def __init__(self, side, steps):
        self.side, self.steps = side, steps

    def __call__(self):
        return None

    def wall_time(self, calls):
        return calls * self.side.seconds(self.steps)
