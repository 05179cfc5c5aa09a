"""What a reader is told of a scene, or of random bodies, first: a sentence, a picture, and a table of classes of methods."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.measures.drift_class import CONSERVED, SMALL
from conservative.benchmarks.studies.each_step import ERROR
from conservative.benchmarks.studies.step_ladder import SAMPLES
from conservative.outcome import OutcomeKind

from .cells import DASH, Row, Table, factor, number, tolerance
from .classes import OF_ENGINES, MethodClass, with_classes
from .each_step import EachStep
from .families import first_names, picture
from .rows import without_outcome
from .work_precision import cost

ERRORS = (1e-3, 1e-6, 1e-9)
"""Attitude errors, rad, that classes are compared at."""
MIDDLE = ERRORS[1]
"""Of the sentence, and of the cost that errors are compared at."""
FINE = tuple(10 ** (-quarter / 4) for quarter in range(4, 57))
"""Errors, rad, that are looked for at a given cost."""
HEADER = ("class", "keeps", "error at equal cost", *(f"µs at {tolerance(error)} rad" for error in ERRORS), "where it fails")
SCENE_HEADER = (*HEADER[:-1], "µs a sample, each step kept", HEADER[-1])
"""Of a scene; random bodies have no study of samples at each step."""
TERMS = (
    "µs of computing per simulated second at an attitude error, by the cheapest of the class; – where none was measured to get "
    "there. Error at equal cost: that of a class at the cost at which the cheapest engine gets to "
    f"{tolerance(MIDDLE)} rad. Kept over long runs (✓ "
    f"within {tolerance(CONSERVED)}, ≈ within {tolerance(SMALL)}, ✗ more; relative), by the setting that keeps it best."
)
"""What the table says, in words."""
SAMPLE_TERMS = (
    f"All methods share the samples that errors are read at: {SAMPLES} in the duration of a scene. A solution's steps "
    "may be as long as they are apart: what it costs per simulated second depends on how many there are. Therefore the "
    f"cost of a sample is told where each of the scene's own steps is one, at {tolerance(ERROR)} rad over all of them: of a "
    "run that keeps them all, as attitude matrices and rates (for an engine with our conversion of its state, which for "
    "heyoka is a large part, so that this says little of heyoka itself), and of one "
    "that keeps the end alone, where a solver need not stop at each."
)
"""What a sample is, and what it costs."""
CAVEAT = (
    "MuJoCo and Pinocchio are general engines, made for trees of many bodies. Most of the time of Pinocchio's RK4 is the loop "
    "in Python around it, which is ours; SciPy's is in Python, too. This says what a rotation costs in them, and ranks none."
)
"""What the comparison is not."""


@dataclass(frozen=True, eq=False)
class Summary:
    """What is told first.

    Attributes
    ----------
    sentence
        The verdict, with its ratio.
    points, shown
        Data of the picture (see `families`), and the names of the families that are shown at first.
    classes
        A row for each class of methods.
    """

    sentence: str
    points: pd.DataFrame
    shown: tuple[str, ...]
    classes: Table


@dataclass(frozen=True)
class Cheapest:
    """The cheapest line of a class at an error: its name, its family, and its time, s per simulated second."""

    name: str
    family: str
    time: float


def of_scene(
    points: pd.DataFrame, drifts: pd.DataFrame, troubles: pd.DataFrame, integrable: bool, each: EachStep | None = None
) -> Summary:
    """Return the summary of a scene: its points, drifts over long runs, failures (see `overview`), samples at each step."""
    found, data = with_classes(points), picture(points)
    rows = [_row(kind, found, drifts, troubles) for kind in MethodClass]
    if each is None or each.kept.empty:  # the report has no study of samples at each step
        return Summary(_sentence(found, integrable), data, first_names(data), (HEADER, rows))
    rows = [[*row[:-1], _sample(kind, each), row[-1]] for kind, row in zip(MethodClass, rows, strict=True)]
    return Summary(_sentence(found, integrable), data, first_names(data), (SCENE_HEADER, rows))


def _sample(kind: MethodClass, each: EachStep) -> str:
    """Return what a sample costs in a class where all are kept, by whom, and where the end alone is kept."""
    kept, alone = (cheapest(points, (kind,), ERROR) if len(points) else None for points in (each.kept, each.alone))
    if kept is None or alone is None:
        return DASH
    other = "" if alone.name == kept.name else f" {alone.name}"
    costs = [microseconds(found.time * each.interval) for found in (kept, alone)]
    return f"{costs[0]} {kept.name}; the end alone: {costs[1]}{other}"


def cheapest(points: pd.DataFrame, classes: tuple[str, ...], error: float) -> Cheapest | None:
    """Return the cheapest line of some classes at an error, rad; None where none gets there."""
    members = points[points["class"].isin(classes)]
    costs = [
        Cheapest(str(name), str(line["family"].iloc[0]), cost(line, error))
        for name, line in members.groupby("name", sort=False)
    ]
    return min((each for each in costs if not math.isnan(each.time)), key=lambda each: each.time, default=None)


def _sentence(points: pd.DataFrame, integrable: bool) -> str:
    """Return which side gets to `MIDDLE` faster, without our solutions of integrable motions, and what those do."""
    ours, engine = cheapest(points, (MethodClass.GENERAL,), MIDDLE), cheapest(points, OF_ENGINES, MIDDLE)
    solution = cheapest(points, (MethodClass.SOLUTION,), MIDDLE)
    scene = str(points["scene"].iloc[0]) if len(points) else "This scene"
    kind = "is integrable, with a closed form" if integrable else "is not integrable: no closed form is known"
    return f"{scene} {kind}. {' '.join(filter(None, [_contest(ours, engine), _solution(solution, engine)]))}"


def _contest(ours: Cheapest | None, engine: Cheapest | None) -> str:
    goal = f"{tolerance(MIDDLE)} rad"
    if ours is None or engine is None:
        there = ours or engine
        return f"Only {there.name} gets to {goal}." if there else f"Nothing measured gets to {goal}."
    ratio = engine.time / ours.time
    first, second = (ours, engine) if ratio >= 1 else (engine, ours)
    ours_first = "Our cheapest general integrator", "the cheapest engine"
    one, other = ours_first if ratio >= 1 else ("The cheapest engine", "our cheapest general integrator")
    return f"{one}, {first.name}, gets to {goal} {factor(max(ratio, 1 / ratio))} times as fast as {other}, {second.name}."


def _solution(solution: Cheapest | None, engine: Cheapest | None) -> str:
    if solution is None or engine is None:
        return ""
    ratio = engine.time / solution.time
    return f"{solution.name}, which solves integrable motions only, is {factor(ratio)} times as fast as {engine.name} there."


def _row(kind: MethodClass, points: pd.DataFrame, drifts: pd.DataFrame, troubles: pd.DataFrame) -> Row:
    members = points[points["class"] == kind]
    if members.empty:
        return [kind.value, *[DASH] * (len(HEADER) - 2), "does not take it, or was not measured"]
    costs = [cheapest(members, (kind,), error) for error in ERRORS]
    budget = cheapest(points, OF_ENGINES, MIDDLE)
    families = set(members["family"])
    return [
        f"{kind.value}: {', '.join(dict.fromkeys(members['family']))}",
        keeps(drifts[drifts["family"].isin(families)]),
        _error_at(members, kind, budget.time if budget else math.nan),
        *(f"{microseconds(each.time)} {each.name}" if each else DASH for each in costs),
        "; ".join(_failures(troubles[troubles["family"].isin(families)])) or "nowhere here",
    ]


def microseconds(time: float) -> str:
    """Return a time, s, in µs as people write it."""
    return factor(1e6 * time)


def keeps(drifts: pd.DataFrame) -> str:
    """Return what the best setting of some methods keeps, and what it does not, with how far that goes."""
    rows = drifts.dropna(subset=["value"])
    if rows.empty:
        return "not measured"
    best = rows.groupby("quantity", sort=False)["value"].min()
    best = best.groupby(best.index.map(_kind), sort=False).max()
    marks = [("✓", -1.0, CONSERVED), ("≈", CONSERVED, SMALL), ("✗", SMALL, math.inf)]
    parts = ((mark, [str(name) for name, value in best.items() if low < value <= high]) for mark, low, high in marks)
    return "; ".join(f"{mark} {', '.join(names)}" for mark, names in parts if names)


def _kind(quantity: str) -> str:
    """Return what an invariant is, in a word: momenta differ by scene."""
    return "momenta" if "moment" in quantity else quantity


def _error_at(points: pd.DataFrame, kind: MethodClass, budget: float) -> str:
    """Return the smallest of `FINE` that a class gets to at a cost, s per simulated second: smaller ones never cost less."""

    def too_dear(error: float) -> bool:
        found = cheapest(points, (kind,), error)
        return found is None or not found.time <= budget * (1 + 1e-9)

    first = bisect_left(FINE, True, key=too_dear)
    return number(FINE[first - 1], 1) if first else DASH if math.isnan(budget) else f"over {FINE[0]:g}"


def _failures(troubles: pd.DataFrame) -> Iterator[str]:
    """Yield each kind of failure with the families whose settings had it; a form that does not take the scene is none."""
    for outcome, members in without_outcome(troubles, OutcomeKind.UNSUPPORTED).groupby("outcome", sort=False):
        yield f"{outcome} at some settings: {', '.join(members['family'].unique())}"
