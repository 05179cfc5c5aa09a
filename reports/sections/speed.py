"""Computing time against attitude error, a line for each family, on every kind of motion.

Two motions are on the first screen of a report, the others behind a click.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from conservative.benchmarks.speed_ratio import costs

from ..charts import figures, vega_embed
from ..charts.style import colours
from ..document.attempt import attempt
from ..document.cells import factor, tolerance
from ..document.model import Emphasis, Figure, Layout, LegendEntry, Paragraph, Section, filled
from ..rows.names import MethodClass, of_classes
from ..rows.points import joined, names_in_turn, under
from . import random_bodies
from .measured import Measured, of_scene
from .summary import CAVEAT, MIDDLE, Summary

FIRST = 2
"""Number of motions whose charts are on the first screen."""
HEIGHT = 230
"""Height of a chart, pixels."""


def pictures(measured: Measured, of_scenes: Mapping[str, Summary]) -> dict[str, pd.DataFrame]:
    """Return the points of each motion by its title: the main scene, random bodies if the report has them, other scenes."""
    motions = {f"{scene.name} ({scene.group})": of_scenes[scene.name].points for scene in measured.plan.scenes}
    main = f"{measured.main_scene.name} ({measured.main_scene.group})"
    first = {main: motions.pop(main)}
    if measured.ratios:
        first[_title(measured)] = random_bodies.summary(measured.rows, measured.ratios).points
    return first | motions


def _drawn(measured: Measured) -> tuple[Any, list[str]]:
    """Return the study of random bodies, and its fields."""
    study = next(study for study in measured.plan.studies if study.drawn)
    return study, list(dict.fromkeys(body.field for body in study.drawn))


def _title(measured: Measured) -> str:
    """Return the title of the chart of random bodies."""
    study, fields = _drawn(measured)
    return f"{len(study.scenes)} random bodies in {len(fields)} fields (geometric mean)"


def first_figure(pictures: Mapping[str, pd.DataFrame]) -> Figure:
    """Return the charts of the first two motions."""
    return figure(dict(list(pictures.items())[:FIRST]), "time_against_error")


def section(measured: Measured, pictures: Mapping[str, pd.DataFrame]) -> Section:
    """Return the section behind the click: what the charts show, and those of the other motions."""
    main = measured.main_scene.name
    sentence = _sentence(main, costs(of_scene(measured.points, main), [MIDDLE]))
    random = "Random bodies are not in this report; `conservative report --bodies 3` adds them."
    if measured.ratios:
        study, fields = _drawn(measured)
        sentence += " " + _sentence(f"{len(study.scenes)} random bodies", pictures[_title(measured)])
        random = f"Random bodies: {measured.plan.bodies} in each field ({', '.join(fields)}), with {len(study.lines)} methods."
        random += " `conservative report --bodies N` measures N in each of five fields, with all methods."
    rough = f" {random_bodies.ROUGH}" if all(study.processes == 1 for study in measured.plan.studies) else ""
    others = dict(list(pictures.items())[FIRST:])
    chart = (
        attempt("The chart of time against error of the other motions", lambda: figure(others, "others")) if others else None
    )
    lead = Paragraph(sentence, Emphasis.LEAD) if sentence else None
    blocks = filled(lead, chart, Paragraph(f"{random} {CAVEAT}{rough}", Emphasis.NOTE))
    return Section("How wrong, how fast", blocks, "speed", "Speed")


def _sentence(subject: str, points: pd.DataFrame) -> str:
    """Return how much faster our fastest general integrator is at `MIDDLE` than the fastest solver and physics engine."""
    at_middle = points[points["error"] == MIDDLE].sort_values("time")
    first: dict[MethodClass, Any] = {kind: next(of_classes(at_middle, kind).itertuples(), None) for kind in MethodClass}
    ours, parts = first[MethodClass.GENERAL], []
    for kind, side in ((MethodClass.SOLVER, "ODE solver"), (MethodClass.ENGINE, "physics engine")):
        if ours and (theirs := first[kind]):
            ratio = theirs.time / ours.time
            more = f"{factor(ratio)} times as fast as" if ratio >= 1 else f"{factor(1 / ratio)} times as slow as"
            parts.append(f"{more} {theirs.name}, the fastest {side}")
    if not (ours and parts):
        return ""
    return f"At an attitude error of {tolerance(MIDDLE)} rad on {subject}, {ours.name} is {', and '.join(parts)}."


def figure(pictures: Mapping[str, pd.DataFrame], name: str) -> Figure:
    """Return time against error, a panel for each motion; the legend lists the other families behind a button."""
    full = {motion: points for motion, points in pictures.items() if len(points)}
    curves = joined(full.values())
    legend = []
    for line in names_in_turn(curves):
        family, kind = curves.loc[curves["name"] == line, ["family", "class"]].iloc[0]
        dash, path = " ".join(map(str, figures.CLASS_DASHES[kind])), vega_embed.PATHS[figures.CLASS_SHAPES[kind]]
        legend.append(LegendEntry(line, colours({line: family})[line], path, dash))
    panels = []
    for motion, points in full.items():
        fields = ("name", "setting", "error", "microseconds", *(["within"] if points["within"].any() else ["sample", "dt"]))
        (panel,) = vega_embed.embed(figures.best_of_families(points), fields, HEIGHT)
        panels.append(panel | {"usermeta": {"name": motion}})
    same = dict.fromkeys(
        sentence
        for points in full.values()
        for sentence in under(((str(name), line) for name, line in points.groupby("name", sort=False)), "error", "time")
    )
    return Figure(
        name,
        "Computing time against attitude error, each method at its fastest settings",
        " ".join(["Lower left is better. Ours: solid, ODE solvers: dashed, engines: dotted.", *same]),
        panels=panels,
        legend=legend,
        layout=Layout.PANELS,
    )
