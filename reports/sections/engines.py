"""Engines compared with each other: each as installed and with its best setting, and every setting of each."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

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
class EngineRow:
    """One setting of one engine on one scene; NaN or a dash for values that were not measured.

    Attributes
    ----------
    engine, label, setting
        Such as `exudyn==1.13.6`, `exudyn==1.13.6/RK44` and `RK44`.
    series
        Name of its line of steps or tolerances.
    outcome
        Outcome of the run at the scene's step, or of its timing.
    as_installed, best
        Whether only the step is set, and whether no setting of the engine has a smaller error.
    bits, error
        Precision of its numbers, and largest attitude error at the scene's step, rad.
    energy, momentum, turns, order
        Cells: drifts, flips of the body, and the observed order with the expected one.
    longest_step
        The longest step, s, with an error of `USABLE` or less.
    step_time, second_time
        Wall time, s, of a step at the scene's step, and of a simulated second at an error of `ERROR`.
    """

    engine: str
    label: str
    setting: str
    series: str
    outcome: Outcome
    as_installed: bool
    bits: float
    error: float
    energy: Cell
    momentum: Cell
    turns: str | Cell
    order: str | Cell
    longest_step: float
    step_time: float
    second_time: float
    best: bool = False


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
    label, setting, series = (str(first[name]) for name in ("label", "setting", "series"))
    line, points = lines.get(series, rows.iloc[:0]), timed.get(series)
    ends = pd.concat([of_measure(rows, measure) for measure in (Measure.ATTITUDE_MAX, Measure.TIME)])
    good = with_outcome(of_measure(line, Measure.ATTITUDE_MAX), OutcomeKind.OK)
    expected = _value(rows, Measure.ORDER_EXPECTED)
    has_step = not math.isnan(expected)
    momenta = [_drift(rows, name) for name in MOMENTA if len(of_measure(rows, Measure.DRIFT_MAX, name))]
    return EngineRow(
        engine="==".join(filter(None, (first["engine"], first["version"]))),
        label=label,
        setting=setting,
        series=series,
        outcome=next((outcome for outcome in outcomes(ends) if not outcome.ok), OK),
        as_installed=AS_INSTALLED in set(of_measure(rows, Measure.PRECISION)["detail"]),
        bits=_value(rows, Measure.PRECISION),
        error=_value(rows, Measure.ATTITUDE_MAX),
        energy=_drift(rows, "energy"),
        momentum=momenta[0] if momenta else grade_drift(math.nan),
        turns=_turns(_value(rows, Measure.TURNS_OVER), _value(rows, Measure.TURNS_OVER_TRUE)),
        order=_order(line, expected),
        longest_step=float(good[good["value"] <= USABLE]["dt"].max()) if has_step else math.nan,
        step_time=_value(rows, Measure.TIME_PER_STEP) if has_step else math.nan,
        second_time=math.nan if points is None else cost(points["error"].tolist(), points["time"].tolist(), ERROR),
    )


def _value(rows: pd.DataFrame, measure: Measure) -> float:
    values = of_measure(rows, measure)["value"]
    return float(values.iloc[0]) if len(values) else math.nan


def _drift(rows: pd.DataFrame, quantity: str) -> Cell:
    """Return a graded drift; the direction is given if it is more than small."""
    drift = of_measure(rows, Measure.DRIFT_MAX, quantity)
    size = float(drift["value"].iloc[0]) if len(drift) else math.nan
    cell = grade_drift(size)
    return Cell(f"{cell.text} {drift['detail'].iloc[0]}".rstrip(), cell.grade) if size > SMALL else cell


def _turns(turns: float, expected: float) -> str | Cell:
    if math.isnan(turns) or math.isnan(expected):
        return DASH
    right = turns == expected
    return Cell(f"{'✓' if right else '✗'} {turns:.0f} of {expected:.0f}", Grade.GOOD if right else Grade.BAD)


def _order(line: pd.DataFrame, expected: float) -> str | Cell:
    """Return the observed order with the expected one, marked if it is lower, or that there is none."""
    if math.isnan(expected):
        return DASH
    fit, order = of_measure(line, Measure.ORDER), _value(line, Measure.ORDER)
    if len(fit) and fit["outcome"].iloc[0] == OutcomeKind.NO_ORDER and fit["reason"].iloc[0] == WORSE:
        return Cell(f"{DASH} none ({expected:.0f}): {WORSE}", Grade.BAD)
    if math.isnan(order):
        return f"{DASH} not seen ({expected:.0f})"
    text = f"{order:.2f} ± {_value(line, Measure.ORDER_STDERR):.2f} ({expected:.0f})"
    return Cell(f"✗ {text}", Grade.BAD) if order < expected - FAR_FROM_ORDER else text


def _mark_best(rows: list[EngineRow]) -> list[EngineRow]:
    """Return rows with the best setting of each engine marked: the smallest error, then the shortest time."""

    def rank(row: EngineRow) -> tuple[float, float]:
        return row.error, math.inf if math.isnan(row.second_time) else row.second_time

    best: dict[str, EngineRow] = {}
    for row in sorted((row for row in rows if not math.isnan(row.error)), key=rank):
        best.setdefault(row.engine, row)
    return [replace(row, best=best.get(row.engine) is row) for row in rows]


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
    there: list[Row] = [
        [
            row.label,
            _taken(row),
            _integer(row.bits),
            number(row.error),
            row.order,
            row.energy,
            row.momentum,
            row.turns,
            number(row.longest_step),
            number(row.step_time * 1e6, 3),
            number(row.second_time * 1e6, 3),
            _with_reason(row.outcome),
        ]
        for row in rows
        if row.outcome.kind not in ABSENT
    ]
    absent = sorted((row for row in rows if row.outcome.kind in ABSENT), key=_reason)
    for (engine, _), group in groupby(absent, _reason):
        members = list(group)
        label = members[0].label if len(members) == 1 else f"{engine}, {len(members)} settings"
        there.append([label, *[DASH] * (len(header) - 2), _with_reason(members[0].outcome)])
    return Table(header, there, f"{scene}: every setting of every engine", Style.FILTERED)


def _reason(row: EngineRow) -> tuple[str, str]:
    return row.engine, row.outcome.reason


def _taken(row: EngineRow) -> str:
    if row.as_installed and row.best:
        return "both"
    return AS_INSTALLED if row.as_installed else AT_ITS_BEST if row.best else ""


def _with_reason(outcome: Outcome) -> Cell:
    """Return an outcome with its reason, which other tables omit."""
    cell = outcome_cell(outcome)
    known = outcome.ok or not outcome.reason or outcome.reason in cell.text
    return cell if known else Cell(f"{cell.text}: {outcome.reason}", cell.grade)


def _integer(value: float) -> str:
    return DASH if math.isnan(value) else f"{value:.0f}"


def beside(rows: Sequence[EngineRow], scene: str) -> Table:
    """Return each engine as installed next to its best setting, the most accurate engines first."""
    parts = ("setting", "attitude error, rad", "energy drift", "turns over")
    header = ["engine", "bits", *(f"{text}: {part}" for text in (AS_INSTALLED, AT_ITS_BEST) for part in parts)]
    body: list[Row] = []
    for best in (row for row in rows if row.best):
        installed = next((row for row in rows if row.engine == best.engine and row.as_installed), None)
        body.append([best.engine, _integer(best.bits), *(_short(installed) if installed else [DASH] * 4), *_short(best)])
    return Table(header, body, f"{scene}: each engine", Style.FILTERED)


def _short(row: EngineRow) -> list[str | Cell]:
    if math.isnan(row.error):
        return [row.setting, outcome_cell(Outcome(row.outcome.kind)), DASH, DASH]
    return [row.setting, number(row.error), row.energy, row.turns]
