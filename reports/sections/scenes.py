"""One scene: work against precision, drift, convergence, wall time, and the motion itself."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import long_runs, sphere_curves, step_ladder
from conservative.deferred_imports import DEFAULT_METHOD
from conservative.scene import Scene

from ..charts import figures, spheres, vega_embed
from ..charts.style import colours, families_of
from ..document.cells import CONSERVED, DASH, SMALL, grade_drift, number, outcome_cell, tolerance
from ..document.model import Block, Emphasis, Figure, Layout, LegendEntry, Paragraph, Row, Section, Style, Table, filled
from ..rows import lines
from ..rows.names import of_measure, of_study, outcomes, without_solutions
from ..rows.points import front, under
from . import scene_contests
from .measured import Measured, long_run_drifts, of_scene, scenes_in_trouble
from .summary import Summary
from .summary import of_scene as summary_of_scene


def summarize(measured: Measured, scene: Scene) -> Summary:
    """Return the summary of a scene."""
    return summary_of_scene(
        _points(measured, scene),
        of_scene(measured.long_drifts, scene.name),
        of_scene(scenes_in_trouble(measured.scene_rows), scene.name),
        scene.integrable,
        scene_contests.each_step(measured.scene_rows, scene.name),
    )


def section(measured: Measured, scene: Scene, summary: Summary) -> Section:
    """Return the section of a scene."""
    name, rows = scene.name, measured.scene_rows
    errors = of_scene(lines.errors(rows, Measure.ATTITUDE_MAX), name)
    fits, rate_fits = (lines.fits(found) for found in (errors, of_scene(lines.errors(rows, Measure.RATES_MAX), name)))
    contests = scene_contests.as_table(_points(measured, scene), _interval(scene), scene_contests.each_step(rows, name))
    sample = f"A sample is one of {step_ladder.SAMPLES} in the duration; in the last rows, each of the scene's own steps."
    classes = replace(summary.classes, caption=f"{name}: µs of computing per simulated second, by class of methods")
    decades = replace(contests, caption=f"{name}: fastest of each class at each decade of the error")
    drift_words = (
        f"Largest drift over {long_runs.DURATIONS:g} durations, relative (✓ up to {tolerance(CONSERVED)}, ≈ up to "
        f"{tolerance(SMALL)}, ✗ more). The picture shows zero as 1e-17."
    )
    order_words = (
        "Fit of log(error) over log(step), with standard error, between the steps that are too large to converge and the "
        "round-off floor. Errors are relative to the reference solution: the attitude error is the angle of R_ref' R, "
        "the error of the rates is relative to the largest exact |ω|."
    )
    time_words = (
        "Time of the method's own loop at the scene's step, final state only. \"prepare\" is the conversion of the scene with "
        'compiled code available, and "first call" the first run after that. The first column of numbers is the time per step '
        f"relative to `{DEFAULT_METHOD}`."
    )
    work: list[Block] = [_work_figure(measured, scene, summary), classes]
    if decades.rows:
        work.append(Section("Each decade of error", [Paragraph(sample), decades], folded=True))
    drifts = filled(_drift_figure(measured, name), Paragraph(drift_words), conservation(rows, name))
    curves = _sphere_figure(measured, scene)
    return Section(
        name,
        filled(
            Paragraph(summary.sentence, Emphasis.LEAD),
            Paragraph(f"{scene.source}{'. ' * bool(scene.source)}{scene.t_end:g} s; the scene's own step is {scene.dt:g} s."),
            Section("Work against precision", work),
            Section("Drift over time", drifts),
            Section("Drift at the scene's own step", filled(drift(rows, name)), folded=True),
            Section("Convergence", [_convergence_figure(errors, fits, name), Paragraph(order_words)]),
            Section("Orders and errors as tables", filled(order(fits, rate_fits, name), accuracy(rows, name)), folded=True),
            Section("Wall time", [Paragraph(time_words), time(rows, name)]),
            Section("The motion itself", [curves]) if curves else None,
        ),
        name,
    )


def _interval(scene: Scene) -> float:
    """Return the time between two samples that errors are read at, s."""
    return scene.t_end / step_ladder.SAMPLES


def _points(measured: Measured, scene: Scene) -> pd.DataFrame:
    points = of_scene(measured.points, scene.name)
    return points.assign(sample=points["time"] * _interval(scene))


def families_figure(summary: Summary, name: str, what: str, picture: object = None) -> Figure:
    """Return work against precision with the best of each family; the legend shows the others."""
    points = summary.points
    best = points[~points["single"].astype(bool)]
    members = [(str(line), rows) for line, rows in best.groupby("name", sort=False)]
    hidden = [line for line, _ in members if line not in summary.shown]
    shown = ("name", "setting", "error", "microseconds", *(["within"] if best["within"].any() else ["sample", "dt"]))
    return Figure(
        name,
        f"{what}: computing time against attitude error, the best of each family",
        " ".join(["Lower left is better. Solid: ours, dashed: engines.", *under(members, "error", "time")]),
        picture,
        vega_embed.embed(figures.best_of_families(points), shown, 310, hidden) if len(points) else (),
        [_entry(line, rows, line in summary.shown) for line, rows in members],
        Layout.FAMILIES,
    )


def _entry(line: str, members: pd.DataFrame, shown: bool) -> LegendEntry:
    family, kind = members[["family", "class"]].iloc[0]
    dash = " ".join(map(str, figures.CLASS_DASHES[kind]))
    return LegendEntry(line, colours({line: family})[line], vega_embed.PATHS[figures.CLASS_SHAPES[kind]], dash, shown)


def _work_figure(measured: Measured, scene: Scene, summary: Summary) -> Figure:
    points, name = _points(measured, scene), scene.name
    picture = figures.work_precision(points, front(without_solutions(points)), name)
    return families_figure(summary, f"work_precision_{name}", name, picture)


def _drift_figure(measured: Measured, name: str) -> Figure:
    """Return the drift over time; the page has fewer samples than the picture."""
    drifts = of_scene(lines.drifts(measured.samples), name)
    thin = lines.thin(drifts)
    floored = thin.assign(shown=thin["drift"].clip(lower=figures.FLOOR), panel=thin["quantity"])
    members = [(str(line), rows.sort_values(["panel", "t"])) for line, rows in floored.groupby("name", sort=False)]
    return Figure(
        f"drift_{name}",
        f"{name}: drift over time",
        " ".join(["Each quantity has a panel: a level line is conserved, a rising one drifts.", *under(members, "t", "shown")]),
        figures.drift(drifts, name),
        vega_embed.embed(figures.drift(thin, name), ("name", "t", "drift"), 220),
        vega_embed.legend(families_of(drifts), marks=False),
        Layout.PAIRS,
    )


def _convergence_figure(errors: pd.DataFrame, fits: pd.DataFrame, name: str) -> Figure:
    named = lines.with_slopes(errors, fits)
    picture = figures.convergence(named, lines.fit_ends(lines.with_slopes(fits, fits)), name)
    return Figure(
        f"convergence_{name}",
        f"{name}: attitude error against step",
        "In parentheses the fitted slope with its standard error; the bold stretch shows the fit.",
        picture,
        vega_embed.embed(picture, ("name", "dt", "error"), 520),
        vega_embed.legend(families_of(named), marks=True),
    )


_POLHODE = (
    "polhode on the momentum sphere",
    "The angular momentum in body axes. The exact one is closed: a drift makes it a band, or leaves the sphere.",
)
_TRACE = (
    "trace of the axis on the unit sphere",
    "The axis in space. A band wider than the exact one shows a long step, a wandering one drift.",
)


def _sphere_figure(measured: Measured, scene: Scene) -> Figure | None:
    """Return the curves of a scene, a sphere each; None without that study."""
    curves = of_scene(lines.curves(measured.samples), scene.name)
    if curves.empty:
        return None
    kind, words = _POLHODE if scene.free else _TRACE
    wanted = sphere_curves.select_methods(measured.plan.methods)
    absent = ", ".join(method.name for method in wanted if method.name not in set(curves["method"]))
    failed = f" Not drawn, as they fail or do not support the scene: {absent}." if absent else ""
    summary = f"At the scene's own step, over {long_runs.DURATIONS:g} durations. {words}{failed}"
    panels = [spheres.chart(curve) for _, curve in curves.groupby("name", sort=False)]
    return Figure(f"sphere_{scene.name}", f"{scene.name}: {kind}", summary, panels=panels, layout=Layout.SPHERES)


def _wide(table: pd.DataFrame, study: str, scene: str) -> pd.DataFrame:
    """Return the values of a study at the scene's step: a row a method, ours first, and a column (measure, quantity)."""
    rows = of_study(table, study, scene)
    rows = rows[rows["dt"] == rows.groupby("method")["dt"].transform("max")]
    return rows.pivot_table(index="name", columns=["measure", "quantity"], values="value", sort=False)


def _by_name(values: pd.DataFrame) -> list[tuple[str, pd.Series[float]]]:
    return [(str(name), row) for name, row in values.iterrows()]


def _ranked(values: pd.DataFrame, *columns: tuple[str, object]) -> list[tuple[str, pd.Series[float]]]:
    """Return the lines by columns, the smallest first, those without it last: ours and the engines' among each other."""

    def rank(line: tuple[str, pd.Series[float]]) -> list[tuple[bool, float]]:
        numbers = (float(line[1].get(column, math.nan)) for column in columns)
        return [(math.isnan(number), number) for number in numbers]

    return sorted(_by_name(values), key=rank)


def _value(row: pd.Series[float], measure: Measure, quantity: str = "") -> float:
    return float(row.get((measure.text, quantity), math.nan))


def drift(table: pd.DataFrame, scene: str) -> Table:
    """Return the drift of every invariant at the scene's step, its slope over time, and the error of orthonormality."""
    values = _wide(table, "paper", scene)
    invariants = [column[1] for column in values.columns if column[0] == Measure.DRIFT_MAX.text]
    header = ["method", *(f"{name}{part}" for name in invariants for part in ("", ", 1/s")), "orthonormality"]
    body = [
        [name, *_drift_cells(row, invariants), number(_value(row, Measure.ORTHONORMALITY))] for name, row in _by_name(values)
    ]
    return Table(header, body, f"{scene}: largest relative drift at the scene's step, and its slope", Style.FILTERED)


def _drift_cells(row: pd.Series[float], invariants: Iterable[str]) -> Iterator[str]:
    for name in invariants:
        slope, error = _value(row, Measure.DRIFT_SLOPE, name), _value(row, Measure.DRIFT_SLOPE_STDERR, name)
        yield number(_value(row, Measure.DRIFT_MAX, name))
        yield f"{number(slope)} ± {number(error, 1)}"


_ERRORS = ((Measure.ATTITUDE_MAX, "rad"), (Measure.ATTITUDE_FINAL, "rad"), (Measure.RATES_MAX, "relative"))


def accuracy(table: pd.DataFrame, scene: str) -> Table:
    """Return errors of attitude and rates at the paper's steps: the scene's own, a half and a quarter of it."""
    rows = of_study(table, "paper", scene)
    rows = rows[rows["measure"].isin([measure.text for measure, _ in _ERRORS])]
    steps = sorted(rows["dt"].unique(), reverse=True)
    wide = rows.pivot_table(index="name", columns=["measure", "dt"], values="value", sort=False)
    header = ["method", *(f"{measure}, {unit}, dt {step:g}" for measure, unit in _ERRORS for step in steps)]
    keys = [(measure.text, step) for measure, _ in _ERRORS for step in steps]
    body = [[name, *(number(row.get(key, math.nan)) for key in keys)] for name, row in _ranked(wide, *keys)]
    return Table(header, body, f"{scene}: error of attitude and rates", Style.FILTERED)


def order(attitude: pd.DataFrame, rates: pd.DataFrame, scene: str) -> Table:
    """Return observed orders of attitude and rates, from `lines.fits`, and the window of steps of the attitude's fit."""
    header = ["method", "order, attitude", "order, rates", "fit window, s", "points", "floor, rad"]
    of_rates = dict(zip(rates["name"], rates["text"], strict=True))
    fits = [fit for _, fit in attitude.iterrows()]
    body = [[str(fit["name"]), str(fit["text"]), str(of_rates.get(fit["name"], DASH)), *_window(fit)] for fit in fits]
    return Table(header, body, f"{scene}: observed order", Style.FILTERED)


def _window(fit: pd.Series[float]) -> list[str]:
    if fit["reason"]:
        return [str(fit["reason"]), DASH, number(fit["floor"])]
    return [f"{fit['coarse']:.3g} to {fit['fine']:.3g}", str(int(fit["points"])), number(fit["floor"])]


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
    values = _wide(table, "speed", scene)
    rows = of_measure(of_study(table, "speed", scene), Measure.TIME)
    details = rows.set_index("name")["detail"]
    header = ["method", f"steps of {DEFAULT_METHOD}", *(title for _, _, title in _TIMES), "timed"]
    ranked = _ranked(values, (Measure.TIME.text, ""))
    unit = next((_value(row, Measure.TIME_PER_STEP) for name, row in ranked if name == DEFAULT_METHOD), math.nan)
    body = [[name, *_times(row, unit), str(details.get(name, ""))] for name, row in ranked]
    return Table(header, body, f"{scene}: wall time at the scene's step", Style.FILTERED)


def _times(row: pd.Series[float], unit: float) -> Row:
    steps = number(_value(row, Measure.TIME_PER_STEP) / unit, 3)
    return [steps, *(number(_value(row, measure) * scale, 3) for measure, scale, _ in _TIMES)]


def conservation(table: pd.DataFrame, scene: str) -> Table:
    """Return the drift of every quantity with every method in the long runs, the best methods first, and the outcomes."""
    rows = long_run_drifts(table)
    rows = rows[rows["scene"] == scene]
    quantities = list(rows["quantity"].unique())
    members = sorted((group for _, group in rows.groupby("method", sort=False)), key=_worst)
    body = [_conservation(group, quantities) for group in members]
    return Table(["method", *quantities, "run"], body, f"{scene}: largest drift in long runs", Style.FILTERED)


def _worst(rows: pd.DataFrame) -> tuple[bool, float]:
    """Return the rank of a method: complete runs first, then the largest drift."""
    return bool(rows["value"].isna().any()), float(rows["value"].max())


def _conservation(rows: pd.DataFrame, quantities: list[str]) -> Row:
    first, values = rows.iloc[0], rows.set_index("quantity")["value"]
    cells = [grade_drift(float(values.get(quantity, math.nan))) for quantity in quantities]
    return [first["name"], *cells, outcome_cell(outcomes(rows)[0])]
