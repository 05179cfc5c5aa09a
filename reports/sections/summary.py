"""The summary of a scene or of random bodies: a sentence, and the points of a chart."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.speed_ratio import Cheapest, SpeedRatio, cheapest, costs
from conservative.benchmarks.studies.each_step import ERROR
from conservative.benchmarks.studies.step_ladder import SAMPLES

from ..document.cells import ratio_text, tolerance
from ..rows.names import OF_ENGINES, MethodClass, of_classes
from ..rows.points import picture

ERRORS = (1e-3, 1e-6, 1e-9)
"""Attitude errors, rad, at which classes are compared."""
MIDDLE = ERRORS[1]
"""Attitude error, rad, of the sentence, and of the cost at which errors are compared."""
MOST = 0.9
"""Share of the bodies on which an error must be reached for a mean to be shown, so that the others bias it little."""
SAMPLE_TERMS = (
    f"All methods have the same {SAMPLES} samples in the duration of a scene. An exact solution can take one step from sample "
    "to sample, so its cost per simulated second depends on their number. The cost of a sample is therefore measured with "
    f"every step of the scene stored, at {tolerance(ERROR)} rad over all samples: for a run that stores attitude matrices and "
    "rates at every step (for an engine with and without the conversion of its states), and for a run that stores the final "
    "state only, in which a solver can take longer steps."
)
"""Explanation of samples and their cost."""
CAVEAT = (
    "MuJoCo and Pinocchio are made for trees of many bodies. Most of the time of Pinocchio's RK4 is our loop in Python around "
    "it, and most of the time of SciPy's compiled loops is calls of the equations through Python. The numbers show the cost of "
    "a single rotation and do not rank these engines. heyoka integrates the equations that it is given: `body` has the usual "
    "ones, `lean` the fastest that we found."
)
"""Limits of the comparison."""


@dataclass(frozen=True, eq=False)
class Summary:
    """The summary of a scene or of random bodies: a sentence, and the data of the chart (see `rows.points`)."""

    sentence: str
    points: pd.DataFrame


def of_scene(points: pd.DataFrame, integrable: bool) -> Summary:
    """Return the summary of a scene from its points."""
    measured = len(points) > 0
    scene = str(points["scene"].iloc[0]) if measured else "This scene"
    return Summary(_sentence(scene, costs(points, [MIDDLE]), integrable, measured), picture(points))


def _sentence(scene: str, reached: pd.DataFrame, integrable: bool, measured: bool) -> str:
    """Return a sentence on the faster side at `MIDDLE`, without our closed forms, and on the speed of the closed forms."""
    ours, engine = cheapest(of_classes(reached, MethodClass.GENERAL)), cheapest(of_classes(reached, *OF_ENGINES))
    solution = cheapest(of_classes(reached, MethodClass.SOLUTION))
    parts = [f"{scene} {'is integrable' if integrable else 'has fewer than three known invariants'}."]
    goal = f"{tolerance(MIDDLE)} rad"
    if ours and engine:
        first, second = (ours, engine) if ours.time <= engine.time else (engine, ours)
        sides = ["our fastest general integrator", "the fastest engine or solver"][:: 1 if first is ours else -1]
        times = f"{_speedup(first, second)} times as fast as {sides[1]}, {second.name}."
        parts.append(f"{sides[0].capitalize()}, {first.name}, reaches {goal} {times}")
    elif ours:
        parts.append(f"Our fastest general integrator, {ours.name}, reaches {goal}; no timed run of an engine or solver does.")
    elif engine:
        none = "no timed run of our general integrators does"
        parts.append(f"The fastest engine or solver, {engine.name}, reaches {goal}; {none}.")
    else:
        parts.append(f"No timed run reaches {goal}." if measured else "No time was measured against an error.")
    if solution and engine:
        only = ", which solves integrable motions only"
        if engine.time >= solution.time:
            parts.append(f"{solution.name}{only}, is {_speedup(solution, engine)} times as fast as {engine.name}.")
        else:
            parts.append(f"{engine.name} is {_speedup(engine, solution)} times as fast as {solution.name}{only}.")
    return " ".join(parts)


def _speedup(fast: Cheapest, slow: Cheapest) -> str:
    """Return the ratio of two times, with its interval over processes if there is one."""
    speed_ratio = SpeedRatio("", MIDDLE, fast, slow)
    return ratio_text(speed_ratio.ratio, speed_ratio.interval, 2)
