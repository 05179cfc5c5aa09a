"""The third screen of a report: energy and momentum over time, and the polhodes, of the methods of the first screen."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import pandas as pd

from conservative.benchmarks.studies import motion
from conservative.scene import Scene

from ..charts import figures, spheres, vega_embed
from ..charts.style import families_of
from ..document.attempt import attempt
from ..document.model import Emphasis, Figure, Layout, Paragraph, Section, filled
from ..rows import lines
from .measured import Measured, of_scene
from .tumbling import Result, drawn

_WHY = (
    "A step of most methods follows the equations to some order. What it leaves out changes energy and momentum, often in the "
    "same direction in each step, and adds up. Smaller steps or tolerances reduce it, down to round-off. Methods that are "
    "built to conserve stay on the middle line with large steps, too."
)


def section(measured: Measured, results: Sequence[Result]) -> Section:
    """Return the section, about the methods of `tumbling.results`."""
    scene, methods = measured.main_scene, drawn(results)
    draw = {"The chart of drift": drift_figure, "The curves on spheres": spheres_figure}
    drawings = [attempt(what, partial(make, measured, scene, methods)) for what, make in draw.items()]
    return Section("Where drift comes from", filled(Paragraph(_WHY, Emphasis.LEAD), *drawings), "drift", "Drift")


def drift_figure(measured: Measured, scene: Scene, methods: Sequence[str] | None = None) -> Figure | None:
    """Return the drift over time on a scene, of all methods or of some next to the exact motion; None without samples."""
    invariants = [invariant.name for invariant in scene.invariants]
    drifts = _select(measured, lines.signed_drifts(measured.samples, scene.name, invariants), methods)
    if drifts.empty:
        return None
    picture = figures.signed_drift(drifts)
    return Figure(
        f"drift_{scene.name}" if methods is None else "drift_over_time",
        f"{scene.name}: change of energy and momentum in {drifts['t'].max():.3g} s",
        f"Step: the engine's default, or {scene.dt:g} s if it has none. Middle line: exact. Above it a method gains, below it "
        f"loses. The axis is logarithmic on both sides of it.{_why_early(drifts)}",
        picture if methods is None else None,
        vega_embed.embed(picture, ("name", "t", "drift"), 260),
        vega_embed.legend(families_of(drifts), marks=False),
        Layout.PAIRS,
    )


def _why_early(drifts: pd.DataFrame) -> str:
    """Return why lines end before the others; empty if none does."""
    ends = lines.early_ends(drifts)
    parts = []
    if lines.EXACT in ends:
        parts.append(f"The exact motion is drawn for one duration, {ends.pop(lines.EXACT):.3g} s.")
    if ends:
        names = ", ".join(f"{name} ({end:.3g} s)" for name, end in ends.items())
        parts.append(f"Lines that end early: {names}. Longer runs failed, exceed the time budget, or have too many samples.")
    return "".join(f" {part}" for part in parts)


def spheres_figure(measured: Measured, scene: Scene, methods: Sequence[str] | None = None) -> Figure | None:
    """Return the curves of a scene, a sphere each, of all methods or of some next to the exact one; None without curves."""
    curves = _select(measured, of_scene(lines.curves(measured.samples), scene.name), methods)
    if curves.empty:
        return None
    title, text = "trace of the axis on the unit sphere", "The axis in space. Drift makes the curve wander or widen."
    if scene.free:
        title = "polhode on the momentum sphere"
        text = "The angular momentum in body axes. Line: the exact curve, which is closed. Drift leaves it, or the sphere."
    absent = "" if methods else ", ".join(sorted(_competitors(measured) - set(curves["method"])))
    failed = f" Not drawn, as they fail or do not support the scene: {absent}." if absent else ""
    name = f"sphere_{scene.name}" if methods is None else "polhodes"
    exact = spheres.polhode(scene)
    panels = [spheres.chart(curve, exact) for _, curve in curves.groupby("name", sort=False)]
    return Figure(name, f"{scene.name}: {title}", text + failed, panels=panels, layout=Layout.SPHERES)


def _competitors(measured: Measured) -> set[str]:
    return {method.name for method in motion.select_methods((*measured.plan.methods, *measured.plan.engines))}


def _select(measured: Measured, rows: pd.DataFrame, methods: Sequence[str] | None) -> pd.DataFrame:
    """Return the rows of some methods and of the exact motion, or of all methods."""
    return rows if methods is None else rows[rows["method"].isin(methods) | ~rows["method"].isin(_competitors(measured))]
