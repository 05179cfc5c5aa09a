"""The summary of a scene or of random bodies: a sentence, a chart, and a table of classes of methods."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from conservative.benchmarks.contest import Cheapest, Contest, cheapest, costs
from conservative.benchmarks.measures.errors import CONSERVED, SMALL
from conservative.benchmarks.studies.each_step import ERROR
from conservative.benchmarks.studies.step_ladder import SAMPLES
from conservative.outcome import OutcomeKind

from ..document.cells import DASH, factor, number, ratio_text, tolerance
from ..document.model import Cell, Row, Style, Table
from ..rows.names import OF_ENGINES, MethodClass, of_classes, without_outcome
from ..rows.points import first_names, picture
from .scene_contests import EachStep

ERRORS = (1e-3, 1e-6, 1e-9)
"""Attitude errors, rad, at which classes are compared."""
MIDDLE = ERRORS[1]
"""Attitude error, rad, of the sentence, and of the cost at which errors are compared."""
FINE = tuple(10 ** (-quarter / 4) for quarter in range(4, 57))
"""Errors, rad, for the comparison at equal cost."""
MOST = 0.9
"""Share of the bodies on which an error must be reached for a mean to be shown, so that the others bias it little."""
TERMS = (
    "µs of wall time per simulated second at an attitude error, for the fastest method of the class; – if the error was not "
    "reached. Error at equal cost: the error of a class at the cost at which the fastest engine reaches "
    f"{tolerance(MIDDLE)} rad. Conservation over long runs (✓ within {tolerance(CONSERVED)}, ≈ within {tolerance(SMALL)}, "
    "✗ more; relative), for the setting that conserves best."
)
"""Explanation of the table."""
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
    "it, and SciPy's own loop is in Python as well. The numbers show the cost of a single rotation and do not rank these "
    "engines."
)
"""Limits of the comparison."""


@dataclass(frozen=True, eq=False)
class Summary:
    """The summary of a scene or of random bodies: sentence, data of the chart (see `rows.points`), and classes."""

    sentence: str
    points: pd.DataFrame
    classes: Table

    @property
    def shown(self) -> tuple[str, ...]:
        """Families that the chart shows at first."""
        return first_names(self.points)


def of_scene(
    points: pd.DataFrame, drifts: pd.DataFrame, troubles: pd.DataFrame, integrable: bool, each: EachStep | None = None
) -> Summary:
    """Return the summary of a scene from its points, drifts of long runs, failures, and runs with every step stored."""
    reached = costs(points, dict.fromkeys((*ERRORS, *FINE)))
    scene = str(points["scene"].iloc[0]) if len(points) else "This scene"
    failures = {}
    for kind in MethodClass:
        # A formulation that does not support a scene is not a failure of its class.
        failed = troubles[troubles["family"].isin(of_classes(points, kind)["family"])] if len(troubles) else troubles
        outcomes = without_outcome(failed, OutcomeKind.UNSUPPORTED).groupby("outcome", sort=False) if len(failed) else ()
        failures[kind] = "; ".join(f"{name} at some settings: {', '.join(rows['family'].unique())}" for name, rows in outcomes)
    samples = {kind: each.sample_text(kind) for kind in MethodClass} if each else None
    sentence = _sentence(scene, reached[reached["error"] == MIDDLE], integrable)
    return Summary(sentence, picture(points), classes_table(points, reached, drifts, failures, samples))


def classes_table(
    points: pd.DataFrame,
    reached: pd.DataFrame,
    drifts: pd.DataFrame,
    failures: Mapping[MethodClass, str],
    samples: Mapping[MethodClass, str] | None = None,
) -> Table:
    """Return a row for each class of methods; costs are geometric means over the scenes of the points (see `rows.points`).

    `reached` are their costs (see `contest.costs`) at `ERRORS` at least, and `drifts` those of long runs (see
    `measured.long_run_drifts`). Failures are in words. The cost of a sample in each class has a column of its own.
    """
    engines = of_classes(reached[reached["error"] == MIDDLE], *OF_ENGINES)
    budget = engines.groupby("scene")["time"].min()
    header = ["class", "conserves", "error at equal cost", *(f"µs at {tolerance(error)} rad" for error in ERRORS)]
    header += ["µs a sample, every step stored"] * bool(samples) + ["where it fails"]
    rows: list[Row] = []
    for kind in MethodClass:
        members = of_classes(points, kind)
        # A class is judged on the bodies whose field one of its adapters supports.
        families, bodies = members["family"].unique(), members["scene"].nunique()
        sample = [samples[kind]] if samples else []
        if not len(families) and kind == MethodClass.BASELINE:
            continue  # only a full report measures them
        if not len(families):
            missing = "does not support these motions, or was not measured"
            rows.append([kind.value, *[DASH] * (2 + len(ERRORS)), *sample, missing])
            continue
        best = cheapest_of_each(of_classes(reached, kind), "class")
        at_errors = {error: best[best["error"] == error] for error in ERRORS}
        within = best[best["time"] <= best["scene"].map(budget).fillna(0.0) * (1 + 1e-9)].groupby("scene")["error"].min()
        affordable = number(geometric_mean(within), 1) if len(within) else f"over {FINE[0]:g}" if len(budget) else DASH
        missed = {tolerance(error): bodies - len(rows) for error, rows in at_errors.items()} if bodies > 1 else {}
        misses = (f"misses {error} on {count} of {bodies} bodies" for error, count in missed.items() if count)
        rows.append(
            [
                Cell(kind.value, note=", ".join(families)),
                _conserved_text(drifts[drifts["family"].isin(families)]) if len(drifts) else "not measured",
                affordable,
                *(
                    Cell(microseconds(geometric_mean(lines["time"])), note=lines["name"].mode().iloc[0])
                    if len(lines) >= max(1, MOST * bodies)
                    else DASH
                    for lines in at_errors.values()
                ),
                *sample,
                "; ".join(filter(None, [*misses, failures.get(kind, "")])) or "nowhere here",
            ]
        )
    return Table(header, rows, style=Style.CARDS)


def cheapest_of_each(reached: pd.DataFrame, by: str) -> pd.DataFrame:
    """Return the cheapest line of each family, or of each class, for each scene and error."""
    return reached.loc[reached.groupby([by, "scene", "error"], sort=False)["time"].idxmin()]


def geometric_mean(values: pd.Series[float]) -> float:
    """Return the geometric mean."""
    return math.exp(float(np.log(values).mean()))


def _sentence(scene: str, reached: pd.DataFrame, integrable: bool) -> str:
    """Return a sentence on the faster side at `MIDDLE`, without our closed forms, and on the speed of the closed forms."""
    ours, engine = cheapest(of_classes(reached, MethodClass.GENERAL)), cheapest(of_classes(reached, *OF_ENGINES))
    solution = cheapest(of_classes(reached, MethodClass.SOLUTION))
    parts = [f"{scene} {'is integrable' if integrable else 'has fewer than three known invariants'}."]
    goal = f"{tolerance(MIDDLE)} rad"
    if ours and engine:
        first, second = (ours, engine) if ours.time <= engine.time else (engine, ours)
        sides = ["our fastest general integrator", "the fastest engine"][:: 1 if first is ours else -1]
        times = f"{_speedup(first, second)} times as fast as {sides[1]}, {second.name}."
        parts.append(f"{sides[0].capitalize()}, {first.name}, reaches {goal} {times}")
    elif there := ours or engine:
        parts.append(f"Only {there.name} reaches {goal}.")
    else:
        parts.append(f"No measured method reaches {goal}.")
    if solution and engine:
        only = ", which solves integrable motions only"
        if engine.time >= solution.time:
            parts.append(f"{solution.name}{only}, is {_speedup(solution, engine)} times as fast as {engine.name}.")
        else:
            parts.append(f"{engine.name} is {_speedup(engine, solution)} times as fast as {solution.name}{only}.")
    return " ".join(parts)


def _speedup(fast: Cheapest, slow: Cheapest) -> str:
    """Return the ratio of two times, with its interval over processes if there is one."""
    contest = Contest("", MIDDLE, fast, slow)
    return ratio_text(contest.ratio, contest.interval, 2)


def microseconds(time: float) -> str:
    """Return a time, s, as text in µs."""
    return factor(1e6 * time)


def _conserved_text(drifts: pd.DataFrame) -> str:
    """Return the invariants by how well the best setting conserves them; different momenta count as one."""
    rows = drifts.dropna(subset=["value"])
    best = rows.groupby("quantity", sort=False)["value"].min()
    best = best.groupby(best.index.map(lambda name: "momenta" if "moment" in name else name), sort=False).max()
    limits = {"✓": (-1.0, CONSERVED), "≈": (CONSERVED, SMALL), "✗": (SMALL, math.inf)}
    parts = {mark: best.index[(best > low) & (best <= high)] for mark, (low, high) in limits.items()}
    return "; ".join(f"{mark} {', '.join(names)}" for mark, names in parts.items() if len(names)) or "not measured"
