"""A row per method: the end of `conservative report` on the terminal, and the table for a paper."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.speed_ratio import cheapest, costs
from conservative.benchmarks.studies import convergence, paper, speed
from conservative.method import Role
from conservative.outcome import Outcome
from conservative.scene import Scene

from ..document.cells import DASH, angle, bound, factor, number, outcome_cell, tolerance
from ..document.model import Grade, Row, Table
from ..rows import lines
from ..rows.names import (
    ABSENT,
    MethodClass,
    at_own_step,
    display_name,
    largest_drifts,
    of_classes,
    of_measure,
    of_study,
    outcomes,
    without_outcome,
)
from .measured import Measured
from .summary import MIDDLE

HEADER = ("attitude", "order", "µs/step", f"µs at {tolerance(MIDDLE)}")
PAPER_MAP = "reduced"
"""The integrator of the paper, which a report always shows."""
LEGEND = (
    "energy, momenta: largest relative drift; attitude: largest error, rad; at the scene's own step or the default tolerance, "
    f"rounded up. order: observed. µs at {tolerance(MIDDLE)}: wall time per simulated second at this error, rad. "
    f"{DASH}: not measurable, or not reached."
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


def scene_table(table: pd.DataFrame, points: pd.DataFrame, scene: Scene, named: bool = False, reason: bool = True) -> Table:
    """Return one row per line of `scene_lines`, and a column for each invariant of the scene.

    Methods that failed come last, with the reason if `reason`; settings of a method that failed in the same way share a row.
    """

    def why(outcome: Outcome) -> str:
        return str(outcome_cell(outcome, reason=True)) if reason else Grade.BAD.mark(outcome.kind)

    body: list[Row] = []
    failed: dict[tuple[str, str], list[str]] = {}
    for line in scene_lines(table, points, scene, named):
        if not line.outcome.ok:
            failed.setdefault((line.family, why(line.outcome)), []).append(line.name)
            continue
        order, step = _order(line), number(line.time_per_step * 1e6)
        body.append([line.name, *map(bound, line.drifts.values()), angle(line.error), order, step, factor(line.reached * 1e6)])
    header = ["method", *(invariant.name for invariant in scene.invariants), *HEADER]
    # In the first cell, because a terminal has no room for a column of reasons.
    body += [[f"{', '.join(names)}: {text}", *[DASH] * (len(header) - 1)] for (_, text), names in failed.items()]
    return Table(header, body, scene.name)


def brief_table(measured: Measured, points: pd.DataFrame, scene: Scene) -> Table:
    """Return the table of a scene for a terminal. The page has all methods.

    It has all settings of engines, the fastest setting of each ODE solver, the paper's map, and the fastest of our methods of
    each kind. If methods were named, it has all of them.
    """
    if measured.plan.named:
        return scene_table(measured.scene_rows, points, scene, named=True)
    rows, reached = measured.scene_rows, costs(points, [MIDDLE])
    solvers = of_classes(points, MethodClass.SOLVER)
    kinds = [of_classes(reached, kind) for kind in (MethodClass.GENERAL, MethodClass.SOLUTION)]
    kinds += [solver for _, solver in of_classes(reached, MethodClass.SOLVER).groupby("family")]
    fastest = points[points["name"].isin([side.name for side in map(cheapest, kinds) if side])]
    slower = solvers[solvers["family"].isin(fastest["family"]) & ~solvers["series"].isin(fastest["series"])]
    of_engines = (rows["role"] == Role.ENGINE) & ~rows["series"].isin(slower["series"])
    return scene_table(rows[of_engines | rows["series"].isin([PAPER_MAP, *fastest["series"]])], points, scene, reason=False)


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
