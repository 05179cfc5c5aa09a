"""One scene: work against precision, drift, convergence, wall time, and the motion itself."""

from __future__ import annotations

import math
from dataclasses import replace

import pandas as pd

from conservative.benchmarks.measures.errors import CONSERVED, SMALL
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import convergence, each_step, long_runs, paper, speed, step_ladder, work_precision
from conservative.deferred_imports import DEFAULT_METHOD
from conservative.outcome import OutcomeKind
from conservative.scene import Scene

from ..charts import figures, vega_embed
from ..charts.style import families_of
from ..document.attempt import attempt
from ..document.cells import DASH, bound, grade, number, numeric, outcome_cell, size, tolerance
from ..document.model import Block, Cell, Emphasis, Figure, Paragraph, Row, Section, Style, Table, filled
from ..rows import lines
from ..rows.names import MethodClass, at_own_step, of_measure, of_study, outcomes, with_outcome
from ..rows.points import front
from . import scene_ratios
from .drift import drift_figure, spheres_figure
from .measured import Measured, of_scene
from .summary import SAMPLE_TERMS, Summary


def section(measured: Measured, scene: Scene, summary: Summary) -> Section:
    """Return the section of a scene."""
    name, rows, points = scene.name, measured.scene_rows, of_scene(measured.points, scene.name)
    speed_ratios = scene_ratios.as_table(points, scene.t_end / step_ladder.SAMPLES, measured.every_step[name])
    sample = f"A sample is one of {step_ladder.SAMPLES} in the duration"
    sample += "; in the last rows, each of the scene's own steps." if measured.every_step[name] else "."
    decades = replace(speed_ratios, caption=f"{name}: fastest method of each class at each decade of the error")
    drift_words = (
        f"Largest drift over {long_runs.end_of(scene) / scene.t_end:g} durations, relative (✓ up to {tolerance(CONSERVED)}, "
        f"≈ up to {tolerance(SMALL)}, ✗ more)."
    )
    order_words = (
        "Fit of log(error) over log(step), with standard error, between the steps that are too large to converge and the "
        f"round-off floor. Errors are the largest at {step_ladder.SAMPLES} times, relative to the reference solution: the "
        "attitude error is the angle of R_ref' R, "
        "the error of the rates is relative to the largest exact |ω|."
    )
    time_words = (
        "Time of the method's own loop at the scene's step, final state only. \"prepare\" is the conversion of the scene with "
        'compiled code available, and "first call" the first run after that. The first column of numbers is the time per step '
        f"relative to `{DEFAULT_METHOD}`."
    )
    work: list[Block] = [
        attempt(f"The chart of time against error of {name}", lambda: work_figure(points, name)),
        Paragraph(SAMPLE_TERMS, Emphasis.NOTE),
    ]
    if decades.rows:
        source = {"study": (work_precision.STUDY.name, each_step.STUDY.name)}
        work.append(Section("Each decade of error", [Paragraph(sample), decades], folded=True, source=source))
    errors, rate_errors = (of_scene(lines.errors(rows, measure), name) for measure in (Measure.ATTITUDE_MAX, Measure.RATES_MAX))
    fits = lines.fits(errors)
    orders = filled(order(fits, lines.fits(rate_errors), name), accuracy(rows, name))
    curves = attempt(f"The curves of {name}", lambda: spheres_figure(measured, scene))
    over_time = attempt(f"The chart of drift of {name}", lambda: drift_figure(measured, scene))
    long_times = filled(over_time, Paragraph(drift_words), conservation(rows, name))
    converging = attempt(f"The chart of convergence of {name}", lambda: convergence_figure(errors, fits, name))
    return Section(
        f"All tables of {name}",
        filled(
            Paragraph(summary.sentence, Emphasis.LEAD),
            Paragraph(f"{scene.source}{'. ' * bool(scene.source)}{scene.t_end:g} s; the scene's own step is {scene.dt:g} s."),
            Section("Work against precision", work),
            Section("Drift over time", long_times, source={"study": long_runs.STUDY.name}),
            Section(
                "Drift at the scene's own step", filled(drift(rows, name)), folded=True, source={"study": paper.STUDY.name}
            ),
            Section("Convergence", [converging, Paragraph(order_words)]),
            Section(
                "Orders and errors as tables", orders, folded=True, source={"study": (convergence.STUDY.name, paper.STUDY.name)}
            ),
            Section("Wall time", [Paragraph(time_words), time(rows, name)], source={"study": speed.STUDY.name}),
            Section("The motion itself", [curves]) if curves else None,
        ),
        name,
        folded=True,
        source={"scene": name},
    )


def work_figure(points: pd.DataFrame, name: str) -> Figure:
    """Return the picture of time against error, from the points of a scene."""
    picture = figures.work_precision(points, front(points[points["class"] != MethodClass.SOLUTION]), name)
    return Figure(f"work_precision_{name}", f"{name}: time against attitude error", picture=picture)


def convergence_figure(errors: pd.DataFrame, fits: pd.DataFrame, name: str) -> Figure:
    """Return the figure of error against step, from errors of a scene and their fits."""
    named = lines.with_slopes(errors, fits)
    picture = figures.convergence(named, lines.fit_ends(lines.with_slopes(fits, fits)), name)
    return Figure(
        f"convergence_{name}",
        f"{name}: attitude error against step",
        "In parentheses the fitted slope with its standard error; the bold stretch shows the fit, dashed lines whole orders.",
        picture,
        vega_embed.embed(picture, ("name", "dt", "error"), 520),
        vega_embed.legend(families_of(named), marks=True),
    )


def _wide(table: pd.DataFrame, study: str, scene: str) -> pd.DataFrame:
    """Return the values of a study at the scene's step: a row for each method, ours first, a column (measure, quantity)."""
    rows = with_outcome(at_own_step(of_study(table, study, scene)), OutcomeKind.OK)
    return rows.pivot_table(index="name", columns=["measure", "quantity"], values="value", sort=False)


def _lines(values: pd.DataFrame, *ranks: tuple[str, object]) -> list[tuple[str, pd.Series[float]]]:
    """Return name and values of each line, sorted by the columns `ranks`, without a value last."""

    def rank(line: tuple[str, pd.Series[float]]) -> list[tuple[bool, float]]:
        numbers = (float(line[1].get(column, math.nan)) for column in ranks)
        return [(math.isnan(number), number) for number in numbers]

    return sorted(((str(name), row) for name, row in values.iterrows()), key=rank)


def _value(row: pd.Series[float], measure: Measure, quantity: str = "") -> float:
    return float(row.get((measure.text, quantity), math.nan))


def drift(table: pd.DataFrame, scene: str) -> Table:
    """Return the drift of every invariant at the scene's step, its slope over time, and the error of orthonormality."""
    values = _wide(table, paper.STUDY.name, scene)
    invariants = [column[1] for column in values.columns if column[0] == Measure.DRIFT_MAX.text]
    header = ["method", *(f"{name}{part}" for name in invariants for part in ("", ", 1/s")), "orthonormality"]
    body: list[Row] = []
    for name, row in _lines(values):
        cells: list[str | Cell] = [name]
        for invariant in invariants:
            slope, error = _value(row, Measure.DRIFT_SLOPE, invariant), _value(row, Measure.DRIFT_SLOPE_STDERR, invariant)
            cells += [
                size(_value(row, Measure.DRIFT_MAX, invariant)),
                numeric(slope, f"{number(slope)} ± {bound(error, 1)}"),
            ]
        body.append([*cells, size(_value(row, Measure.ORTHONORMALITY))])
    return Table(header, body, f"{scene}: largest relative drift at the scene's step, and its slope", Style.FILTERED)


_ERRORS = ((Measure.ATTITUDE_MAX, "rad"), (Measure.ATTITUDE_FINAL, "rad"), (Measure.RATES_MAX, "relative"))


def accuracy(table: pd.DataFrame, scene: str) -> Table:
    """Return errors of attitude and rates at the paper's steps: the scene's own, a half and a quarter of it."""
    rows = of_study(table, paper.STUDY.name, scene)
    rows = rows[rows["measure"].isin([measure.text for measure, _ in _ERRORS])]
    steps = sorted(rows["dt"].unique(), reverse=True)
    wide = rows.pivot_table(index="name", columns=["measure", "dt"], values="value", sort=False)
    header = ["method", *(f"{measure}, {unit}, dt {step:g}" for measure, unit in _ERRORS for step in steps)]
    keys = [(measure.text, step) for measure, _ in _ERRORS for step in steps]
    body: list[Row] = [[name, *(size(float(row.get(key, math.nan))) for key in keys)] for name, row in _lines(wide, *keys)]
    return Table(header, body, f"{scene}: error of attitude and rates", Style.FILTERED)


def order(attitude: pd.DataFrame, rates: pd.DataFrame, scene: str) -> Table:
    """Return observed orders of attitude and rates, from `lines.fits`, and the window of steps of the attitude's fit."""
    header = ["method", "order, attitude", "order, rates", "fit window, s", "points", "floor, rad"]
    of_rates = {str(fit["name"]): numeric(fit["slope"], str(fit["text"])) for _, fit in rates.iterrows()}
    body: list[Row] = []
    for _, fit in attitude.iterrows():
        window = [f"{fit['coarse']:.3g} to {fit['fine']:.3g}", str(int(fit["points"]))]
        slopes = numeric(fit["slope"], str(fit["text"])), of_rates.get(str(fit["name"]), DASH)
        body.append(
            [str(fit["name"]), *slopes, *([str(fit["reason"]), DASH] if fit["reason"] else window), numeric(fit["floor"])]
        )
    return Table(header, body, f"{scene}: observed order", Style.FILTERED)


_TIMES = (
    (Measure.TIME_PER_STEP, 1e9, "step, ns, min"),
    (Measure.TIME_PER_STEP_MEDIAN, 1e9, "median"),
    (Measure.TIME, 1e6, "simulated second, µs, min"),
    (Measure.TIME_MEDIAN, 1e6, "median"),
    (Measure.PREPARE, 1e3, "prepare, ms"),
    (Measure.FIRST_CALL, 1e3, "first call, ms"),
)


def time(table: pd.DataFrame, scene: str) -> Table:
    """Return wall times at the scene's step: minimum and median of interleaved rounds, and the costs before the first step."""
    rows = of_measure(of_study(table, speed.STUDY.name, scene), Measure.TIME)
    details = rows.set_index("name")["detail"]
    header = ["method", f"steps of {DEFAULT_METHOD}", *(title for _, _, title in _TIMES), "timed"]
    ranked = _lines(_wide(table, speed.STUDY.name, scene), (Measure.TIME.text, ""))
    unit = next((_value(row, Measure.TIME_PER_STEP) for name, row in ranked if name == DEFAULT_METHOD), math.nan)
    body: list[Row] = []
    for name, row in ranked:
        values = _value(row, Measure.TIME_PER_STEP) / unit, *(_value(row, measure) * scale for measure, scale, _ in _TIMES)
        body.append([name, *(numeric(value, digits=3) for value in values), str(details.get(name, ""))])
    return Table(header, body, f"{scene}: wall time at the scene's step", Style.FILTERED)


def conservation(table: pd.DataFrame, scene: str) -> Table:
    """Return the drift of every quantity with every method in the long runs, the best methods first, and the outcomes.

    Orthonormality counts as a quantity.
    """
    rows = of_study(table, long_runs.STUDY.name, scene)
    rows = rows[rows["measure"].isin([Measure.DRIFT_MAX.text, Measure.ORTHONORMALITY.text])]
    rows = rows.assign(quantity=rows["quantity"].mask(rows["quantity"] == "", "orthonormality"))
    quantities = list(rows["quantity"].unique())

    def rank(members: pd.DataFrame) -> tuple[bool, float]:
        return bool(members["value"].isna().any()), float(members["value"].max())  # complete runs, then the largest drift

    body: list[Row] = []
    for members in sorted((group for _, group in rows.groupby("method", sort=False)), key=rank):
        values = members.set_index("quantity")["value"]
        cells = [grade(float(values.get(quantity, math.nan))) for quantity in quantities]
        body.append([str(members["name"].iloc[0]), *cells, outcome_cell(outcomes(members)[0])])
    return Table(["method", *quantities, "run"], body, f"{scene}: largest drift in long runs", Style.FILTERED)
