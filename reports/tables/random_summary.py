"""The summary of random bodies: costs in the geometric mean over bodies; see `summary` and `random_contests`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from conservative.benchmarks.measures.cost_at_error import cost
from conservative.benchmarks.studies.random import DECADES
from conservative.benchmarks.studies.studies import RANDOM

from ..labels import display_name
from .cells import DASH, Row, factor, number, tolerance
from .classes import OF_ENGINES, MethodClass, class_of
from .families import first_names, joined
from .random_contests import ANY, Contest, Pair, costs
from .summary import ERRORS, HEADER, MIDDLE, Summary, keeps, microseconds

MOST = 0.9
"""Share of the bodies on which an error has to be reached for a mean to be shown: few miss it, so that they bias nothing."""
_LINE = ["family", "name", "class", "series", "line"]


def of_random_bodies(table: pd.DataFrame, contests: Sequence[Contest], drifts: pd.DataFrame) -> Summary:
    """Return the summary of the rows of the study, with names (see `labels.with_names`), and of their contests.

    `drifts` are those of long runs (see `overview.long_run_drifts`).
    """
    found = _costs(table[table["study"] == RANDOM])
    bodies = found["scene"].nunique()
    best = _cheapest(found, "name")
    points = joined([_means(best.assign(line=best["name"]), "name", bodies), _means(found, "line", bodies)])
    rows = [_row(kind, found, drifts, bodies) for kind in MethodClass]
    return Summary(sentence(contests), points, first_names(points), (HEADER, rows))


def sentence(found: Iterable[Contest]) -> str:
    """Return which side gets to `MIDDLE` faster, in the geometric mean over the bodies of all fields."""
    pairs = [pair for contest in found if contest.engine == ANY and contest.error == MIDDLE for pair in contest.pairs]
    both = [pair for pair in pairs if pair.ours and pair.engine]
    if not both:
        return "Random bodies: on none do an engine and a method of ours get to the same error."
    mean = math.exp(float(np.mean([math.log(pair.ratio) for pair in both])))
    sides = ("our cheapest general integrator", "the cheapest engine")
    one, other = sides if mean >= 1 else sides[::-1]
    bodies = "one random body" if len(both) == 1 else f"{len(both)} random bodies"
    times = f"{factor(max(mean, 1 / mean))} times as fast as {other}"
    return (
        f"On {bodies} in fields, not integrable, {one} gets to {tolerance(MIDDLE)} rad {times} ({_spread(both, len(pairs))})."
    )


def _spread(both: list[Pair], bodies: int) -> str:
    """Return what the mean hides: the range over bodies, or how often an engine is faster, and how many bodies are left out."""
    lost = [1 / pair.ratio for pair in both if pair.ratio < 1]
    parts = ["geometric mean"]
    if lost:
        parts.append(f"on {len(lost)} of them an engine is faster, by up to {factor(max(lost))} times")
    else:
        parts.append(f"on single ones {factor(min(p.ratio for p in both))} to {factor(max(p.ratio for p in both))}")
    if bodies > len(both):
        parts.append(f"on {bodies - len(both)} more, not both get there")
    return "; ".join(parts)


def _costs(table: pd.DataFrame) -> pd.DataFrame:
    """Return what each line needs on each body for each of `DECADES`: columns of `_LINE`, scene, error, time."""
    lines = {key: _who(members) for key, members in table.groupby("series", sort=False)}
    rows = [
        {**lines[series], "scene": scene, "error": error, "time": cost(errors, times, error)}
        for (scene, _), members in costs(table, by_family=True).items()
        for series, (errors, times) in members.items()
        for error in DECADES
    ]
    return pd.DataFrame(rows, columns=[*_LINE, "scene", "error", "time"]).dropna(subset=["time"])


def _who(members: pd.DataFrame) -> dict[str, str]:
    first = members.iloc[0]
    kind = class_of(first["role"], first["series"])
    name = display_name(first["family"], first["version"], "")
    return dict(zip(_LINE, (first["family"], name, kind.value, first["series"], first["line"]), strict=True))


def _cheapest(found: pd.DataFrame, by: str) -> pd.DataFrame:
    """Return the cheapest line of each family, or of each class, for each body and error."""
    return found.loc[found.groupby([by, "scene", "error"], sort=False)["time"].idxmin()]


def _means(found: pd.DataFrame, by: str, bodies: int) -> pd.DataFrame:
    """Return the geometric means over bodies as points of a picture, where most bodies have a time."""
    rows = [
        {
            **members.iloc[0][["name", "family", "class", "line"]],
            "single": by == "line",
            "setting": members["series"].mode().iloc[0],
            "error": error,
            "time": math.exp(float(np.log(members["time"]).mean())),
            "within": f"{len(members)} of {bodies}",
        }
        for (_, error), members in found.groupby([by, "error"], sort=False)
        if len(members) >= MOST * bodies
    ]
    return pd.DataFrame(rows).sort_values(by=[by, "error"], ascending=[True, False], kind="stable") if rows else pd.DataFrame()


def _row(kind: MethodClass, found: pd.DataFrame, drifts: pd.DataFrame, bodies: int) -> Row:
    members = found[found["class"] == kind]
    if members.empty:
        absent = "everywhere here: these motions have no closed form" if kind is MethodClass.SOLUTION else "not measured here"
        return [kind.value, *[DASH] * (len(HEADER) - 2), absent]
    best = _cheapest(members, "class")
    families = list(dict.fromkeys(members["family"]))
    return [
        f"{kind.value}: {', '.join(families)}",
        keeps(drifts[drifts["family"].isin(families)]),
        _error_at(best, _budget(found)),
        *(_mean(best[best["error"] == error], bodies) for error in ERRORS),
        _missed(best, bodies),
    ]


def _mean(best: pd.DataFrame, bodies: int) -> str:
    if len(best) < MOST * bodies:
        return DASH
    return f"{microseconds(math.exp(float(np.log(best['time']).mean())))} {best['name'].mode().iloc[0]}"


def _budget(found: pd.DataFrame) -> pd.Series[float]:
    """Return what the cheapest engine needs for `MIDDLE` on each body, s per simulated second."""
    engines = found[found["class"].isin(OF_ENGINES) & (found["error"] == MIDDLE)]
    return engines.groupby("scene")["time"].min()


def _error_at(best: pd.DataFrame, budget: pd.Series[float]) -> str:
    """Return the geometric mean over bodies of the smallest decade that a class gets to at that cost."""
    within = best[best["time"] <= best["scene"].map(budget).fillna(0.0) * (1 + 1e-9)]
    smallest = within.groupby("scene")["error"].min()
    return number(math.exp(float(np.log(smallest).mean())), 1) if len(smallest) else DASH


def _missed(best: pd.DataFrame, bodies: int) -> str:
    """Return on how many bodies each of `ERRORS` is missed."""
    missed = {error: bodies - int((best["error"] == error).sum()) for error in ERRORS}
    return "; ".join(f"misses {tolerance(e)} on {n} of {bodies} bodies" for e, n in missed.items() if n) or "nowhere here"
