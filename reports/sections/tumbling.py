"""One motion in the exact solution, in engines and in our methods, and how wrong each is.

The table is on the first screen of a report, the animation behind a click.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from conservative.benchmarks.measures.errors import CONSERVED, SMALL
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.speed_ratio import cheapest, costs
from conservative.benchmarks.studies import convergence, motion, speed
from conservative.invariants import find_energy
from conservative.method import Role
from conservative.outcome import Outcome
from conservative.scene import Scene

from ..document.attempt import attempt
from ..document.cells import DASH, angle, bound, grade, listed, numeric, outcome_cell, tolerance
from ..document.model import Block, Cell, Emphasis, Motion, Paragraph, Row, Section, Table, filled
from ..rows import lines
from ..rows.names import MethodClass, largest_drifts, of_classes, of_measure, of_study, outcomes
from .closing import PAPER_MAP
from .hard_cases import RIGHT, USABLE
from .measured import Measured, of_scene
from .summary import MIDDLE

STUDIES = tuple(module.STUDY.name for module in (motion, convergence, speed))
"""Studies of the section."""
MOST = 8
"""Largest number of motions next to each other, with the exact one."""


@dataclass(frozen=True)
class Result:
    """The run of a method: largest drift of each invariant (relative), attitude error (rad), order, and time per step (s).

    Unknown numbers are NaN. `name` has the tolerance of an adaptive method, `line` has not. `pictured`: charts have its motion.
    """

    method: str
    family: str
    name: str
    line: str
    ours: bool
    pictured: bool
    dt: float
    outcome: Outcome
    drifts: Mapping[str, float]
    error: float
    order: float
    time: float


def results(measured: Measured) -> list[Result]:
    """Return the results on the main scene: engines, the largest error first, then ours.

    If methods are named, they are all. Otherwise the charts have them: engines, the paper's map and our fastest method.
    """
    plan, scene = measured.plan, measured.main_scene
    rows, here = of_study(measured.rows, motion.STUDY.name, scene.name), measured.rows[measured.rows["scene"] == scene.name]
    points = of_scene(measured.points, scene.name)
    best = cheapest(of_classes(costs(points, [MIDDLE]), MethodClass.GENERAL))
    families = {PAPER_MAP, *points[points["name"] == (best.name if best else "")]["family"]}
    orders, times = lines.orders(here), of_measure(here, Measure.TIME_PER_STEP).groupby("method")["value"].last()
    charts = {method.name for method in motion.select_methods((*plan.methods, *plan.engines))}
    few = rows["method"].isin(charts) & ((rows["role"] == Role.ENGINE) | rows["family"].isin(families))
    results = []
    for method, run in rows[few | rows["method"].isin([method.name for method in plan.named])].groupby("method", sort=False):
        family, name, line, role, dt = run[["family", "name", "line", "role", "dt"]].iloc[0]
        values = [of_measure(run, Measure.ATTITUDE_MAX)["value"].max()]
        values += [column.get(method, math.nan) for column in (orders, times)]
        pictured, drifts = bool(few[run.index[0]]), largest_drifts(run, scene)
        numbers = map(float, values)
        results.append(
            Result(str(method), family, name, line, role != Role.ENGINE, pictured, dt, outcomes(run)[0], drifts, *numbers)
        )
    return sorted(results, key=lambda result: (result.ours, math.isnan(result.error), -result.error))


def drawn(results: Sequence[Result]) -> list[str]:
    """Return the methods that the first screens draw: those that ran, without the most accurate engines if there are many."""
    shown = [result for result in results if result.outcome.ok and result.pictured]
    engines, ours = ([result.method for result in shown if result.ours is side] for side in (False, True))
    return [*engines[: MOST - 1 - len(ours)], *ours]


def section(measured: Measured, results: Sequence[Result]) -> Section:
    """Return the first section of a report, from the `results`."""
    scene = measured.main_scene
    subject = "a tumbling brick" if scene.name == "brick_flip" else scene.name
    blocks = filled(Paragraph(sentence(results, scene), Emphasis.LEAD), table(results, scene))
    return Section(f"What happens to {subject}", blocks, "results", "Results", source={"study": STUDIES, "scene": scene.name})


def motion_section(measured: Measured, results: Sequence[Result]) -> Section:
    """Return the section with the animation, and the explanation of the table of the first section."""
    scene = measured.main_scene
    moving = attempt(f"The animation of {scene.name}", lambda: animation(measured, scene, results))
    explained = Paragraph(explanation(results, scene))
    blocks = filled(*([moving] if isinstance(moving, Paragraph) else moving), explained)
    return Section("The motion, and what the first table means", blocks, "motion", "Motion")


def animation(measured: Measured, scene: Scene, results: Sequence[Result]) -> list[Block]:
    """Return the animation of the exact motion and of the `drawn` results, and its legend; nothing without samples."""
    motions = lines.trajectories(measured.samples, scene)
    names, values = {result.method: result.line for result in results}, lines.largest_values(measured.samples, scene)
    truth = set(measured.samples[measured.samples["role"] == Role.TRUTH]["method"])
    exact = [method for method in motions if method in truth]
    shown = [*exact, *(method for method in drawn(results) if method in motions)]
    if not shown:
        return []
    signs = "Grey: exact. Arrow: angular momentum. Line: a body axis. Numbers: largest so far."
    if exact and (end := motions[exact[0]].t[-1]) < scene.t_end * (1 - 1e-9):
        signs += f" Only the first {end:.3g} s are drawn, because the body turns too often."
    labels = [names.get(name, lines.EXACT) for name in shown]
    motion = Motion([motions[name] for name in shown], labels, 0 if exact else None, [values.get(name) for name in shown])
    return [motion, Paragraph(signs, Emphasis.NOTE)]


def sentence(results: Sequence[Result], scene: Scene) -> str:
    """Return the largest error and change of energy, and the errors at both ends of what is compared.

    They belong to this engine, to the most accurate engine, and to our methods, each at its worst and at its best setting.
    """
    compared = [result for result in results if result.outcome.ok and not math.isnan(result.error)]
    if not compared and any(result.outcome.ok for result in results):
        return f"The attitude errors on {scene.name} are not known: no reference solution is confirmed by another one."
    engines, ours = ([result for result in compared if result.ours is side] for side in (False, True))
    parts, others = [], dict[str, float]()
    if engines:
        worst, best = engines[0], engines[-1]
        wrong = f"is wrong by {angle(worst.error)} rad ({bound(math.degrees(worst.error))}°)"
        energy = find_energy(scene.invariants)
        change = worst.drifts[energy.name] if energy else math.nan
        size = f"{bound(100 * change)} %" if change > SMALL else f"{bound(change, 1)} of it"
        changes = "" if math.isnan(change) else f" and its {energy.name if energy else ''} changes by {size}"
        parts.append(f"In {scene.t_end:.3g} s, the attitude of {worst.line} {wrong}{changes}.")
        for family in dict.fromkeys((worst.family, best.family)):
            settings = [engine for engine in engines if engine.family == family]
            others |= {result.line: result.error for result in (settings[0], settings[-1]) if result is not worst}
    ours = sorted(ours, key=lambda result: result.error)
    for result, name in zip((*ours[:1], *ours[1:][-1:]), (" of the Python package `conservative`", ""), strict=False):
        others[f"`{result.method}`{name}"] = result.error
    if others:
        first, *rest = (f"{name} {{}}by {angle(error)} rad" for name, error in others.items())
        parts.append(", ".join([first.format("is wrong "), *(part.format("") for part in rest)]) + ".")
    return " ".join(parts)


def table(results: Sequence[Result], scene: Scene) -> Table:
    """Return the results as a table with grades."""
    header = ["method", "step, s", *(f"drift of {invariant.name}" for invariant in scene.invariants)]
    header += ["attitude error, rad", "order", "µs per step"]
    rows: list[Row] = []
    failed: dict[tuple[str, str], list[Result]] = {}
    for result in results:
        step = numeric(result.dt) if result.name == result.line else Cell("adaptive", value=math.nan)
        if not result.outcome.ok:
            failed.setdefault((result.family, str(result.outcome)), []).append(result)
            continue
        order = numeric(result.order, DASH if math.isnan(result.order) else f"{result.order:.1f}")
        error = grade(result.error, angle(result.error), (RIGHT, USABLE))
        rows.append([result.name, step, *map(grade, result.drifts.values()), error, order, numeric(1e6 * result.time)])
    for alike in failed.values():  # settings that failed in the same way share a row
        names, reason = ", ".join(result.name for result in alike), outcome_cell(alike[0].outcome, reason=True)
        rows.append([names, DASH, reason, *[DASH] * (len(header) - 3)])
    when = f"at the engine's default step, or {scene.dt:g} s if it has none"
    caption = f"Largest errors and relative drifts in {scene.t_end:.3g} s, rounded up, {when}."
    return Table(header, rows, caption)


def explanation(results: Sequence[Result], scene: Scene) -> str:
    """Return what the marks and the columns of the table mean, and what its motion is."""
    moments, rate = ", ".join(f"{moment:.3g}" for moment in scene.body.moments), np.linalg.norm(scene.w_WB_B0)
    parts = [f"Moments of inertia: {moments} kg m²; initial rate: {rate:.3g} rad/s."]
    parts.append(f"A drift is marked ✓ to {tolerance(CONSERVED)} and ✗ above {tolerance(SMALL)}.")
    parts.append(f"An attitude error is marked ✓ to {tolerance(RIGHT)} rad and ✗ above {USABLE:g} rad.")
    if scene.loaded:
        parts.append("A balance counts work and impulse as the method sums them, or as the reference solution does.")
    if ours := list(dict.fromkeys(result.family for result in results if result.ours)):
        parts.append(f"Ours: {listed(ours)}.")
    kept = [result for result in results if result.drifts and all(drift <= CONSERVED for drift in result.drifts.values())]
    if still := [result.line for result in kept if result.error > RIGHT]:
        names = listed([invariant.name for invariant in scene.invariants])
        parts.append(f"Conservation is not accuracy: {still[0]} conserves {names}, and its attitude is wrong.")
    parts.append(f"Order: the error falls as step^order, down to round-off ({DASH}: adaptive steps, or an uncertain fit).")
    return " ".join(parts)
