"""Speed ratios of classes on one scene: at each decade of error, and with each of the scene's own steps stored."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.speed_ratio import Cheapest, SpeedRatio, costs, speed_ratios
from conservative.benchmarks.studies.each_step import ERROR, STUDY

from ..document.cells import DASH, factor, numeric, ratio_text, tolerance
from ..document.model import Cell, Row, Table
from ..rows.names import OF_ENGINES, MethodClass, of_classes
from ..rows.points import DECADES, points

_COSTS = "µs per s", "µs a sample"
HEADER = (
    *("error, rad", "our fastest general integrator", *_COSTS, "fastest engine", *_COSTS, "engine / ours"),
    *("our solution of integrable motions", *_COSTS, "engine / solution"),
)


@dataclass(frozen=True, eq=False)
class EachStep:
    """Costs of methods with a scene's own steps, `interval` s apart, stored.

    Each method is at its coarsest setting with an error of at most `ERROR` at each of these steps.

    `runs` are the costs (see `speed_ratio.costs`) at `ERROR` by name: of runs with every step stored, of the same without an
    engine's conversion of its states, and of runs with the final state only.
    """

    interval: float
    runs: dict[str, pd.DataFrame]


def each_step(table: pd.DataFrame, scene: str) -> EachStep | None:
    """Return the costs with every step stored on a scene; None without the study."""
    rows = table[(table["study"] == STUDY.name) & (table["scene"] == scene)]
    times = (Measure.TIME_SAMPLED, Measure.TIME_OWN_LOOP, Measure.TIME)
    stored, engines, final = (costs(points(rows, STUDY.name, time), [ERROR]) for time in times)
    if stored.empty:
        return None
    own_loop = pd.concat([stored[~stored["name"].isin(engines["name"])], engines])
    interval = float(rows["dt"].max())
    interval_text = f"every {interval:.3g} s"
    runs = {
        f"{interval_text} stored": stored,
        f"{interval_text} stored, engines without conversion": own_loop,
        f"{interval_text}, final state only": final,
    }
    return EachStep(interval, runs)


def ratios_of_class(reached: pd.DataFrame, kind: MethodClass, errors: Sequence[float] = DECADES) -> list[SpeedRatio]:
    """Return the ratios of one class of ours to all engines, on each scene, at each error that either side reaches."""
    ours, theirs = of_classes(reached, kind), of_classes(reached, *OF_ENGINES)
    return [
        speed_ratio
        for speed_ratio in speed_ratios(ours, theirs, reached["scene"].unique(), errors)
        if speed_ratio.ours or speed_ratio.theirs
    ]


def as_table(points: pd.DataFrame, interval: float, each_step: EachStep | None = None) -> Table:
    """Return the fastest method of each class of ours and of the engines at each decade of the error, and the ratios.

    `points` belong to one scene (see `rows.points`), whose samples are `interval` s apart. `each_step` adds the last rows.
    """
    decades = _rows(costs(points, DECADES), interval, DECADES)
    rows: list[Row] = [[numeric(error, tolerance(error)), *row] for error, row in decades]
    if each_step:
        for label, reached in each_step.runs.items():
            rows += [[f"{tolerance(ERROR)}, {label}", *row] for _, row in _rows(reached, each_step.interval, (ERROR,))]
    return Table(HEADER, rows)


def _rows(reached: pd.DataFrame, interval: float, errors: tuple[float, ...]) -> Iterator[tuple[float, Row]]:
    """Yield each error that any method reaches, large ones first, and its cost in each class."""
    general, solutions = (
        {speed_ratio.error: speed_ratio for speed_ratio in ratios_of_class(reached, kind, errors)}
        for kind in (MethodClass.GENERAL, MethodClass.SOLUTION)
    )

    def cells(line: Cheapest | None) -> list[str | Cell]:
        if line is None:
            return ["not reached", DASH, DASH]
        return [line.name, *(numeric(time, factor(time, 3)) for time in (line.time * 1e6, line.time * interval * 1e6))]

    def ratio(speed_ratio: SpeedRatio | None) -> str | Cell:
        return numeric(speed_ratio.ratio, ratio_text(speed_ratio.ratio, speed_ratio.interval)) if speed_ratio else DASH

    for error in errors:
        ours, solved = general.get(error), solutions.get(error)
        if either := ours or solved:  # the engines are the same in both
            first, second = (cells(speed_ratio.ours if speed_ratio else None) for speed_ratio in (ours, solved))
            yield error, [*first, *cells(either.theirs), ratio(ours), *second, ratio(solved)]
