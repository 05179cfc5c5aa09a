"""Random bodies: our cheapest general integrator and the cheapest engine on each body, as tables, sentences and chart data."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from conservative.benchmarks.contest import LINE, Cheapest, Ratios, contests, costs
from conservative.benchmarks.studies.random import DECADES
from conservative.benchmarks.studies.studies import RANDOM
from conservative.method import Role as Side
from conservative.outcome import OutcomeKind

from ..charts import figures, vega_embed
from ..document.cells import DASH, factor, finite_or_none, number, tolerance
from ..document.model import Cell, Emphasis, Figure, Grade, Items, Layout, Paragraph, Row, Section, Style, Table, filled
from ..rows.names import OF_ENGINES, MethodClass, display_name, of_classes, without_outcome
from ..rows.points import first_names, joined, points
from .summary import ERRORS, HEADER, MIDDLE, Summary, keeps, microseconds

ANY = "cheapest engine"
"""Stands for all engines: on each body, the cheapest of them."""
MILESTONES = (1e-3, 1e-6, 1e-9, 1e-12)
"""Errors, rad, of the short table."""
MOST = 0.9
"""Share of the bodies on which an error must be reached for a mean to be shown, so that the others bias it little."""
TERMS = (
    "Each body is drawn from a seed: asymmetric, with a condition number of 1.1 to 100, in a rotated frame, with no "
    "point and no rate on an axis, in uniform gravity, on a spring, attracted to a point, or in a gravity gradient, in a "
    "field about as strong as the motion. The ratio is the fastest engine's time divided by that of our fastest general "
    "integrator, each in its fastest form and setting, for whole calls, final state only; above 1 ours is faster. The "
    "error is the largest of twelve instants. The error of a setting is the largest of its own and of all finer "
    "settings, so isolated good results are ignored. A body on which a side does not reach the error is counted and has "
    "no ratio."
)
"""Explanation of the tables."""


@dataclass(frozen=True)
class RandomRatios(Ratios):
    """The ratios of an engine's time to ours at an error in one field; `indices` are those of the bodies, by scene."""

    field: str
    engine: str
    error: float
    indices: dict[str, int]


def _rows(table: pd.DataFrame) -> pd.DataFrame:
    return without_outcome(table[table["study"] == RANDOM], OutcomeKind.UNSUPPORTED)


def ratios(table: pd.DataFrame) -> tuple[RandomRatios, ...]:
    """Return the ratios in named rows of the study: against the cheapest engine, then against each one."""
    rows = _rows(table)
    found = costs(points(rows, RANDOM, untimed=True), DECADES)
    ours, theirs = found[~found["class"].isin(OF_ENGINES)], of_classes(found, *OF_ENGINES)
    taken = rows[rows["role"] == Side.ENGINE]
    engines = list(taken["family"].unique())
    return tuple(
        RandomRatios(contests(ours, side, indices, [error]), str(field), rival, error, indices)
        for rival, members in ({ANY: engines} | {engine: [engine] for engine in engines} if engines else {}).items()
        for side in [theirs[theirs["family"].isin(members)]]
        for field, bodies in rows.groupby("field", sort=False)
        if taken[taken["field"] == field]["family"].isin(members).any()
        for indices in [{str(scene): int(index) for scene, index in zip(bodies["scene"], bodies["body"], strict=True)}]
        for error in DECADES
    )


def section(found: Sequence[RandomRatios], bodies: int, seed: int) -> Section:
    """Return the section of a report from the ratios; `bodies` is their number in each field, `seed` their seed."""
    example = f"`conservative run random_body:field=spring,seed={seed},index=0` runs the first on a spring."
    drawn = f"Not integrable: no closed form is known. Bodies in each field: {bodies}, from seed {seed}; {example}"
    points, figure = chart_points(found), None
    if len(points):
        band = "Line: geometric mean; band: from the worst body to the best; above the dashed line ours is faster."
        picture = figures.random_ratios(points, bodies, seed)
        panels = vega_embed.embed(picture, (), 220)
        title, words = "Random bodies: the cheapest engine's time over ours", f"Bodies in each field: {bodies}. {band}"
        figure = Figure("random_bodies", title, words, picture, panels, layout=Layout.PAIRS)
    blocks = filled(
        Paragraph(drawn),
        Items.of(statements(found)),
        figure,
        as_table(found),
        by_engine(found),
        Paragraph(TERMS, Emphasis.NOTE),
    )
    return Section("Random bodies: what a statement about speed is about", blocks, "random", "Random bodies")


def as_table(found: Iterable[RandomRatios], engine: str = ANY) -> Table:
    """Return the ratios against an engine, a row for each field and error."""
    header = ["field", "error, rad", "bodies", "mean", "worst", "best", "worst body", "ours, most often", "engine, most often"]
    rows = [_ratio_row(each) for each in found if each.engine == engine]
    return Table(header, rows, "Random bodies: the cheapest engine's time over ours", Style.FILTERED)


def _ratio_row(found: RandomRatios) -> list[str | Cell]:
    graded = [grade(value) for value in (found.mean, found.worst, found.best)]
    winners = [_most_often(side) for side in ([each.ours for each in found.both], [each.theirs for each in found.both])]
    worst = str(found.indices[found.both[0].scene]) if found.both else DASH
    return [found.field, tolerance(found.error), count_text(found), *graded, worst, *winners]


def records(found: Iterable[RandomRatios]) -> list[dict[str, Any]]:
    """Return the ratios for JSON: mean with its interval, worst and best, or null."""
    return [
        {
            "field": each.field,
            "engine": each.engine,
            "error": each.error,
            "bodies": len(each.contests),
            "both": len(each.both),
            "only_ours": each.only_ours,
            "only_engine": each.only_theirs,
            **{name: finite_or_none(getattr(each, name)) for name in ("mean", "worst", "best")},
            "mean_interval": list(map(finite_or_none, each.interval)),
            "worst_scene": each.both[0].scene if each.both else None,
        }
        for each in found
    ]


def by_engine(found: Iterable[RandomRatios]) -> Table:
    """Return mean, worst and best ratio at `MILESTONES`, a row for each field and engine that takes it."""
    chosen = [each for each in found if each.engine != ANY and each.error in MILESTONES]
    cells = {(each.field, each.engine, each.error): _spread(each) for each in chosen}
    places = dict.fromkeys((each.field, each.engine) for each in chosen)
    rows = [[*place, *(cells.get((*place, error), DASH) for error in MILESTONES)] for place in places]
    caption = "Random bodies: each engine's time over ours, mean (worst to best)"
    return Table(["field", "engine", *(tolerance(error) for error in MILESTONES)], rows, caption, Style.FILTERED)


def _spread(found: RandomRatios) -> str:
    """Return the mean with the worst and the best, and on how many bodies if that is not all."""
    bodies = f"{len(found.both)} of {len(found.contests)}"
    if not found.both:
        return f"{DASH} ({bodies})"
    counts = "" if len(found.both) == len(found.contests) else f"; {bodies}"
    return f"{ratio_text(found.mean)} ({ratio_text(found.worst)} to {ratio_text(found.best)}{counts})"


def chart_points(found: Iterable[RandomRatios]) -> pd.DataFrame:
    """Return field, error, mean, worst and best against the cheapest engine, where both sides reach the error."""
    rows = [(c.field, c.error, c.mean, c.worst, c.best) for c in found if c.engine == ANY and c.both]
    return pd.DataFrame(rows, columns=["field", "error", "mean", "worst", "best"])


def grade(ratio: float) -> Cell:
    """Return a ratio with a symbol, good from 1 on."""
    if math.isnan(ratio):
        return Cell(DASH, Grade.NONE)
    return Cell(f"{'✓' if ratio >= 1 else '✗'} {ratio_text(ratio)}", Grade.GOOD if ratio >= 1 else Grade.BAD)


def ratio_text(ratio: float) -> str:
    """Return a ratio to two decimals, or to three digits if it is large."""
    return f"{ratio:.2f}" if ratio < 10 else f"{float(f'{ratio:.3g}'):,g}"


def count_text(found: Ratios) -> str:
    """Return the number of bodies on which both sides reach the error, and how many only one or neither reaches."""
    neither = len(found.contests) - len(found.both) - found.only_ours - found.only_theirs
    missing = {"only ours": found.only_ours, "only engine": found.only_theirs, "neither": neither}
    reasons = ", ".join(f"{name} {count}" for name, count in missing.items() if count)
    return f"{len(found.both)} of {len(found.contests)}" + (f" ({reasons})" if reasons else "")


def _most_often(found: Iterable[Cheapest | None]) -> str:
    """Return the line that is the cheapest on most bodies, and on how many if that is not all."""
    counts = Counter(each.name for each in found if each)
    if not counts:
        return DASH
    (name, count), total = counts.most_common(1)[0], counts.total()
    return name if count == total else f"{name} ({count} of {total})"


def statements(found: Iterable[RandomRatios]) -> tuple[str, ...]:
    """Return the results against the cheapest engine, a sentence or two for each field."""
    fields: dict[str, list[RandomRatios]] = {}
    for each in found:
        if each.engine == ANY:
            fields.setdefault(each.field, []).append(each)
    return tuple(f"{field}: {' '.join(_sentences(members))}" for field, members in fields.items())


def _sentences(members: list[RandomRatios]) -> Iterator[str]:
    compared = [each for each in members if each.both]
    if not compared:
        yield "on no body do ours and an engine reach the same error."
        return
    low, high = min(compared, key=lambda c: c.mean), max(compared, key=lambda c: c.mean)
    worst, total = min(compared, key=lambda c: c.worst), sum(len(each.contests) for each in members)
    yield f"over {count_bodies(len(members[0].contests))} the cheapest engine takes, in the geometric mean, {low.mean:.2f}"
    yield f"(at {tolerance(low.error)} rad) to {high.mean:.2f} (at {tolerance(high.error)} rad) times as long as our cheapest"
    yield f"general integrator; on the worst body {worst.worst:.2f} times"
    yield f"(at {tolerance(worst.error)} rad, {worst.both[0].scene})."
    missing = sum(each.only_theirs for each in members)
    if missing:
        yield f"Only an engine reaches the error in {missing} of {total} cases."


def count_bodies(count: int) -> str:
    """Return a number of bodies in words."""
    return "one body" if count == 1 else f"{count} bodies"


def summary(table: pd.DataFrame, found: Sequence[RandomRatios], drifts: pd.DataFrame) -> Summary:
    """Return the summary of named rows of the study, and of their ratios: costs in the geometric mean over bodies.

    `drifts` are those of long runs (see `measured.long_run_drifts`).
    """
    rows = _rows(table)
    bodies = int(rows["scene"].nunique())
    reached = costs(points(rows, RANDOM, untimed=True), DECADES, [*LINE, "version", "series"])
    families = [
        display_name(family, version, "") for family, version in zip(reached["family"], reached["version"], strict=True)
    ]
    reached = reached.assign(line=reached["name"], name=families)
    best = _cheapest(reached, "name")
    data = joined([_means(best.assign(line=best["name"]), "name", bodies), _means(reached, "line", bodies)])
    lines = [_class_row(kind, reached, drifts, bodies) for kind in MethodClass]
    return Summary(sentence(found), data, first_names(data), Table(HEADER, lines, style=Style.CARDS))


def sentence(found: Iterable[RandomRatios]) -> str:
    """Return which side reaches `MIDDLE` faster, in the geometric mean over the bodies of all fields."""
    each = Ratios(tuple(c for part in found if part.engine == ANY and part.error == MIDDLE for c in part.contests))
    if not each.both:
        return "Random bodies: on none do an engine and a method of ours get to the same error."
    sides = ["our cheapest general integrator", "the cheapest engine"][:: 1 if each.mean >= 1 else -1]
    lost = [1 / contest.ratio for contest in each.both if contest.ratio < 1]
    parts = ["geometric mean"]
    if lost:
        parts.append(f"on {len(lost)} of them an engine is faster, by up to {factor(max(lost))} times")
    else:
        parts.append(f"on single ones {factor(each.worst)} to {factor(each.best)}")
    if left := len(each.contests) - len(each.both):
        parts.append(f"on {left} more, not both get there")
    bodies = "one random body" if len(each.both) == 1 else f"{len(each.both)} random bodies"
    times = f"{factor(max(each.mean, 1 / each.mean))} times as fast as {sides[1]} ({'; '.join(parts)})."
    return f"On {bodies} in fields, not integrable, {sides[0]} reaches {tolerance(MIDDLE)} rad {times}"


def _cheapest(reached: pd.DataFrame, by: str) -> pd.DataFrame:
    """Return the cheapest line of each family, or of each class, for each body and error."""
    return reached.loc[reached.groupby([by, "scene", "error"], sort=False)["time"].idxmin()]


def _geometric_mean(values: pd.Series[float]) -> float:
    return math.exp(float(np.log(values).mean()))


def _means(reached: pd.DataFrame, by: str, bodies: int) -> pd.DataFrame:
    """Return the geometric means over bodies as points of a picture, where most bodies have a time."""
    rows = [
        {
            **members.iloc[0][["name", "family", "class", "line"]],
            "single": by == "line",
            "setting": members["series"].mode().iloc[0],
            "error": error,
            "time": _geometric_mean(members["time"]),
            "within": f"{len(members)} of {bodies}",
        }
        for (_, error), members in reached.groupby([by, "error"], sort=False)
        if len(members) >= MOST * bodies
    ]
    return pd.DataFrame(rows).sort_values(by=[by, "error"], ascending=[True, False], kind="stable") if rows else pd.DataFrame()


def _class_row(kind: MethodClass, reached: pd.DataFrame, drifts: pd.DataFrame, bodies: int) -> Row:
    members = of_classes(reached, kind)
    if members.empty:
        absent = "everywhere here: these motions have no closed form" if kind is MethodClass.SOLUTION else "not measured here"
        return [kind.value, *[DASH] * (len(HEADER) - 2), absent]
    best, families = _cheapest(members, "class"), members["family"].unique()
    at_errors = {error: best[best["error"] == error] for error in ERRORS}
    missed = {error: bodies - len(found) for error, found in at_errors.items()}
    reasons = (f"misses {tolerance(error)} on {n} of {bodies} bodies" for error, n in missed.items() if n)
    return [
        Cell(kind.value, note=", ".join(families)),
        keeps(drifts[drifts["family"].isin(families)]),
        _error_at_equal_cost(best, reached),
        *(
            DASH
            if len(found) < MOST * bodies
            else Cell(microseconds(_geometric_mean(found["time"])), note=found["name"].mode().iloc[0])
            for found in at_errors.values()
        ),
        "; ".join(reasons) or "nowhere here",
    ]


def _error_at_equal_cost(best: pd.DataFrame, reached: pd.DataFrame) -> str:
    """Return the geometric mean over bodies of the smallest decade that a class reaches in the cheapest engine's time."""
    engines = of_classes(reached[reached["error"] == MIDDLE], *OF_ENGINES)
    budget = engines.groupby("scene")["time"].min()
    within = best[best["time"] <= best["scene"].map(budget).fillna(0.0) * (1 + 1e-9)]
    smallest = within.groupby("scene")["error"].min()
    return number(_geometric_mean(smallest), 1) if len(smallest) else DASH
