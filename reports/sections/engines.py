"""Engines compared with each other: each as installed and with its best setting, and every setting of each."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import pandas as pd

from conservative.benchmarks.measures.convergence_order import grows_with_shorter_steps
from conservative.benchmarks.measures.errors import CONSERVED, SMALL
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.speed_ratio import cost
from conservative.benchmarks.studies import convergence, paper, speed, work_precision
from conservative.benchmarks.studies.paper import AS_INSTALLED
from conservative.benchmarks.studies.selection import Missing
from conservative.invariants import AXIAL_MOMENTUM, MOMENTA
from conservative.method import Role
from conservative.outcome import OK, Outcome, OutcomeKind

from ..charts import figures, vega_embed
from ..document.cells import DASH, angle, bound, grade, numeric, outcome_cell, tolerance
from ..document.model import Block, Cell, Figure, Grade, Item, Items, LegendEntry, Paragraph, Row, Section, Style, Table
from ..rows.names import ABSENT, at_own_step, of_measure, of_study, outcomes, with_outcome
from .measured import Measured, of_scene
from .provenance import lock_sections

STUDIES = tuple(study.STUDY.name for study in (paper, convergence, speed, work_precision))
WORSE = "worse with smaller steps"
"""Text in place of an order: the error increases as steps get shorter."""
SAME_MOTION = 1.0
"""Largest attitude error, rad, of a run that is compared by its time. A run with a larger error is another motion."""
USABLE = 0.1
"""Largest attitude error over the run, rad, of a usable step."""
ERROR = 1e-3
"""Attitude error, rad, at which a simulated second is timed."""
AT_ITS_BEST = "at its best"
FAR_FROM_ORDER = 0.5
"""Largest difference of an order below the expected one that is not marked."""

COLUMNS = (
    (
        "taken",
        "as installed: only the step size is set (– if a user has to choose a setting or no defaults are stated); at its "
        "best: the setting with the smallest error; both.",
    ),
    ("bits", "precision of the engine's numbers: 64 double, 32 single."),
    (
        "error, rad",
        "largest attitude error over the run; engines that choose their steps use the tolerance of the setting.",
    ),
    (
        "order (expected)",
        "fit of log(error) over log(step), and the expected order of the integrator; ✗ if the order is lower. "
        f"Impulse-based engines in single precision get {WORSE}: they have no order.",
    ),
    ("energy drift", "largest relative drift of the run, and whether energy was gained or lost at the end."),
    ("world momentum drift", "the same of the conserved momentum: of a free body, or about the axis of a field."),
    ("axial momentum drift", "the same of the momentum about the axis of a symmetric body; – if it is not conserved."),
    ("turns over", "number of flips of the free body, and of the exact motion: the quality of the motion."),
    ("longest step, s", f"longest measured step with an error of at most {USABLE:g} rad; – if there is none."),
    ("µs a step", "wall time at the scene's step, the fastest of interleaved rounds, measured in the engine's process."),
    (
        f"µs per s at {ERROR:g} rad",
        "wall time of a simulated second at this error, interpolated log-log between two measured steps or tolerances; – if no "
        "measured run reaches it.",
    ),
    ("run", "the outcome."),
)
"""The columns of the table of settings, and their meaning."""


@dataclass(frozen=True)
class EngineRow:
    """One setting of one engine on one scene: such as family `exudyn`, version `1.13.6` and setting `RK44`.

    `outcome` is the outcome of the run at the scene's step, or of its timing. `error` is its largest attitude error, rad, and
    `second_time` the wall time, s, of a simulated second at an error of `ERROR`; NaN if not measured or not reached. `series`
    is its line of steps or tolerances. `as_installed` is true if only the step is set, `best` if no setting of the engine has
    a smaller error. `cells` are the cells of `COLUMNS` by name, except "taken".
    """

    family: str
    version: str
    label: str
    setting: str
    series: str
    outcome: Outcome
    as_installed: bool
    error: float
    second_time: float
    cells: Mapping[str, Cell]
    energy_text: str = DASH
    best: bool = False

    @property
    def engine(self) -> str:
        """Engine with version, as in its label."""
        return "==".join(filter(None, (self.family, self.version)))

    @property
    def taken(self) -> str:
        """The first cell."""
        names = [AS_INSTALLED] * self.as_installed + [AT_ITS_BEST] * self.best
        return "both" if len(names) == 2 else "".join(names)


def section(measured: Measured) -> Section:
    """Return the section of the engines that the report names."""
    words = (
        "Engines in their own environments, and those installed with this package. Each runs in its own loop and "
        "process, one process at a time. At its best: the setting with the smallest error at the scene's step. As "
        "installed: only the step size is set."
    )
    columns = Items([Item(meaning, name) for name, meaning in COLUMNS])
    blocks: list[Block] = [Paragraph(words)]
    for scene in measured.plan.scenes:
        rows, name, dt = engine_rows(measured, scene.name), scene.name, f"{scene.dt:g}"
        if rows:
            about = (
                f"{scene.t_end:g} s at dt = {dt} s. Drifts are the largest of the run, "
                f"relative: ✓ up to {tolerance(CONSERVED)}, ≈ up to {tolerance(SMALL)}, ✗ more."
            )
            sides: list[Block] = [Paragraph(about), side_by_side(rows, name)]
            blocks.append(Section(f"{name}: as installed, and at its best", sides, source={"scene": name}))
            drawn = picture_points(rows, of_scene(measured.points, name))
            none = Paragraph("No run was close enough to the motion to be timed.")
            blocks.append(Section(f"{name}: work against precision", [figure(drawn, name) if len(drawn) else none]))
        blocks.append(Section(f"{name}: every setting", [every_setting(rows, dt, name)], source={"scene": name}))
    blocks.append(Section("Meaning of the columns", [columns], folded=True))
    blocks.append(Section("Versions and environments", [_versions(measured), *lock_sections(measured.source.environments)]))
    return Section("Engines", blocks, "engines", source={"study": STUDIES, "role": Role.ENGINE.value})


def tables(measured: Measured) -> list[Table]:
    """Return the table of engines for each scene, `side_by_side`; none if the report names no engines."""
    scenes = [scene.name for scene in measured.plan.scenes] if measured.plan.engines else []
    return [side_by_side(engine_rows(measured, scene), scene) for scene in scenes]


def picture_points(rows: Sequence[EngineRow], points: pd.DataFrame) -> pd.DataFrame:
    """Return the points of each engine's best setting, and as installed if that is another one: two lines per engine.

    Columns name (engine with version), kind (as installed, or at its best), setting, dt (s), error (rad), time (s per simulated
    second), times (of each process).
    """
    points = points[points["error"] <= SAME_MOTION]
    parts = [
        points[points["series"] == row.series].assign(name=row.engine, kind=AT_ITS_BEST if row.best else AS_INSTALLED)
        for row in rows
        if row.best or row.as_installed
    ]
    joined = pd.concat(parts, ignore_index=True) if parts else points.assign(kind="")
    columns = joined[["name", "kind", "setting", "dt", "error", "time", "times"]]
    return columns.sort_values(["name", "kind"], kind="stable", ignore_index=True)


def figure(points: pd.DataFrame, scene: str) -> Figure:
    """Return the figure of `picture_points`."""
    engines = points["name"].nunique()
    summary = f"{len(points)} measured runs of {engines} engines; solid lines at their best, dashed ones as installed."
    picture = figures.engines(points, scene)
    panels = vega_embed.embed(picture, ("name", "kind", "setting", "error", "microseconds", "dt"), 520)
    looks, accurate_first = figures.engine_looks(points["name"]), points.groupby("name")["error"].min().sort_values().index
    legend = [LegendEntry(name, looks[name][0], vega_embed.PATHS[looks[name][1]], "") for name in accurate_first]
    return Figure(f"engines_{scene}", f"{scene}: engines, wall time against attitude error", summary, picture, panels, legend)


def _versions(measured: Measured) -> Table:
    """Return version, runtime and number of packages of each environment, then the engines installed with this package."""
    environments = {lock.name: lock for lock in measured.source.environments}
    engines = dict.fromkeys(str(method.maker) for method in measured.plan.engines if not isinstance(method, Missing))
    locked = [environments[name] for name in engines if name in environments]
    apart = [[lock.name, "in its own environment", lock.runtime, str(len(lock.packages))] for lock in locked]
    here = [[name, "with this package", "ours", DASH] for name in engines if name not in environments]
    return Table(["engine", "runs", "runtime", "packages"], [*apart, *here], "Engines of this section")


def engine_rows(measured: Measured, scene: str) -> list[EngineRow]:
    """Return the measurements of engines on a scene, accurate ones first, those that did not run last."""
    accuracy, times, over_steps = (
        of_study(measured.engine_rows, study.STUDY.name, scene) for study in (paper, speed, convergence)
    )
    at_step, points = pd.concat([at_own_step(accuracy), times]), of_scene(measured.points, scene)
    lines = {str(name): rows for name, rows in over_steps.groupby("series", sort=False)}
    timed = {str(name): rows for name, rows in points[points["error"] <= SAME_MOTION].groupby("series", sort=False)}
    rows = [_engine_row(rows, lines, timed) for _, rows in at_step.groupby("label", sort=False)]
    best: dict[str, EngineRow] = {}  # the best row of each engine: the smallest error, then the shortest time
    known = (row for row in rows if not math.isnan(row.error))
    for row in sorted(known, key=lambda row: (row.error, math.isnan(row.second_time), row.second_time)):
        best.setdefault(row.engine, row)
    marked = [replace(row, best=best.get(row.engine) is row) for row in rows]
    return sorted(marked, key=lambda row: (math.isnan(row.error), not row.outcome.ok, row.error, row.label))


def _engine_row(rows: pd.DataFrame, lines: Mapping[str, pd.DataFrame], timed: Mapping[str, pd.DataFrame]) -> EngineRow:
    first = rows.iloc[0]
    series = str(first["series"])
    line, points = lines.get(series, rows.iloc[:0]), timed.get(series)
    ends = pd.concat([of_measure(rows, measure) for measure in (Measure.ATTITUDE_MAX, Measure.TIME)])
    outcome = next((outcome for outcome in outcomes(ends) if not outcome.ok), OK)
    usable = with_outcome(of_measure(line, Measure.ATTITUDE_MAX), OutcomeKind.OK)
    measures = Measure.ORDER_EXPECTED, Measure.ATTITUDE_MAX, Measure.PRECISION
    expected, error, bits = (_value(rows, measure) for measure in measures)
    longest_step, step_time = float(usable[usable["value"] <= USABLE]["dt"].max()), _value(rows, Measure.TIME_PER_STEP)
    if math.isnan(expected):  # it chooses its steps
        longest_step = step_time = math.nan
    second_time = math.nan if points is None else cost(points["error"].tolist(), points["time"].tolist(), ERROR)
    momentum = next((name for name in MOMENTA if len(of_measure(rows, Measure.DRIFT_MAX, name))), MOMENTA[0])
    cells = (
        numeric(bits),
        numeric(error, angle(error)),
        _order(line, expected),
        _drift(rows, "energy"),
        _drift(rows, momentum),
        _drift(rows, AXIAL_MOMENTUM),
        _turns(_value(rows, Measure.TURNS_OVER), _value(rows, Measure.TURNS_OVER_TRUE)),
        numeric(longest_step),
        numeric(step_time * 1e6, digits=3),
        numeric(second_time * 1e6, digits=3),
        outcome_cell(outcome, reason=True),
    )
    return EngineRow(
        family=str(first["engine"]),
        version=str(first["version"]),
        label=str(first["label"]),
        setting=str(first["setting"]),
        series=series,
        outcome=outcome,
        as_installed=AS_INSTALLED in set(of_measure(rows, Measure.PRECISION)["detail"]),
        error=error,
        second_time=second_time,
        cells=dict(zip([name for name, _ in COLUMNS[1:]], cells, strict=True)),
        energy_text=_drift_text(rows, "energy"),
    )


def _value(rows: pd.DataFrame, measure: Measure) -> float:
    values = of_measure(rows, measure)["value"]
    return float(values.iloc[0]) if len(values) else math.nan


def _drift(rows: pd.DataFrame, quantity: str) -> Cell:
    """Return a graded drift."""
    drift = of_measure(rows, Measure.DRIFT_MAX, quantity)
    return grade(float(drift["value"].iloc[0]) if len(drift) else math.nan, _drift_text(rows, quantity))


def _drift_text(rows: pd.DataFrame, quantity: str) -> str:
    """Return a drift as text, with its direction if it is more than small."""
    drift = of_measure(rows, Measure.DRIFT_MAX, quantity)
    size = float(drift["value"].iloc[0]) if len(drift) else math.nan
    return " ".join(filter(None, (bound(size), drift["detail"].iloc[0] if size > SMALL else "")))


def _turns(turns: float, expected: float) -> Cell:
    if math.isnan(turns) or math.isnan(expected):
        return Cell(DASH)
    graded = Grade.GOOD if turns == expected else Grade.BAD
    return Cell(graded.mark(f"{turns:.0f} of {expected:.0f}"), graded)


def _order(line: pd.DataFrame, expected: float) -> Cell:
    """Return the observed order with the expected one, marked if it is lower, or that there is none."""
    if math.isnan(expected):
        return numeric(math.nan)
    fit, order = of_measure(line, Measure.ORDER), _value(line, Measure.ORDER)
    errors = of_measure(line, Measure.ATTITUDE_MAX)
    without = len(fit) > 0 and fit["outcome"].iloc[0] == OutcomeKind.NO_ORDER
    if without and grows_with_shorter_steps(errors["dt"].to_numpy(), errors["value"].to_numpy()):
        return Cell(f"{DASH} none ({expected:.0f}): {WORSE}", Grade.BAD)
    if math.isnan(order):
        return numeric(order, f"{DASH} not seen ({expected:.0f})")
    text = f"{order:.2f} ± {_value(line, Measure.ORDER_STDERR):.2f} ({expected:.0f})"
    low = order < expected - FAR_FROM_ORDER
    return Cell(Grade.BAD.mark(text), Grade.BAD, value=order) if low else numeric(order, text)


def every_setting(rows: Sequence[EngineRow], dt: str, scene: str) -> Table:
    """Return a row for each setting, and one for each engine that does not support the scene; `dt` is the scene's step, s."""
    names = [name for name, _ in COLUMNS]
    shown: list[Row] = [
        [row.label, row.taken, *(row.cells[name] for name in names[1:])] for row in rows if row.outcome.kind not in ABSENT
    ]

    def reason(row: EngineRow) -> tuple[str, str]:
        return row.engine, row.outcome.reason

    absent = sorted((row for row in rows if row.outcome.kind in ABSENT), key=reason)
    for (engine, _), group in groupby(absent, reason):
        members = list(group)
        label = members[0].label if len(members) == 1 else f"{engine}, {len(members)} settings"
        shown.append([label, *[DASH] * (len(names) - 1), members[0].cells["run"]])
    caption = f"{scene}: every setting of every engine at dt = {dt} s"
    return Table(["engine==version/setting", *names], shown, caption, Style.FILTERED)


def chosen(rows: Sequence[EngineRow], family: str, version: str) -> list[EngineRow]:
    """Return a version as installed and at its best, one row if they are the same; without an error its first row."""
    mine = [row for row in rows if (row.family, row.version) == (family, version)]
    installed = [row for row in mine if row.as_installed][:1]
    return [*installed, *(row for row in mine if row.best and row not in installed)] or mine[:1]


def comparison_cells(row: EngineRow, parts: Sequence[str]) -> list[str | Cell]:
    """Return the cells of a row in `chosen`: its setting, then columns by name; an outcome in place of the error."""
    cells = [row.cells[part] for part in parts]
    if math.isnan(row.error):
        cells[parts.index("error, rad")] = outcome_cell(row.outcome, reason=True)
    return [": ".join(filter(None, (row.taken, row.setting))) or DASH, *cells]


def side_by_side(rows: Sequence[EngineRow], scene: str) -> Table:
    """Return each engine as installed and with its best setting, the most accurate first."""
    parts = ("error, rad", "energy drift", "turns over", "bits")
    engines = dict.fromkeys((row.family, row.version) for row in rows)
    body = [[row.engine, *comparison_cells(row, parts)] for engine in engines for row in chosen(rows, *engine)]
    return Table(["engine", "setting", *parts], body, f"{scene}: each engine", Style.FILTERED)
