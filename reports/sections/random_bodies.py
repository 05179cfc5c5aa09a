"""Random bodies: our fastest general integrator and the fastest engine on each body, as tables, a sentence and chart data."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.speed_ratio import LINE, Cheapest, Ratios, costs, speed_ratios
from conservative.benchmarks.studies.random import DECADES, STUDY, TIMES, TYPED, typed_tolerance
from conservative.method import Role
from conservative.outcome import OutcomeKind

from ..charts import figures, vega_embed
from ..document.cells import DASH, bound, factor, grade_ratio, numeric, ratio_text, tolerance
from ..document.model import Cell, Emphasis, Figure, Layout, Paragraph, Row, Section, Style, Table, filled
from ..rows.names import OF_ENGINES, display_name, load_method, of_classes, of_study, with_outcome, without_outcome
from ..rows.points import joined, points
from .summary import MIDDLE, MOST, Summary

ANY = "fastest engine"
"""Stands for all engines: on each body, the fastest of them."""
FEW = 5
"""Smallest number of bodies whose mean has an interval in a sentence."""
MILESTONES = (1e-3, 1e-6, 1e-9, 1e-12)
"""Errors, rad, of the table of engines."""
ROUGH = "All times are of one process, so ratios are rough: two identical programs differ by several percent."
TERMS = (
    "Each body is drawn from a seed: asymmetric, from long and thin to flat, in a rotated frame, with no point and no rate "
    "on an axis, from slow pendulums to fast tops, in uniform gravity, on a spring, attracted to a point, or in a gravity "
    "gradient, which turns with an orbit or is fixed. The ratio is the fastest engine's time divided by the time of our "
    "fastest general integrator, each in its fastest form and setting, for the integration of the motion whose error is "
    "read, final state only; above 1 ours is faster. A user's call is timed, and both sides deliver the attitude and the "
    "rates in body axes. Compiled loops are the same without this: what our kernels and the engine's own calls take. In "
    "parentheses is the interval of 95 %: of a body over processes, of a mean over bodies and processes. A body is won or "
    "lost if 1 is outside of its interval, or if a side is alone in reaching the error; otherwise it is open. The bound of "
    "bodies lost is one-sided, of 95 %, for bodies of this distribution on this machine; ratios on another processor differ "
    "by 10 to 20 %. The error is the largest of twelve instants. The error of a setting is the largest of its own and of "
    "all finer settings, so isolated good results are ignored. An engine is compared on bodies whose field its adapter "
    "supports, and on bodies with two reference solutions that agree."
)
"""Explanation of the tables."""
COMPILED = ("compiled loops, mean", "compiled loops, worst")
"""Columns of the ratios without what a user's call adds."""


@dataclass(frozen=True)
class RandomRatios(Ratios):
    """The ratios of an engine's time to ours at an error in one field; `indices` are the numbers of the bodies, by scene."""

    field: str
    engine: str
    error: float
    indices: dict[str, int]


@dataclass(frozen=True)
class TypedRatios(Ratios):
    """The ratios of the fastest engine's time to ours in one field, both at the same tolerance, whatever errors they reach."""

    field: str
    tolerance: float


def supported_rows(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the study about methods, without those that do not support a field."""
    return without_outcome(of_study(table, STUDY.name), OutcomeKind.UNSUPPORTED)


def ratios(table: pd.DataFrame, time: Measure = TIMES[0]) -> tuple[RandomRatios, ...]:
    """Return the ratios in named rows of the study, of one of `TIMES`: against the fastest engine, then against each one."""
    rows = supported_rows(table)
    reached = costs(points(rows, STUDY.name, time, untimed=True), DECADES)
    ours, theirs = reached[~reached["class"].isin(OF_ENGINES)], of_classes(reached, *OF_ENGINES)
    taken = rows[rows["role"] == Role.ENGINE]
    engines = list(taken["family"].unique())
    results = []
    for rival, members in ({ANY: engines} | {engine: [engine] for engine in engines} if engines else {}).items():
        side = theirs[theirs["family"].isin(members)]
        for field, bodies in taken[taken["family"].isin(members)].groupby("field", sort=False):
            indices = {str(scene): int(index) for scene, index in zip(bodies["scene"], bodies["body"], strict=True)}
            results += [
                RandomRatios(speed_ratios(ours, side, indices, [error]), str(field), rival, error, indices) for error in DECADES
            ]
    return tuple(results)


def typed_ratios(table: pd.DataFrame, time: Measure = TIMES[0]) -> tuple[TypedRatios, ...]:
    """Return the ratios at the tolerances `TYPED` in named rows of the study, of one of `TIMES`.

    Each side has its methods with a tolerance, the fastest of them for each body and tolerance.
    """
    rows = typed_points(table, time)
    ours, theirs = rows[~rows["class"].isin(OF_ENGINES)], of_classes(rows, *OF_ENGINES)
    if not (len(ours) and len(theirs)):
        return ()
    return tuple(
        TypedRatios(speed_ratios(ours, theirs, bodies["scene"].unique(), [typed]), str(field), typed)
        for field, bodies in rows.groupby("field", sort=False)
        for typed in TYPED
        if (bodies["error"] == typed).any()  # a quick study has every second tolerance
    )


def typed_points(table: pd.DataFrame, time: Measure = TIMES[0]) -> pd.DataFrame:
    """Return the timed points of the study at the tolerances `TYPED`.

    The columns are those of `points` and `field`; `error` is the tolerance, and `reached` the error, rad.
    """
    rows = supported_rows(table)
    measured = points(rows, STUDY.name, time)
    tolerances = {name: typed_tolerance(load_method(name)) for name in measured["method"].unique() if load_method(name)}
    measured = measured.assign(
        field=measured["scene"].map(dict(zip(rows["scene"], rows["field"], strict=True))),
        reached=measured["error"],
        error=measured["method"].map(tolerances).astype(float),
    )
    return measured.dropna(subset=["error"]).reset_index(drop=True)


def pooled(ratios: Iterable[Ratios]) -> Ratios:
    """Return the ratios of several groups as one."""
    return Ratios(tuple(speed_ratio for part in ratios for speed_ratio in part.speed_ratios))


def counts(ratios: Iterable[RandomRatios]) -> str:
    """Return in words the cases against the fastest engine that are won, open and lost, and the bound of bodies lost."""
    every = pooled(part for part in ratios if part.engine == ANY)
    if not every.speed_ratios:
        return ""
    numbers = f"Won: {every.won}, open: {every.open}, lost: {every.lost}."
    neither = f" {every.unreached} are reached by neither side." if every.unreached else ""
    return (
        f"Cases (one body at one error): {len(every.speed_ratios)}. {numbers}{neither} The cases are of {every.scenes} bodies, "
        f"so at most {100 * every.share_lost:.2g} % of such bodies have a lost case (95 % confidence)."
    )


def truths(table: pd.DataFrame) -> str:
    """Return in words how well the two reference solutions agree, and on how many bodies they do not."""
    rows = table[(table["study"] == STUDY.name) & (table["measure"] == Measure.AGREEMENT.text)]
    good = with_outcome(rows, OutcomeKind.OK)
    if not len(good):
        return "No body has two reference solutions that agree."
    dropped = f" They differ by more on {len(rows) - len(good)}, which are not compared." if len(rows) > len(good) else ""
    return f"Two reference solutions agree within {bound(good['value'].max(), 1)} rad on {len(good)} bodies.{dropped}"


def section(
    ratios: Sequence[RandomRatios],
    bodies: int,
    seed: int,
    about: str = "",
    compiled: Sequence[RandomRatios] = (),
    typed: Sequence[Sequence[TypedRatios]] = ((), ()),
) -> Section:
    """Return the section of a report from the ratios; `bodies` is their number in each field, `seed` their seed.

    `about` is the sentence of `truths`. `compiled` and the second of `typed` have the ratios of the compiled loops.
    """
    example = f"`conservative run random_body:field=spring,seed={seed},index=0` runs the first on a spring."
    drawn = f"Our closed forms do not solve these motions. Bodies in each field: {bodies}, from seed {seed}; {example}"
    terms = Paragraph(TERMS, Emphasis.NOTE)
    blocks = filled(
        Paragraph(f"{drawn} {about} {counts(ratios)}"),
        figure(ratios, bodies, seed),
        as_table(ratios, compiled),
        typed_table(*typed),
        by_engine(ratios),
        terms,
    )
    return Section("Random bodies", blocks, "random", "Random bodies", source={"study": STUDY.name})


def figure(ratios: Sequence[RandomRatios], bodies: int, seed: int) -> Figure | None:
    """Return the figure of the ratios; None without any. For `bodies` and `seed` see `section`."""
    points = chart_points(ratios)
    if not len(points):
        return None
    picture = figures.random_ratios(points, bodies, seed)
    text = (
        f"Bodies in each field: {bodies}. Line: geometric mean; band: from the worst body to the best; above the dashed "
        "line ours is faster."
    )
    title = "Random bodies: the fastest engine's time divided by ours"
    return Figure("random_bodies", title, text, picture, vega_embed.embed(picture, (), 220), layout=Layout.PAIRS)


def as_table(ratios: Iterable[RandomRatios], compiled: Iterable[RandomRatios] = ()) -> Table:
    """Return the ratios against the fastest engine, a row for each field and error.

    If there are ratios of the `compiled` loops, their mean and worst are the last columns.
    """
    loops = {(part.field, part.error): part for part in compiled if part.engine == ANY}
    header = ["field", "error, rad", "bodies", "won", "open", "lost", "mean", "worst", "best", "worst body"]
    header += ["ours, most often", "engine, most often", *(COMPILED if loops else [])]
    rows: list[Row] = [
        [
            ratio.field,
            numeric(ratio.error, tolerance(ratio.error)),
            count_text(ratio),
            *(numeric(count, str(count)) for count in (ratio.won, ratio.open, ratio.lost)),
            grade_ratio(ratio.ratio, interval=ratio.interval),
            *(grade_ratio(body.ratio, interval=body.interval) for body in (*ratio.both[:1], *ratio.both[-1:])),
            *([] if ratio.both else [DASH, DASH]),
            str(ratio.indices[ratio.both[0].scene]) if ratio.both else DASH,
            _most_often(speed_ratio.ours for speed_ratio in ratio.both),
            _most_often(speed_ratio.theirs for speed_ratio in ratio.both),
            *(_mean_and_worst(loops[ratio.field, ratio.error]) if loops else []),
        ]
        for ratio in ratios
        if ratio.engine == ANY
    ]
    return Table(header, rows, "Random bodies: the fastest engine's time divided by ours", Style.FILTERED)


def _mean_and_worst(ratios: Ratios) -> list[Cell]:
    return [grade_ratio(ratios.ratio, interval=ratios.interval), grade_ratio(ratios.worst)]


def typed_table(typed: Sequence[TypedRatios], compiled: Sequence[TypedRatios] = ()) -> Table | None:
    """Return the ratios at the same tolerance, a row for each field and tolerance; the last columns are of `compiled` loops."""
    if not typed:
        return None
    loops = {(part.field, part.tolerance): part for part in compiled}
    header = ["field", "tolerance", "bodies", "won", "open", "lost", "mean", "worst", "best", "engine, most often"]
    rows: list[Row] = [
        [
            part.field,
            numeric(part.tolerance, tolerance(part.tolerance)),
            count_text(part),
            *(numeric(count, str(count)) for count in (part.won, part.open, part.lost)),
            *_mean_and_worst(part),
            grade_ratio(part.best),
            _most_often(speed_ratio.theirs for speed_ratio in part.both),
            *(_mean_and_worst(loops[part.field, part.tolerance]) if loops else []),
        ]
        for part in typed
    ]
    caption = "Random bodies: the fastest engine's time divided by ours, both at the same tolerance"
    return Table([*header, *(COMPILED if loops else [])], rows, caption, Style.FILTERED)


def _most_often(lines: Iterable[Cheapest | None]) -> str:
    """Return the line that is the fastest on most bodies, and on how many if that is not all."""
    counts = Counter(line.name for line in lines if line)
    if not counts:
        return DASH
    (name, count), total = counts.most_common(1)[0], counts.total()
    return name if count == total else f"{name} ({count} of {total})"


def by_engine(ratios: Iterable[RandomRatios]) -> Table:
    """Return the mean ratio with its interval at `MILESTONES`, a row for each field and engine that supports it."""
    chosen = {(ratio.field, ratio.engine, ratio.error): ratio for ratio in ratios if ratio.engine != ANY}
    places = dict.fromkeys(key[:2] for key in chosen)
    rows: list[Row] = [[*place, *(_mean(chosen[*place, error]) for error in MILESTONES)] for place in places]
    caption = "Random bodies: each engine's time divided by ours, geometric mean (interval of 95 %)"
    return Table(["field", "engine", *(tolerance(error) for error in MILESTONES)], rows, caption, Style.FILTERED)


def _mean(ratios: RandomRatios) -> Cell:
    """Return the mean with its interval, and on how many bodies both sides reach the error if that is not all."""
    both, bodies = len(ratios.both), len(ratios.speed_ratios)
    counts = "" if both == bodies else f", {both} of {bodies} bodies"
    return numeric(ratios.ratio, ratio_text(ratios.ratio, ratios.interval) + counts)


def records(ratios: Iterable[RandomRatios]) -> list[dict[str, Any]]:
    """Return the ratios for JSON: mean with its interval, worst and best, NaN if no body has a ratio."""
    return [
        {
            **{name: getattr(ratio, name) for name in ("field", "engine", "error", "only_ours", "won", "open", "lost")},
            "bodies": len(ratio.speed_ratios),
            "both": len(ratio.both),
            "only_engine": ratio.only_theirs,
            **{"mean": ratio.ratio, "worst": ratio.worst, "best": ratio.best, "mean_interval": ratio.interval},
            "worst_scene": ratio.both[0].scene if ratio.both else None,
        }
        for ratio in ratios
    ]


def typed_records(typed: Iterable[TypedRatios]) -> list[dict[str, Any]]:
    """Return the ratios at the same tolerance for JSON."""
    names = ("field", "tolerance", "won", "open", "lost")
    return [
        {name: getattr(part, name) for name in names}
        | {"both": len(part.both), "mean": part.ratio, "mean_interval": part.interval, "worst": part.worst, "best": part.best}
        for part in typed
    ]


def chart_points(ratios: Iterable[RandomRatios]) -> pd.DataFrame:
    """Return field, error, mean, worst and best against the fastest engine, where both sides reach the error."""
    rows = [
        (ratio.field, ratio.error, ratio.ratio, ratio.worst, ratio.best)
        for ratio in ratios
        if ratio.engine == ANY and ratio.both
    ]
    return pd.DataFrame(rows, columns=["field", "error", "mean", "worst", "best"])


def count_text(ratios: Ratios) -> str:
    """Return the number of bodies on which both sides reach the error, and how many only one or neither reaches."""
    neither = len(ratios.speed_ratios) - len(ratios.both) - ratios.only_ours - ratios.only_theirs
    missing = {"only ours": ratios.only_ours, "only engine": ratios.only_theirs, "neither": neither}
    reasons = ", ".join(f"{name} {count}" for name, count in missing.items() if count)
    return f"{len(ratios.both)} of {len(ratios.speed_ratios)}" + (f" ({reasons})" if reasons else "")


def summary(table: pd.DataFrame, ratios: Sequence[RandomRatios]) -> Summary:
    """Return the summary of named rows of the study and their ratios."""
    measured = points(supported_rows(table), STUDY.name, TIMES[0], untimed=True)
    reached = costs(measured, DECADES, [*LINE, "version", "series"])
    families = map(display_name, reached["family"], reached["version"], [""] * len(reached))
    reached = reached.assign(name=list(families))
    best = reached.loc[reached.groupby(["name", "scene", "error"], sort=False)["time"].idxmin()]
    return Summary(sentence(ratios), joined([_means(best, measured["scene"].nunique())]))


def _means(reached: pd.DataFrame, bodies: int) -> pd.DataFrame:
    """Return the geometric means over bodies as points of a chart, where most bodies have a time."""
    rows = [
        {
            **members.iloc[0][["name", "family", "class"]],
            "setting": members["series"].mode().iloc[0],
            "error": error,
            "time": math.exp(float(np.log(members["time"]).mean())),
            "within": f"{len(members)} of {bodies}",
        }
        for (_, error), members in reached.groupby(["name", "error"], sort=False)
        if len(members) >= MOST * bodies
    ]
    return (
        pd.DataFrame(rows).sort_values(by=["name", "error"], ascending=[True, False], kind="stable") if rows else pd.DataFrame()
    )


def sentence(ratios: Iterable[RandomRatios]) -> str:
    """Return the side that reaches `MIDDLE` faster, in the geometric mean over the bodies of all fields."""
    pooled = Ratios(tuple(c for part in ratios if part.engine == ANY and part.error == MIDDLE for c in part.speed_ratios))
    goal = f"{tolerance(MIDDLE)} rad"
    if not pooled.both:
        return f"On no random body do our integrators and an engine both reach {goal}."
    sides = ["our fastest general integrator", "the fastest engine or solver"][:: 1 if pooled.ratio >= 1 else -1]
    low, high = pooled.interval if len(pooled.both) >= FEW else (math.nan, math.nan)
    ends = sorted((low, high) if pooled.ratio >= 1 else (1 / low, 1 / high)) if not math.isnan(low) else []
    parts = ["geometric mean", *([f"interval {' to '.join(map(factor, ends))}"] if ends else [])]
    if slower := [1 / speed_ratio.ratio for speed_ratio in pooled.both if speed_ratio.lost]:
        parts.append(f"an engine or solver is faster on {len(slower)}, by up to {factor(max(slower))} times")
    else:
        parts.append(f"single bodies: {factor(pooled.worst)} to {factor(pooled.best)}")
    if pooled.open:
        parts.append(f"{pooled.open} undecided")
    if missed := len(pooled.speed_ratios) - len(pooled.both):
        parts.append(f"{missed} more are not reached by both")
    bodies = "one random body" if len(pooled.both) == 1 else f"{len(pooled.both)} random bodies"
    times = f"{factor(max(pooled.ratio, 1 / pooled.ratio))} times as fast as {sides[1]} ({'; '.join(parts)})."
    return f"On {bodies} in fields, {sides[0]} reaches {goal} {times}"
