"""The third screen of a report: energy and momentum over time, and the polhodes, of the methods of the first screen."""

from __future__ import annotations

from collections.abc import Sequence

from conservative.benchmarks.studies import long_runs, motion
from conservative.method import Method
from conservative.scene import Scene

from ..charts import figures, spheres, vega_embed
from ..charts.style import families_of
from ..document.model import Emphasis, Figure, Layout, Paragraph, Section, filled
from ..rows import lines
from .measured import Measured, of_scene
from .tumbling import Result, drawn

_WHY = (
    "Each step changes energy and momentum a little, and in most methods these changes add up. Smaller steps delay the drift "
    "but do not end it. Methods that conserve stay on the middle line at any step."
)


def section(measured: Measured, found: Sequence[Result]) -> Section:
    """Return the section, about the methods of `tumbling.results`."""
    scene, methods = measured.main_scene, drawn(found)
    drifts = of_scene(lines.signed_drifts(measured.samples), scene.name)
    drifts = drifts[drifts["method"].isin(methods) | ~drifts["method"].isin(m.name for m in _competitors(measured))]
    figure = Figure(
        "drift",
        f"{scene.name}: change of energy and momentum in {long_runs.DURATIONS * scene.t_end:.3g} s",
        "Middle line: exact. Above it a method gains, below it loses. The axis is logarithmic on both sides of it.",
        panels=vega_embed.embed(figures.signed_drift(drifts), ("name", "t", "drift"), 260),
        legend=vega_embed.legend(families_of(drifts), marks=False),
        layout=Layout.PAIRS,
    )
    blocks = filled(Paragraph(_WHY, Emphasis.LEAD), figure if len(drifts) else None, spheres_figure(measured, scene, methods))
    return Section("Where drift comes from", blocks, "drift", "Drift")


def spheres_figure(measured: Measured, scene: Scene, methods: Sequence[str] | None = None) -> Figure | None:
    """Return the curves of a scene, a sphere each, of all methods or of some next to the exact one; None without curves."""
    curves = of_scene(lines.curves(measured.samples), scene.name)
    competitors = {method.name for method in _competitors(measured)}
    if methods is not None:
        curves = curves[curves["method"].isin(methods) | ~curves["method"].isin(competitors)]
    if curves.empty:
        return None
    title, words = "trace of the axis on the unit sphere", "The axis in space. Drift makes the curve wander or widen."
    if scene.free:
        title = "polhode on the momentum sphere"
        words = "The angular momentum in body axes. The exact curve is closed; drift widens it or leaves the sphere."
    absent = ", ".join(sorted(competitors - set(curves["method"]))) if methods is None else ""
    failed = f" Not drawn, as they fail or do not support the scene: {absent}." if absent else ""
    name = f"sphere_{scene.name}" if methods is None else "polhodes"
    panels = [spheres.chart(curve) for _, curve in curves.groupby("name", sort=False)]
    return Figure(name, f"{scene.name}: {title}", words + failed, panels=panels, layout=Layout.SPHERES)


def _competitors(measured: Measured) -> list[Method]:
    return motion.select_methods((*measured.plan.methods, *measured.plan.engines))
