"""Engines compared with each other: each as installed and with its best setting, and every setting of each."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

import pandas as pd

from conservative.benchmarks.contest import cost
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.engines_at_one_step import AS_INSTALLED
from conservative.benchmarks.studies.engines_over_steps import WORSE
from conservative.benchmarks.studies.selection import Missing
from conservative.benchmarks.studies.studies import ENGINES
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.scene import Scene

from ..charts import figures, vega_embed
from ..document.cells import CONSERVED, DASH, SMALL, grade_drift, number, outcome_cell, tolerance
from ..document.model import Block, Cell, Figure, Grade, Item, Items, LegendEntry, Paragraph, Row, Section, Style, Table
from ..rows.names import of_measure, of_study, outcomes, with_outcome
from ..rows.points import points as points_over
from .measured import Measured, of_scene
from .provenance import lock_sections

ONE_STEP, OVER_STEPS = "engines_at_one_step", "engines_over_steps"
USABLE = 0.1
"""Largest attitude error over the run, rad, of a usable step."""
ERROR = 1e-3
"""Attitude error, rad, at which a simulated second is timed."""
MOMENTA = ("momentum", "vertical momentum")
"""Names of the conserved momentum in the world: of a free body, and about the axis of a field."""
AT_ITS_BEST = "at its best"
BOTH = "both"
ABSENT = (OutcomeKind.UNSUPPORTED, OutcomeKind.MISSING)
FAR_FROM_ORDER = 0.5
"""How far an order may be below the expected one without a mark."""

COLUMNS = (
    (
        "taken",
        "as installed: only the step size is set (– if a user has to choose a setting or no defaults are stated); at its "
        "best: the setting with the smallest error; both.",
    ),
    ("bits", "of the engine's numbers: 64 double precision, 32 single."),
    ("error", "largest attitude error over the run; engines that choose their steps use the tolerance of the setting."),
    (
        "order",
        "fit of log(error) over log(step), in parentheses the expected order of the integrator; ✗ if the order is lower. "
        f"Impulse-based engines in single precision get {WORSE}: they have no order.",
    ),
    ("energy drift, world momentum drift", "largest relative drift of the run, and whether it was gained or lost at the end."),
    ("turns over", "number of flips of the free body, and of the exact motion: the quality of the motion."),
    ("longest step", f"longest measured step with an error of at most {USABLE:g} rad; – if there is none."),
    ("µs a step", "wall time at the scene's step, the fastest of interleaved rounds, measured in the engine's process."),
    (
        f"µs per s at {ERROR:g} rad",
        "wall time of a simulated second at this error, interpolated log-log between two measured steps or tolerances; – if no "
        "measured run reaches it.",
    ),
)
"""The meaning of the columns."""


@dataclass(frozen=True)
class Drift:
    """The largest drift of a quantity over the run, relative, and whether it was `gained` or `lost` at the end."""

    size: float = math.nan
    direction: str = ""


@dataclass(frozen=True)
class EngineRow:
    """One setting of one engine on one scene; nan for values that were not measured.

    Attributes
    ----------
    engine, label, setting
        Such as `exudyn==1.13.6`, `exudyn==1.13.6/RK44` and `RK44`.
    series
        Name of its line of steps or tolerances.
    outcome
        Outcome of the run at the scene's step.
    bits
        Precision of its numbers.
    as_installed, best
        Whether only the step is set, and whether no setting of the engine has a smaller error.
    error
        Largest attitude error at the scene's step, rad.
    energy, momentum
        Drifts at that step.
    turns, true_turns
        Number of flips of the body, and of the exact motion.
    order, order_stderr, expected_order, no_order
        The observed order, the expected one, and why none was observed.
    longest_step
        The longest step, s, with an error of `USABLE` or less.
    step_time, second_time
        Wall time, s, of a step at the scene's step, and of a simulated second at an error of `ERROR`.
    """

    engine: str
    label: str
    setting: str
    series: str
    outcome: Outcome = OK
    bits: float = math.nan
    as_installed: bool = False
    best: bool = False
    error: float = math.nan
    energy: Drift = Drift()
    momentum: Drift = Drift()
    turns: float = math.nan
    true_turns: float = math.nan
    order: float = math.nan
    order_stderr: float = math.nan
    expected_order: float = math.nan
    no_order: str = ""
    longest_step: float = math.nan
    step_time: float = math.nan
    second_time: float = math.nan


def section(measured: Measured) -> Section:
    """Return the section of the engines that the report names."""
    table = measured.rows[measured.rows["study"].isin(ENGINES)]
    points = points_over(table, OVER_STEPS)
    words = (
        "Engines in their own environments, and those installed with this package. Each runs in its own loop and "
        "process, one process at a time. At its best: the setting with the smallest error at the scene's step. As "
        "installed: only the step size is set."
    )
    columns = Items([Item(text, subject) for subject, text in COLUMNS])
    blocks: list[Block] = [Paragraph(words)]
    for scene in measured.plan.scenes:
        blocks += _scene_sections(engine_rows(table, scene.name, points), of_scene(points, scene.name), scene)
    blocks.append(Section("The meaning of the columns", [columns], folded=True))
    blocks.append(Section("Versions and environments", [_versions(measured), *lock_sections(measured.source.environments)]))
    return Section("Engines", blocks, "engines")


def _scene_sections(rows: Sequence[EngineRow], points: pd.DataFrame, scene: Scene) -> Iterator[Section]:
    name, dt = scene.name, f"{scene.dt:g}"
    if count := len({row.engine for row in rows if row.outcome.ok}):
        words = (
            f"{count} engines support this scene. {scene.t_end:g} s at dt = {dt} s. Drifts are the largest of the run, "
            f"relative: ✓ up to {tolerance(CONSERVED)}, ≈ up to {tolerance(SMALL)}, ✗ more."
        )
        yield Section(f"{name}: as installed, and at its best", [Paragraph(words), beside(rows, name)])
        drawn = picture_points(rows, points)
        none = Paragraph("No run was close enough to the motion to be timed.")
        yield Section(f"{name}: work against precision", [figure(drawn, name) if len(drawn) else none])
    yield Section(f"{name}: every setting", [every_setting(rows, dt, name)])


def picture_points(rows: Sequence[EngineRow], points: pd.DataFrame) -> pd.DataFrame:
    """Return the points of each engine's best setting, and as installed if that is another one: two lines per engine.

    Columns name (engine with version), kind (as installed, or at its best), setting, dt (s), error (rad), time (s per simulated
    second).
    """
    parts = [
        points[points["series"] == row.series].assign(name=row.engine, kind=AT_ITS_BEST if row.best else AS_INSTALLED)
        for row in rows
        if row.best or row.as_installed
    ]
    joined = pd.concat(parts, ignore_index=True) if parts else points.assign(kind="")
    columns = joined[["name", "kind", "setting", "dt", "error", "time"]]
    return columns.sort_values(["name", "kind"], kind="stable", ignore_index=True)


def figure(points: pd.DataFrame, scene: str) -> Figure:
    """Return the figure of `picture_points`."""
    engines = points["name"].nunique()
    summary = f"{len(points)} measured runs of {engines} engines; solid lines at their best, dashed ones as installed."
    picture = figures.engines(points, scene)
    panels = vega_embed.embed(picture, ("name", "kind", "setting", "error", "microseconds", "dt"), 520)
    looks = figures.engine_looks(points["name"]).items()
    legend = [LegendEntry(name, colour, vega_embed.PATHS[mark], "") for name, (colour, mark) in looks]
    return Figure(f"engines_{scene}", f"{scene}: engines, wall time against attitude error", summary, picture, panels, legend)


def _versions(measured: Measured) -> Table:
    """Return version, Python and number of packages of each environment, then the engines installed with this package."""
    environments = {lock.name: lock for lock in measured.source.environments}
    engines = dict.fromkeys(str(method.maker) for method in measured.plan.engines if not isinstance(method, Missing))
    locked = [environments[name] for name in engines if name in environments]
    apart = [[lock.name, "in its own environment", lock.python, str(len(lock.packages))] for lock in locked]
    here = [[name, "with this package", "ours", DASH] for name in engines if name not in environments]
    return Table(["engine", "runs", "Python", "packages"], [*apart, *here], "Engines of this section")


def engine_rows(table: pd.DataFrame, scene: str, points: pd.DataFrame) -> list[EngineRow]:
    """Return the measurements of engines on a scene, accurate ones first, those that did not run last.

    `table` contains the named rows of the studies of engines, `points` their `rows.points.points`.
    """
    at_step, over_steps = of_study(table, ONE_STEP, scene), of_study(table, OVER_STEPS, scene)
    lines = {str(name): rows for name, rows in over_steps.groupby("series", sort=False)}
    timed = {str(name): rows for name, rows in points[points["scene"] == scene].groupby("series", sort=False)}
    measured = [_engine_row(rows, lines, timed) for _, rows in at_step.groupby("label", sort=False)]
    return sorted(_mark_best(measured), key=lambda row: (math.isnan(row.error), not row.outcome.ok, row.error, row.label))


def _engine_row(rows: pd.DataFrame, lines: Mapping[str, pd.DataFrame], timed: Mapping[str, pd.DataFrame]) -> EngineRow:
    first = rows.iloc[0]
    line = lines.get(first["series"], rows.iloc[:0])
    engine = "==".join(filter(None, (first["engine"], first["version"])))
    label, setting, series = (str(first[name]) for name in ("label", "setting", "series"))
    row = EngineRow(engine, label, setting, series, _outcome(rows), **_facts(rows), **_errors(rows), **_order(line))
    points = timed.get(first["series"])
    second = math.nan if points is None else cost(points["error"].tolist(), points["time"].tolist(), ERROR)
    has_step = not math.isnan(row.expected_order)
    longest = _longest_step(line) if has_step else math.nan
    per_step = _value(rows, Measure.TIME_PER_STEP) if has_step else math.nan
    return replace(row, longest_step=longest, step_time=per_step, second_time=second)


def _outcome(rows: pd.DataFrame) -> Outcome:
    """Return how the run at the scene's step ended; where that was well, how its timing did."""
    ends = pd.concat([of_measure(rows, measure) for measure in (Measure.ATTITUDE_MAX, Measure.TIME)])
    return next((outcome for outcome in outcomes(ends) if not outcome.ok), OK)


def _facts(rows: pd.DataFrame) -> dict[str, Any]:
    return {
        "bits": _value(rows, Measure.PRECISION),
        "expected_order": _value(rows, Measure.ORDER_EXPECTED),
        "as_installed": AS_INSTALLED in set(of_measure(rows, Measure.PRECISION)["detail"]),
    }


def _errors(rows: pd.DataFrame) -> dict[str, Any]:
    return {
        "error": _value(rows, Measure.ATTITUDE_MAX),
        "energy": _drift(rows, "energy"),
        "momentum": next((drift for name in MOMENTA if not math.isnan((drift := _drift(rows, name)).size)), Drift()),
        "turns": _value(rows, Measure.TURNS_OVER),
        "true_turns": _value(rows, Measure.TURNS_OVER_TRUE),
    }


def _drift(rows: pd.DataFrame, quantity: str) -> Drift:
    found = of_measure(rows, Measure.DRIFT_MAX, quantity)
    return Drift(float(found["value"].iloc[0]), str(found["detail"].iloc[0])) if len(found) else Drift()


def _order(line: pd.DataFrame) -> dict[str, Any]:
    found = of_measure(line, Measure.ORDER)
    reason = str(found["reason"].iloc[0]) if len(found) and found["outcome"].iloc[0] == OutcomeKind.NO_ORDER.value else ""
    return {"order": _value(line, Measure.ORDER), "order_stderr": _value(line, Measure.ORDER_STDERR), "no_order": reason}


def _longest_step(line: pd.DataFrame) -> float:
    good = with_outcome(of_measure(line, Measure.ATTITUDE_MAX), OutcomeKind.OK)
    return float(good[good["value"] <= USABLE]["dt"].max())


def _value(rows: pd.DataFrame, measure: Measure) -> float:
    found = of_measure(rows, measure)["value"]
    return float(found.iloc[0]) if len(found) else math.nan


def _mark_best(rows: list[EngineRow]) -> list[EngineRow]:
    """Return rows with the best of each engine marked: the smallest error, of equal ones the one that takes less time."""
    best: dict[str, EngineRow] = {}
    for row in rows:
        if not math.isnan(row.error) and _rank(row) < _rank(best.get(row.engine)):
            best[row.engine] = row
    return [replace(row, best=best.get(row.engine) is row) for row in rows]


def _rank(row: EngineRow | None) -> tuple[float, float]:
    if row is None:
        return (math.inf, math.inf)
    return (row.error, math.inf if math.isnan(row.second_time) else row.second_time)


def every_setting(rows: Sequence[EngineRow], dt: str, scene: str) -> Table:
    """Return a row for each setting, and one for each engine that does not support the scene; `dt` is the scene's step, s."""
    header = [
        "engine==version/setting",
        "taken",
        "bits",
        f"error at dt {dt}, rad",
        "order (expected)",
        "energy drift",
        "world momentum drift",
        "turns over",
        "longest step, s",
        "µs a step",
        f"µs per s at {ERROR:g} rad",
        "run",
    ]
    there = [[row.label, *_setting_cells(row)] for row in rows if row.outcome.kind not in ABSENT]
    absent = _absent([row for row in rows if row.outcome.kind in ABSENT], len(header))
    return Table(header, [*there, *absent], f"{scene}: every setting of every engine", Style.FILTERED)


def _setting_cells(row: EngineRow) -> list[str | Cell]:
    return [
        taken(row),
        _integer(row.bits),
        number(row.error),
        order(row),
        drift(row.energy),
        drift(row.momentum),
        turns(row),
        number(row.longest_step),
        number(row.step_time * 1e6, 3),
        number(row.second_time * 1e6, 3),
        outcome_cell(row.outcome) if row.outcome.ok else _with_reason(row),
    ]


def _with_reason(row: EngineRow) -> Cell:
    """Return how a run ended, with the reason, which tables elsewhere leave to one another."""
    cell = outcome_cell(row.outcome)
    reason = row.outcome.reason
    return Cell(cell.text if not reason or reason in cell.text else f"{cell.text}: {reason}", cell.grade)


def _absent(rows: Sequence[EngineRow], columns: int) -> list[Row]:
    """Return a row for each engine and reason why it does not take a scene; of several settings only their number is named."""

    def key(row: EngineRow) -> tuple[str, str]:
        return row.engine, row.outcome.reason

    found: list[Row] = []
    for (engine, _), group in groupby(sorted(rows, key=key), key):
        members = list(group)
        label = members[0].label if len(members) == 1 else f"{engine}, {len(members)} settings"
        found.append([label, *[DASH] * (columns - 2), _with_reason(members[0])])
    return found


def taken(row: EngineRow) -> str:
    """Return how an engine is taken in a row: as installed, at its best, both or neither."""
    if row.as_installed and row.best:
        return BOTH
    return AS_INSTALLED if row.as_installed else AT_ITS_BEST if row.best else ""


def order(row: EngineRow) -> str | Cell:
    """Return the order that was seen, marked where it is below the expected one, in brackets, or that there is none."""
    if math.isnan(row.expected_order):
        return DASH
    expected = f"({row.expected_order:.0f})"
    if row.no_order == WORSE:
        return Cell(f"{DASH} none {expected}: {WORSE}", Grade.BAD)
    if math.isnan(row.order):
        return f"{DASH} not seen {expected}"
    text = f"{row.order:.2f} ± {row.order_stderr:.2f} {expected}"
    return Cell(f"✗ {text}", Grade.BAD) if row.order < row.expected_order - FAR_FROM_ORDER else text


def drift(value: Drift) -> Cell:
    """Return a graded drift, with its direction where it is more than small."""
    cell = grade_drift(value.size)
    return Cell(f"{cell.text} {value.direction}".rstrip(), cell.grade) if value.size > SMALL else cell


def turns(row: EngineRow) -> str | Cell:
    """Return how often the body turned over, of how often it does."""
    if math.isnan(row.turns) or math.isnan(row.true_turns):
        return DASH
    right = row.turns == row.true_turns
    return Cell(f"{'✓' if right else '✗'} {row.turns:.0f} of {row.true_turns:.0f}", Grade.GOOD if right else Grade.BAD)


def _integer(value: float) -> str:
    return DASH if math.isnan(value) else f"{value:.0f}"


def beside(rows: Sequence[EngineRow], scene: str) -> Table:
    """Return each engine as installed next to its best setting, the most accurate engines first."""
    parts = ("setting", "attitude error, rad", "energy drift", "turns over")
    header = ["engine", "bits", *(f"{text}: {part}" for text in (AS_INSTALLED, AT_ITS_BEST) for part in parts)]
    engines = dict.fromkeys(row.engine for row in rows if row.best)
    body = [_pair(engine, [row for row in rows if row.engine == engine]) for engine in engines]
    return Table(header, body, f"{scene}: each engine", Style.FILTERED)


def _pair(engine: str, rows: Sequence[EngineRow]) -> Row:
    best = next(row for row in rows if row.best)
    installed = next((row for row in rows if row.as_installed), None)
    return [engine, _integer(best.bits), *(_short(installed) if installed else [DASH] * 4), *_short(best)]


def _short(row: EngineRow) -> list[str | Cell]:
    if math.isnan(row.error):
        return [row.setting, outcome_cell(Outcome(row.outcome.kind)), DASH, DASH]
    return [row.setting, number(row.error), drift(row.energy), turns(row)]
