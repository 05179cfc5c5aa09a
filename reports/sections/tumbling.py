"""The first screen of a report: one motion in the exact solution, in engines and in our methods, and how wrong each is."""

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
from .hard_cases import RIGHT, USABLE
from .measured import Measured, of_scene
from .summary import MIDDLE

STUDIES = tuple(module.STUDY.name for module in (motion, convergence, speed))
"""Studies of the section."""
PAPER_MAP = "reduced"
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
    """Return the section, from the `results`."""
    scene = measured.main_scene
    subject = "a tumbling brick" if scene.name == "brick_flip" else scene.name
    moving = attempt(f"The animation of {scene.name}", lambda: animation(measured, scene, results))
    lead = Paragraph(_sentence(results, scene), Emphasis.LEAD)
    blocks = filled(lead, *([moving] if isinstance(moving, Paragraph) else moving), table(results, scene))
    source = {"study": STUDIES, "scene": scene.name}
    return Section(f"What happens to {subject}", blocks, "motion", "Motion", source=source)


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


def _sentence(results: Sequence[Result], scene: Scene) -> str:
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
    header += [f"attitude error, rad (✓ to {tolerance(RIGHT)}, ✗ above {USABLE:g})", "order", "µs per step"]
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
    moments, rate = ", ".join(f"{moment:.3g}" for moment in scene.body.moments), np.linalg.norm(scene.w_WB_B0)
    caption = f"Largest values over {scene.t_end:.3g} s, rounded up. Drifts are relative: ✓ to {tolerance(CONSERVED)}, "
    caption += f"✗ above {tolerance(SMALL)}. Moments of inertia: {moments} kg m²; initial rate: {rate:.3g} rad/s. "
    caption += f"Step: the engine's default, or {scene.dt:g} s if it has none."
    if scene.loaded:
        caption += " A balance counts work and impulse as the method sums them, or as the reference solution does."
    if ours := list(dict.fromkeys(result.family for result in results if result.ours)):
        caption += f" Ours: {listed(ours)}."
    kept = [result for result in results if result.drifts and all(drift <= CONSERVED for drift in result.drifts.values())]
    if still := [result.line for result in kept if result.error > RIGHT]:
        names = listed([invariant.name for invariant in scene.invariants])
        caption += f" Conservation is not accuracy: {still[0]} conserves {names}, and its attitude is wrong."
    caption += f" Order: the error falls as step^order, down to round-off ({DASH}: adaptive steps, or an uncertain fit)."
    return Table(header, rows, caption)
