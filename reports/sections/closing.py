"""A row per method: the end of `conservative report` on the terminal, and the table for a paper."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.speed_ratio import costs
from conservative.benchmarks.studies import convergence, paper, speed
from conservative.method import Role
from conservative.outcome import Outcome
from conservative.scene import Scene

from ..document.cells import DASH, angle, bound, factor, number, outcome_cell, tolerance
from ..document.model import Row, Table
from ..rows import lines
from ..rows.names import ABSENT, at_own_step, display_name, largest_drifts, of_measure, of_study, outcomes, without_outcome
from .summary import MIDDLE

HEADER = ("attitude", "order", "µs/step", f"µs at {tolerance(MIDDLE)}")
LEGEND = (
    "energy, momenta: largest relative drift; attitude: largest error, rad; all at the scene's own step, or at the default "
    f"tolerance, and rounded up. order: measured order of convergence, standard error at most {lines.SURE:g}. µs at "
    f"{tolerance(MIDDLE)}: wall time per simulated second at this attitude error, rad. {DASH}: not measurable, or not reached."
)


@dataclass(frozen=True)
class Line:
    """A method with a setting on a scene, and how its run at the scene's own step ended.

    Attributes: `drifts`, the largest of each invariant, relative; `error`, the largest attitude error, rad; `order`, measured;
    `time_per_step` and `time_per_second`, the wall time per step and per simulated second, s; `reached`, the wall time per
    simulated second at the attitude error `MIDDLE`, s. All are NaN if they were not measured.
    """

    name: str
    family: str
    outcome: Outcome
    drifts: dict[str, float]
    error: float
    order: float
    time_per_step: float
    time_per_second: float
    reached: float


def scene_lines(table: pd.DataFrame, points: pd.DataFrame, scene: Scene, named: bool = False) -> Iterator[Line]:
    """Yield a line for each method on a scene, in the order of measurement.

    The table comes from `names.with_names`; the points belong to the scene (see `rows.points`). If the methods were `named`,
    each has a line, even if it does not support the scene or is not installed. Otherwise such methods have none, and methods
    that differ only in tolerance are one line, with the drifts and errors of the default tolerance, which is the last.
    """
    accuracy = of_study(table, paper.STUDY.name, scene.name)
    accuracy = accuracy[accuracy["role"] != Role.TRUTH.value]
    accuracy = accuracy if named else without_outcome(accuracy, *ABSENT)
    accuracy = at_own_step(accuracy)
    reached = costs(points, [MIDDLE], ["series"]).set_index("series")["time"]
    orders = lines.orders(of_study(table, convergence.STUDY.name, scene.name))
    timed = of_study(table, speed.STUDY.name, scene.name)
    steps, seconds = (
        of_measure(timed, measure).groupby("method")["value"].last() for measure in (Measure.TIME_PER_STEP, Measure.TIME)
    )
    for _, line in accuracy.groupby("method" if named else "series", sort=False):
        rows = line[line["method"] == line["method"].iloc[-1]]
        method, family, series = rows[["method", "family", "series"]].iloc[0]
        values = (
            float(column.get(key, math.nan))
            for column, key in ((orders, method), (steps, method), (seconds, method), (reached, series))
        )
        yield Line(
            display_name(family, "", rows["setting" if named else "series_setting"].iloc[0]),
            str(family),
            outcomes(rows)[0],
            largest_drifts(rows, scene),
            float(of_measure(rows, Measure.ATTITUDE_MAX)["value"].max()),
            *values,
        )


def scene_table(table: pd.DataFrame, points: pd.DataFrame, scene: Scene, named: bool = False) -> Table:
    """Return one row per line of `scene_lines`, and a column for each invariant of the scene.

    Methods that failed come last, with the reason; settings of a method that failed in the same way share a row.
    """
    body: list[Row] = []
    failed: dict[tuple[str, str], list[str]] = {}
    for line in scene_lines(table, points, scene, named):
        if not line.outcome.ok:
            failed.setdefault((line.family, str(outcome_cell(line.outcome, reason=True))), []).append(line.name)
            continue
        order, step = _order(line), number(line.time_per_step * 1e6)
        body.append([line.name, *map(bound, line.drifts.values()), angle(line.error), order, step, factor(line.reached * 1e6)])
    header = ["method", *(invariant.name for invariant in scene.invariants), *HEADER]
    # In the first cell, because a terminal has no room for a column of reasons.
    body += [[f"{', '.join(names)}: {reason}", *[DASH] * (len(header) - 1)] for (_, reason), names in failed.items()]
    return Table(header, body, scene.name)


def paper_table(table: pd.DataFrame, points: Mapping[str, pd.DataFrame], scenes: Iterable[Scene]) -> Table:
    """Return the error, drift, order and time of each scheme, for a paper, sorted by scene and name, ours or not.

    A scheme that failed has the outcome in place of its error.
    """
    header = ["scheme", "scene", "attitude error, rad", "largest relative drift", "order", "time per simulated second, µs"]
    body: list[Row] = []
    for scene in scenes:
        for line in sorted(scene_lines(table, points[scene.name], scene), key=lambda line: line.name.casefold()):
            if line.outcome.ok:
                drift = max(line.drifts.values(), default=math.nan)
                cells = [angle(line.error), bound(drift), _order(line), number(line.time_per_second * 1e6)]
            else:
                cells = [str(outcome_cell(line.outcome)), *[DASH] * 3]
            body.append([line.name, scene.name, *cells])
    steps = ", ".join(f"{scene.name} {scene.dt:g} s" for scene in scenes)
    caption = f"Each scheme at the scene's step ({steps}), or at its default tolerance. Errors and drifts are rounded up"
    return Table(header, body, caption)


def _order(line: Line) -> str:
    return DASH if math.isnan(line.order) else f"{line.order:.2f}"
