"""The verdict of a report: the first figure and table, and the cases in which an engine is faster."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ..document.model import Item, Items, Paragraph, Role, Section, filled
from . import headline, random_bodies
from . import summary as summaries
from .measured import Measured
from .scene_contests import each_step
from .scenes import families_figure
from .summary import Summary


def section(measured: Measured, of_scenes: dict[str, Summary]) -> Section:
    """Return the section: about random bodies if the report has some, else about a scene, if possible without a closed form."""
    if measured.ratios:
        about = "Random bodies"
        summary = random_bodies.summary(measured.rows, measured.ratios, measured.long_drifts)
    else:
        about = min(measured.plan.scenes, key=lambda scene: scene.integrable).name
        summary = of_scenes[about]
    source = measured.source
    together = (
        "within one study of this report, which was interrupted and resumed"
        if source.resumed
        else "within this report: they were measured in interleaved rounds of one process"
    )
    quick = " This is a quick run: fewer steps, fewer rounds of timing." if measured.plan.quick else ""
    beaten = Section("Where an engine beats us", [Paragraph(_BEATEN), Items(list(_statements(measured)))])
    blocks = filled(
        Paragraph(summary.sentence, Role.LEAD),
        families_figure(summary, "first", about),
        replace(summary.classes, caption=f"{about}: µs of computing per simulated second, by class of methods"),
        Paragraph(f"{summaries.TERMS} {summaries.SAMPLE_TERMS}", Role.NOTE),
        Paragraph(f"{summaries.CAVEAT} Compare times only {together}.{quick}", Role.NOTE),
        beaten,
    )
    return Section(f"Verdict: {about}", blocks, "verdict", "Verdict")


_BEATEN = (
    "Errors at which an engine is faster come first. The fastest method of a class is compared with the fastest engine "
    "at each decade of the largest attitude error. Times between two measured points are interpolated log-log and not "
    "extrapolated. The error of a point is the largest of its own and of all finer points, so isolated good results are "
    "ignored."
)


def _statements(measured: Measured) -> Iterator[Item]:
    statements = [*headline.of_random_bodies(measured.ratios), *headline.of_points(measured.points)]
    for scene in measured.plan.scenes:
        statements += headline.of_each_step(scene.name, each_step(measured.scene_rows, scene.name))
    for statement in headline.first_lost(statements):
        yield Item(statement.text, statement.scene, statement.lost)
