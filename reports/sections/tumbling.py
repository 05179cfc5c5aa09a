"""The first screen of a report: one motion in the exact solution, in engines and in our methods, and how wrong each is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from conservative.benchmarks.contest import cheapest, costs
from conservative.benchmarks.measures.errors import CONSERVED, SMALL
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import convergence, motion, speed
from conservative.method import Role
from conservative.outcome import Outcome
from conservative.scene import Scene

from ..document.attempt import attempt
from ..document.cells import DASH, grade, number, numeric, outcome_cell, tolerance
from ..document.model import Block, Cell, Emphasis, Motion, Paragraph, Row, Section, Table, filled
from ..rows import lines
from ..rows.names import MethodClass, of_classes, of_measure, of_study, outcomes
from .hard_cases import RIGHT, USABLE
from .measured import Measured, of_scene
from .summary import MIDDLE

STUDIES = tuple(each.STUDY.name for each in (motion, convergence, speed))
"""Studies of the section."""
PAPER_MAP = "reduced"
MOST = 8
"""Largest number of motions next to each other, with the exact one."""


@dataclass(frozen=True)
class Result:
    """The run of a method: largest drifts (relative) and attitude error (rad), order, and time per step (s); NaN if unknown.

    `name` has the tolerance of an adaptive method, `line` has not.
    """

    method: str
    name: str
    line: str
    ours: bool
    dt: float
    outcome: Outcome
    energy: float
    momentum: float
    error: float
    order: float
    time: float


def results(measured: Measured) -> list[Result]:
    """Return the results on the main scene: engines, the largest error first, then the paper's map and our fastest method."""
    scene = measured.main_scene.name
    rows, here = of_study(measured.rows, motion.STUDY.name, scene), measured.rows[measured.rows["scene"] == scene]
    points = of_scene(measured.points, scene)
    best = cheapest(of_classes(costs(points, [MIDDLE]), MethodClass.GENERAL))
    families = {PAPER_MAP, *points[points["name"] == (best.name if best else "")]["family"]}
    orders, times = lines.orders(here), of_measure(here, Measure.TIME_PER_STEP).groupby("method")["value"].last()
    found = []
    for method, run in rows[(rows["role"] == Role.ENGINE) | rows["family"].isin(families)].groupby("method", sort=False):
        drifts = run[run["measure"] == Measure.DRIFT_MAX.text]
        name, line, role, dt = run[["name", "line", "role", "dt"]].iloc[0]
        values = [drifts[drifts["quantity"].str.contains(part)]["value"].max() for part in ("energy", "moment")]
        values += [of_measure(run, Measure.ATTITUDE_MAX)["value"].max()]
        values += [known.get(method, math.nan) for known in (orders, times)]
        found.append(Result(str(method), name, line, role != Role.ENGINE, dt, outcomes(run)[0], *map(float, values)))
    return sorted(found, key=lambda each: (each.ours, math.isnan(each.error), -each.error))


def drawn(found: Sequence[Result]) -> list[str]:
    """Return the methods that the first screens draw: those that ran, without the most accurate engines if there are many."""
    engines, ours = ([each.method for each in found if each.outcome.ok and each.ours is side] for side in (False, True))
    return [*engines[: MOST - 1 - len(ours)], *ours]


def section(measured: Measured, found: Sequence[Result]) -> Section:
    """Return the section, from the `results`."""
    scene = measured.main_scene
    subject = "a tumbling brick" if scene.name == "brick_flip" else scene.name
    moving = attempt(f"The animation of {scene.name}", lambda: animation(measured, scene, found))
    lead = Paragraph(_sentence(found, scene), Emphasis.LEAD)
    blocks = filled(lead, *([moving] if isinstance(moving, Paragraph) else moving), table(found, scene))
    source = {"study": STUDIES, "scene": scene.name}
    return Section(f"What happens to {subject}", blocks, "motion", "Motion", source=source)


def animation(measured: Measured, scene: Scene, found: Sequence[Result]) -> list[Block]:
    """Return the animation of the exact motion and of the `drawn` results, and its legend; nothing without samples."""
    motions = lines.trajectories(measured.samples, scene)
    names, values = {each.method: each.line for each in found}, lines.largest_values(measured.samples, scene)
    truth = set(measured.samples[measured.samples["role"] == Role.TRUTH]["method"])
    exact = [method for method in motions if method in truth]
    shown = [*exact, *(method for method in drawn(found) if method in motions)]
    if not shown:
        return []
    signs = "Grey: exact. Arrow: angular momentum. Line: a body axis. Numbers: largest so far."
    if exact and (end := motions[exact[0]].t[-1]) < scene.t_end * (1 - 1e-9):
        signs += f" Only the first {end:.3g} s are drawn, because the body turns too often."
    labels = [names.get(name, "exact") for name in shown]
    motion = Motion([motions[name] for name in shown], labels, 0 if exact else None, [values.get(name) for name in shown])
    return [motion, Paragraph(signs, Emphasis.NOTE)]


def _sentence(found: Sequence[Result], scene: Scene) -> str:
    engines, ours = ([each for each in found if each.outcome.ok and each.ours is side] for side in (False, True))
    parts, others = [], dict[str, float]()
    if engines:
        worst = engines[0]
        energy = f"{100 * worst.energy:.2g} %" if worst.energy > SMALL else f"{number(worst.energy, 1)} of it"
        wrong = f"is wrong by {number(worst.error)} rad ({math.degrees(worst.error):.2g}°)"
        parts.append(f"In {scene.t_end:.3g} s, the attitude of {worst.line} {wrong} and its energy changes by {energy}.")
        family = [each for each in engines[1:] if each.method.partition(":")[0] == worst.method.partition(":")[0]]
        others = {each.line: each.error for each in (*family[-1:], *engines[1:][-1:])}  # its best setting, the best engine
    if ours:
        best = min(ours, key=lambda each: each.error)
        others[f"`{best.method}` of the Python package `conservative`"] = best.error
    if others:
        first, *rest = (f"{name} {{}}by {number(error)} rad" for name, error in others.items())
        parts.append(", ".join([first.format("is wrong "), *(each.format("") for each in rest)]) + ".")
    return " ".join(parts)


def table(found: Sequence[Result], scene: Scene) -> Table:
    """Return the results as a table with grades."""
    drift = f"✓ to {tolerance(CONSERVED)}, ✗ above {tolerance(SMALL)}"
    header = ["method", "step, s", f"energy drift ({drift})", f"momentum drift ({drift})"]
    header += [f"attitude error, rad (✓ to {tolerance(RIGHT)}, ✗ above {USABLE:g})", "order", "µs per step"]
    rows: list[Row] = []
    for each in found:
        step = numeric(each.dt) if each.name == each.line else Cell("adaptive", value=math.nan)
        if not each.outcome.ok:
            rows.append([each.name, step, outcome_cell(each.outcome), *[DASH] * 4])
            continue
        drifts = (grade(value) for value in (each.energy, each.momentum))
        order = numeric(each.order, DASH if math.isnan(each.order) else f"{each.order:.1f}")
        error = grade(each.error, limits=(RIGHT, USABLE))
        rows.append([each.name, step, *drifts, error, order, numeric(1e6 * each.time)])
    moments, rate = ", ".join(f"{each:.3g}" for each in scene.body.moments), np.linalg.norm(scene.w_WB_B0)
    caption = f"Largest values over {scene.t_end:.3g} s. Moments of inertia: {moments} kg m²; initial rate: {rate:.3g} rad/s. "
    caption += f"Step: the engine's default, or {scene.dt:g} s if it has none."
    if ours := [each.line for each in found if each.ours]:
        caption += f" Ours: {' and '.join(ours)}."
    if still := [each.line for each in found if each.energy <= CONSERVED and each.momentum <= CONSERVED and each.error > RIGHT]:
        caption += f" Conservation is not accuracy: {still[0]} conserves both, and its attitude is wrong."
    caption += f" Order: the error falls as step^order, down to round-off ({DASH}: adaptive steps, or an uncertain fit)."
    return Table(header, rows, caption)
