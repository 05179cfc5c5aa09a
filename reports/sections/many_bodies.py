"""The study of throughput: time per body in batches at an error, and ratios of each engine to our methods."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.speed_ratio import SpeedRatio, cheapest, costs
from conservative.benchmarks.studies.throughput import ERRORS, MEDIAN, MOST, STUDY
from conservative.outcome import OutcomeKind

from ..charts import figures, vega_embed
from ..charts.style import families_of
from ..document.cells import DASH, grade_ratio, number, numeric, tolerance
from ..document.model import Cell, Emphasis, Figure, Layout, Paragraph, Row, Section, Style, Table, filled
from ..rows.names import OF_ENGINES, MethodClass, class_of
from ..rows.points import pooled

TERMS = (
    "Heavy tops and free bodies all differ: asymmetric, in rotated frames, no point on an axis, drawn from a seed. One body "
    "is a heavy top with different initial states; numbers=compiled means that its numbers are constants of heyoka's code. "
    "Each runs for 12 s, final state only; a time is the time of a prepared run, without its preparation. A body whose "
    "two reference solutions disagree is dropped. The error of "
    "a setting on a body is its largest attitude error at twelve instants; the table uses the median of the bodies, or "
    "the 95th percentile. Times between two settings of a line are interpolated, and isolated good results are ignored. "
    "Closed forms are a separate class: they take steps of 0.1 s and could take any. Unless stated otherwise, bodies run "
    "together on one thread; `one at a time` is a loop in Python."
)
"""Explanation of the tables."""
LINE = ["scene", "name", "line", "way", "family", "class"]
"""Columns that identify a method in one way of running many bodies; `name` includes the way, `line` does not."""
STATISTICS = (MEDIAN, MOST)
"""Statistics of the errors of bodies, for which ratios are computed."""


def section(table: pd.DataFrame, samples: pd.DataFrame) -> Section:
    """Return the section of a report from named rows of the study (see `names.with_names`); it has no samples."""
    rows = lines(table)
    reached = body_costs(rows)
    figure = None
    points = reached[reached["statistic"] == MEDIAN]
    points = points.rename(columns={"scene": "kind", "bodies": "size"})
    if len(points):
        title = "Many bodies: the cost of one of them"
        summary = "Time per body and simulated second at equal error, against the number of bodies; lower is better."
        picture = figures.body_costs(points)
        panels = vega_embed.embed(picture, ("name", "size", "time"), 240)
        legend = vega_embed.legend(families_of(points), marks=False)
        figure = Figure("many_bodies", title, summary, picture, panels, legend, Layout.PANELS)
    more = Section("Methods that did not run", filled(absent(table)), folded=True)
    compared = as_table(speed_ratios(rows, reached))
    blocks = filled(figure, compared, cost_table(rows, reached), more, Paragraph(TERMS, Emphasis.NOTE))
    return Section("Many bodies", blocks, "many-bodies")


def lines(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the study with a value, with the columns of `LINE`."""
    rows = table[(table["study"] == STUDY.name) & (table["measure"] != Measure.AGREEMENT.text)]
    kinds = [class_of(role, method).value for role, method in zip(rows["role"], rows["method"], strict=True)]
    rows = rows.assign(name=rows["line"].where(rows["way"] == "", rows["line"] + ", " + rows["way"]), **{"class": kinds})
    return rows[rows["value"].notna() | (rows["class"] == MethodClass.SOLUTION)]


def body_costs(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the time per body and simulated second, s: columns of `LINE`, bodies, statistic, error (rad) and time."""
    setting = [*LINE, "method", "dt"]
    values = {measure: rows[rows["measure"] == measure.text] for measure in (Measure.ATTITUDE_MAX, Measure.TIME)}
    errors = values[Measure.ATTITUDE_MAX][[*setting, "quantity", "value"]].dropna()
    errors = errors.rename(columns={"quantity": "statistic", "value": "error"})
    times = pooled(values[Measure.TIME].dropna(subset=["value"]), [*setting, "bodies"])
    sizes = times[[*LINE, "bodies"]].drop_duplicates()  # each setting counts at each size, whether it was timed there or not
    points = errors.merge(sizes, on=LINE).merge(times, how="left", on=[*setting, "bodies"])
    reached = costs(points, ERRORS, [*LINE, "statistic", "bodies"])
    return reached.astype({"bodies": int})


class BatchRatio(NamedTuple):
    """A speed ratio of a class of ours and an engine at a statistic of the errors and a number of bodies.

    The scene of the speed ratio is the kind of the bodies.
    """

    group: MethodClass
    engine: str
    statistic: str
    bodies: int
    speed_ratio: SpeedRatio


def speed_ratios(rows: pd.DataFrame, reached: pd.DataFrame) -> Iterator[BatchRatio]:
    """Yield the speed ratios of each class of ours with each engine.

    Both sides run bodies at once on one thread, or in their only way. The number of bodies is the largest with times of both
    sides, or of either.
    """
    engine = rows["class"].isin(OF_ENGINES)
    plain = rows[(rows["way"] == "") | (engine & (rows["way"] == "one at a time"))]
    for kind, here in plain.groupby("scene", sort=False):
        engines = here[here["class"].isin(OF_ENGINES)]["family"].unique()
        for group in (MethodClass.GENERAL, MethodClass.SOLUTION):
            names = here[here["class"] == group]["name"].unique()
            for rival in engines if len(names) else ():
                theirs = here[(here["family"] == rival) & here["class"].isin(OF_ENGINES)]["name"].unique()
                for statistic in STATISTICS:
                    at = reached[(reached["scene"] == kind) & (reached["statistic"] == statistic)]
                    sides = at[at["name"].isin(names)], at[at["name"].isin(theirs)]
                    timed = here[
                        here["name"].isin([*names, *theirs]) & (here["measure"] == Measure.TIME.text) & here["value"].notna()
                    ]
                    for error in ERRORS:
                        size, speed_ratio = _largest(str(kind), error, sides, timed["bodies"])
                        yield BatchRatio(group, str(rival), statistic, size, speed_ratio)


def _largest(
    kind: str, error: float, sides: tuple[pd.DataFrame, pd.DataFrame], timed: pd.Series[float]
) -> tuple[int, SpeedRatio]:
    """Return the speed ratio among the most bodies at which both sides reach the error; else the one among the fewest."""

    def at(size: int) -> SpeedRatio:
        return SpeedRatio(kind, error, *(cheapest(side[(side["error"] == error) & (side["bodies"] == size)]) for side in sides))

    sizes = sorted(map(int, timed.unique()), reverse=True) or [1]
    size = next((size for size in sizes if at(size).ours and at(size).theirs), sizes[-1])
    return size, at(size)


def as_table(compared: Iterable[BatchRatio]) -> Table:
    """Return the results of `speed_ratios`, a row for each kind, engine and error."""
    header = ["bodies", "our methods", "engine", "error, rad", "at", "number", "engine / ours", "ours, µs", "engine, µs"]
    rows: list[Row] = []
    for group, engine, statistic, bodies, speed_ratio in compared:
        sides = (speed_ratio.ours, speed_ratio.theirs)
        times = [numeric(side.time * 1e6, digits=3) if side else DASH for side in sides]
        names = [side.name if side else "no time" for side in sides]
        error, count = numeric(speed_ratio.error, tolerance(speed_ratio.error)), numeric(bodies, f"{bodies:,}")
        kind = speed_ratio.scene.replace("_", " ")
        ratio = grade_ratio(speed_ratio.ratio, interval=speed_ratio.interval)
        rows.append([kind, group.value, engine, error, statistic, count, ratio, *times, *names])
    return Table([*header, "ours is", "engine is"], rows, "Many bodies: an engine's time divided by ours", Style.FILTERED)


def cost_table(rows: pd.DataFrame, reached: pd.DataFrame) -> Table:
    """Return every line: body-steps per second at best, the least preparation, and the time among most bodies at each error."""
    header = ["bodies", "method", "class", "10^6 body-steps/s, best", "preparation, µs a body, least"]
    header += [f"µs a body and second at {tolerance(error)} rad (number)" for error in ERRORS]
    body = []
    for (kind, name, _, _, _, group), members in rows.groupby(LINE, sort=False):
        rate, prepare = (
            members[members["measure"] == measure.text]["value"] for measure in (Measure.BODY_STEPS, Measure.PREPARE)
        )
        mine = reached[(reached["scene"] == kind) & (reached["name"] == name) & (reached["statistic"] == MEDIAN)]
        values = (float(rate.max()) / 1e6, float(prepare.min()) * 1e6)
        cells: list[str | Cell] = [numeric(value, digits=3) for value in values]
        for error in ERRORS:
            sizes = mine[mine["error"] == error].sort_values("bodies")
            most = sizes.iloc[-1] if len(sizes) else None
            text = DASH if most is None else f"{number(most['time'] * 1e6, 3)} ({most['bodies']:,})"
            cells.append(DASH if most is None else numeric(most["time"], text))
        body.append([str(kind).replace("_", " "), str(name), str(group), *cells])
    return Table(header, body, "Many bodies: the cost of one of them", Style.FILTERED)


def absent(table: pd.DataFrame) -> Table:
    """Return the methods that did not run, and why; sizes omitted for lack of time are not listed, as fewer bodies ran."""
    here = table["study"] == STUDY.name
    failed = table[
        here & ~table["outcome"].isin((OutcomeKind.OK, OutcomeKind.SKIPPED)) & (table["measure"] != Measure.BODY_STEPS.text)
    ]
    grouped = failed.groupby(["scene", "name", "outcome", "reason"], sort=False).size()
    rows = [[str(scene).replace("_", " "), str(name), f"{kind}: {reason}"] for scene, name, kind, reason in grouped.index]
    return Table(["bodies", "method", "reason"], rows, "Many bodies: methods that did not run")
