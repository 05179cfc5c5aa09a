"""The summary of a scene or of random bodies: a sentence, a chart, and a table of classes of methods."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.contest import cheapest, costs
from conservative.benchmarks.measures.errors import CONSERVED, SMALL
from conservative.benchmarks.studies.each_step import ERROR
from conservative.benchmarks.studies.step_ladder import SAMPLES
from conservative.outcome import OutcomeKind

from ..document.cells import DASH, factor, number, tolerance
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
HEADER = ("class", "keeps", "error at equal cost", *(f"µs at {tolerance(error)} rad" for error in ERRORS), "where it fails")
SCENE_HEADER = (*HEADER[:-1], "µs a sample, each step kept", HEADER[-1])
"""Header for a scene; random bodies have no study `each_step`."""
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
    f"every step of the scene stored, at {tolerance(ERROR)} rad over all samples: for a run that stores them all as attitude "
    "matrices and rates (for an engine including our conversion of its state, which is a large part for heyoka), and for a run "
    "that stores the final state only, in which a solver can take longer steps."
)
"""Explanation of samples and their cost."""
CAVEAT = (
    "MuJoCo and Pinocchio are made for trees of many bodies. Most of the time of Pinocchio's RK4 is our loop in Python around "
    "it; SciPy's right-hand side is in Python as well. The numbers show the cost of a single rotation and do not rank these "
    "engines."
)
"""Limits of the comparison."""


@dataclass(frozen=True, eq=False)
class Summary:
    """The summary of a scene or of random bodies.

    Attributes
    ----------
    sentence
        The verdict with its ratio.
    points, shown
        Data of the chart (see `families`), and the families that are visible at first.
    classes
        A row for each class of methods.
    """

    sentence: str
    points: pd.DataFrame
    shown: tuple[str, ...]
    classes: Table


def of_scene(
    points: pd.DataFrame, drifts: pd.DataFrame, troubles: pd.DataFrame, integrable: bool, each: EachStep | None = None
) -> Summary:
    """Return the summary of a scene: its points, drifts over long runs, failures (see `overview`), samples at each step."""
    data, reached, fine = picture(points), costs(points, ERRORS), costs(points, FINE)
    scene = str(points["scene"].iloc[0]) if len(points) else "This scene"
    sentence = _sentence(scene, reached[reached["error"] == MIDDLE], integrable)
    engine = cheapest(of_classes(reached[reached["error"] == MIDDLE], *OF_ENGINES))
    budget = engine.time if engine else math.nan
    rows: list[Row] = []
    for kind in MethodClass:
        members = of_classes(points, kind)
        row: Row = [kind.value, *[DASH] * (len(HEADER) - 2), "does not support the scene, or was not measured"]
        if len(members):
            families = members["family"].unique()
            best = [cheapest(of_classes(reached[reached["error"] == error], kind)) for error in ERRORS]
            row = [
                Cell(kind.value, note=", ".join(families)),
                keeps(drifts[drifts["family"].isin(families)]),
                _error_at(of_classes(fine, kind), budget),
                *(Cell(microseconds(found.time), note=found.name) if found else DASH for found in best),
                "; ".join(_failures(troubles[troubles["family"].isin(families)])) or "nowhere here",
            ]
        rows.append(row)
    if each is None or each.kept.empty:  # the report has no study `each_step`
        return Summary(sentence, data, first_names(data), Table(HEADER, rows, style=Style.CARDS))
    rows = [[*row[:-1], _sample(kind, each), row[-1]] for kind, row in zip(MethodClass, rows, strict=True)]
    return Summary(sentence, data, first_names(data), Table(SCENE_HEADER, rows, style=Style.CARDS))


def _sample(kind: MethodClass, each: EachStep) -> str:
    """Return the cost of a sample in a class with every step stored and with the final state only, and the methods."""
    kept, alone = (cheapest(of_classes(found, kind)) for found in (each.kept, each.alone))
    if kept is None or alone is None:
        return DASH
    other = "" if alone.name == kept.name else f" {alone.name}"
    stored, final = (microseconds(found.time * each.interval) for found in (kept, alone))
    return f"{stored} {kept.name}; final state only: {final}{other}"


def _sentence(scene: str, reached: pd.DataFrame, integrable: bool) -> str:
    """Return a sentence on the faster side at `MIDDLE`, without our closed forms, and on the speed of the closed forms."""
    ours, engine = cheapest(of_classes(reached, MethodClass.GENERAL)), cheapest(of_classes(reached, *OF_ENGINES))
    solution = cheapest(of_classes(reached, MethodClass.SOLUTION))
    parts = [f"{scene} {'is integrable, with a closed form' if integrable else 'is not integrable: no closed form is known'}."]
    goal = f"{tolerance(MIDDLE)} rad"
    if ours and engine:
        first, second = (ours, engine) if ours.time <= engine.time else (engine, ours)
        sides = ["our cheapest general integrator", "the cheapest engine"][:: 1 if first is ours else -1]
        times = f"{factor(second.time / first.time)} times as fast as {sides[1]}, {second.name}."
        parts.append(f"{sides[0].capitalize()}, {first.name}, reaches {goal} {times}")
    elif there := ours or engine:
        parts.append(f"Only {there.name} reaches {goal}.")
    else:
        parts.append(f"Nothing measured reaches {goal}.")
    if solution and engine:
        ratio = factor(engine.time / solution.time)
        parts.append(f"{solution.name}, which solves integrable motions only, is {ratio} times as fast as {engine.name} there.")
    return " ".join(parts)


def microseconds(time: float) -> str:
    """Return a time, s, as text in µs."""
    return factor(1e6 * time)


def keeps(drifts: pd.DataFrame) -> str:
    """Return the invariants that the best setting of some methods conserves, and the drifts of the others."""
    rows = drifts.dropna(subset=["value"])
    if rows.empty:
        return "not measured"
    best = rows.groupby("quantity", sort=False)["value"].min()
    best = best.groupby(best.index.map(_kind), sort=False).max()
    marks = [("✓", -1.0, CONSERVED), ("≈", CONSERVED, SMALL), ("✗", SMALL, math.inf)]
    parts = ((mark, [str(name) for name, value in best.items() if low < value <= high]) for mark, low, high in marks)
    return "; ".join(f"{mark} {', '.join(names)}" for mark, names in parts if names)


def _kind(quantity: str) -> str:
    """Return the kind of an invariant in one word: the momentum differs between scenes."""
    return "momenta" if "moment" in quantity else quantity


def _error_at(found: pd.DataFrame, budget: float) -> str:
    """Return the smallest error of `FINE` that a class reaches at a cost, s per simulated second."""
    within = found[found["time"] <= budget * (1 + 1e-9)]["error"]
    return number(float(within.min()), 1) if len(within) else DASH if math.isnan(budget) else f"over {FINE[0]:g}"


def _failures(troubles: pd.DataFrame) -> Iterator[str]:
    """Yield each kind of failure with its families. An unsupported formulation does not count."""
    for outcome, members in without_outcome(troubles, OutcomeKind.UNSUPPORTED).groupby("outcome", sort=False):
        yield f"{outcome} at some settings: {', '.join(members['family'].unique())}"
