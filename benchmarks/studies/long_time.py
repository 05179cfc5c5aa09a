"""Growth: how energy, momentum and attitude error grow over up to a million turns.

The default setting of each family runs at the scene's step over `TURNS` turns, each run a hundred times as long as the one
before. A run takes at most `LONGEST` s, and less if the study would take more than `TOTAL` s; the last one is then shorter, so
compiled methods reach a million turns and others fewer.

An error is the largest so far: of the relative drift of an invariant, or of the attitude in rad if the motion has a closed
form, which is accurate at any time. The growth p of an error ~ t^p is a fit over the last two decades of time before it is
`SATURATED`: half is a random walk of round-off, 1 linear, 2 quadratic. Times of the lines are in turns.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from conservative.attitude import Array, angle_between
from conservative.grid import Grid
from conservative.invariants import sizes
from conservative.method import Method
from conservative.outcome import Outcome
from conservative.references.exact.method import Exact
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures.measure import Measure, Value
from .case import Case
from .declaration import Declaration, Extent
from .study import Finding, Progress, Study

TURNS = (1e2, 1e4, 1e6)
"""Lengths of the runs, turns at the initial rate."""
SAMPLES = 200
"""Samples of a run; `PER_DECADE` of them in each decade of time are in the lines."""
PER_DECADE = 8
LONGEST, TOTAL = 30.0, 200.0
"""Time budgets, s, of a run and of the study."""
SATURATED = 0.5
"""Attitude error, rad, from which it grows no further."""
ATTITUDE = "attitude"
"""Quantity of the attitude error, in addition to the invariants."""
KINDS = {0.25: "bounded", 0.75: "random walk", 1.5: "linear", math.inf: "quadratic or faster"}
"""Name of a growth, by the largest exponent."""


def exponent(t: Array, error: Array) -> float:
    """Return the slope of log(error) over log(t), each (n,), over the two decades before the error is `SATURATED`, or NaN."""
    t, error = (values[(error > 0) & (error < SATURATED)] for values in (t, error))
    if len(t) < PER_DECADE:
        return math.nan
    last = t >= t[-1] / 100
    return float(np.polyfit(np.log(t[last]), np.log(error[last]), 1)[0])


def families(study: Study) -> tuple[Method, ...]:
    """Return the default setting of each family, or the first one if the study does not have the default."""
    ordered = sorted(study.competitors, key=lambda method: method.name != method.family)
    return tuple({method.family: method for method in reversed(ordered)}.values())[::-1]


def findings(study: Study, progress: Progress) -> Iterator[Finding]:
    """Yield final errors and growth of every family on each scene, the turns that it reached, and lines over time."""
    methods = families(study)
    tell = study.count(progress, len(methods))
    total = TOTAL / 10 if study.quick else TOTAL
    budget = study.time_limit or min(LONGEST, total / len(methods) / len(study.scenes))
    for scene in study.scenes:
        for method in methods:
            tell(f"{scene.name}: {method.name}")
            yield from measure_growth(study, scene, method, budget)


def measure_growth(study: Study, scene: Scene, method: Method, budget: float) -> Iterator[Finding]:
    """Yield the rows and lines of a method on a scene, whose runs take at most `budget` s."""
    turn = 2 * math.pi / float(np.linalg.norm(scene.w_WB_B0))
    case = Case(study.name, scene, method, Grid(scene.dt, 8))
    study.attempt(case)  # a short run first: it may compile
    trajectories: list[Trajectory] = []
    affordable = TURNS[-1]
    for turns in TURNS:
        case = replace(case, grid=grid_of(scene, turn * min(turns, affordable)))
        done = study.attempt(case)
        if isinstance(done, Outcome):
            yield case.row(Value(Measure.TURNS, math.nan), done)
            break
        trajectories.append(done.trajectory)
        if affordable < turns:
            break
        # Rounded to half decades, so that methods share exact solutions.
        affordable = 10 ** (math.floor(2 * math.log10(turns * budget / max(done.cost.first_call, 1e-9))) / 2)
        if affordable <= turns:
            break
    if not trajectories:
        return
    yield case.row(Value(Measure.TURNS, float(trajectories[-1].t[-1]) / turn))
    for quantity, (t, error) in errors(study, trajectories).items():
        power = exponent(t, error)
        kind = next((name for limit, name in KINDS.items() if power <= limit), "")
        measure = Measure.ATTITUDE_MAX if quantity == ATTITUDE else Measure.DRIFT_MAX
        yield case.row(Value(measure, float(error[-1]), quantity * (quantity != ATTITUDE)))
        yield case.row(Value(Measure.GROWTH, power, quantity), detail=kind)
        yield case.samples(quantity, t / turn, error)


def errors(study: Study, trajectories: list[Trajectory]) -> dict[str, tuple[Array, Array]]:
    """Return times (n,), s, with equal ratios and the largest value so far (n,) of each error.

    The trajectories are of the same motion, short to long.
    """
    scene, found = trajectories[0].scene, dict[str, tuple[list[Array], list[Array]]]()
    for number, trajectory in enumerate(trajectories):
        values = {invariant.name: sizes(trajectory.drift(invariant)) for invariant in scene.invariants}
        if Exact().unsupported(scene) is None:
            grid = grid_of(scene, float(trajectory.t[-1]))
            values[ATTITUDE] = angle_between(study.truth(scene, grid).trajectory.R_WB, trajectory.R_WB)
        after = float(trajectories[number - 1].t[-1]) if number else 0.0
        apart = np.floor(np.log10(trajectory.t[1:]) * PER_DECADE)
        chosen = 1 + np.flatnonzero(np.diff(apart, append=np.inf))  # the last sample of each part of a decade
        chosen = chosen[trajectory.t[chosen] > after]
        for quantity, value in values.items():
            t, error = found.setdefault(quantity, ([], []))
            t.append(trajectory.t[chosen])
            error.append(np.maximum.accumulate(value)[chosen])
    return {name: (np.concatenate(t), np.maximum.accumulate(np.concatenate(error))) for name, (t, error) in found.items()}


def grid_of(scene: Scene, duration: float) -> Grid:
    """Return the grid of a run at the scene's step of about this duration, s."""
    every = max(1, round(duration / scene.dt / SAMPLES))
    return Grid(scene.dt, every * SAMPLES, every)


STUDY = Declaration(findings, Extent.FULL, apart=True, timed=True)
