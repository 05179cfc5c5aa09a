"""The document of `conservative report`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pandas as pd

from conservative.benchmarks.studies import random
from conservative.benchmarks.studies.declaration import Named
from conservative.benchmarks.studies.studies import STUDIES

from ..document.model import Document, Links, Paragraph, Section
from ..run.measure import Measurements
from ..run.plan import Plan
from ..run.provenance import Provenance
from . import (
    advice,
    closing,
    drift,
    engine_page,
    engines,
    failures,
    hard_cases,
    long_time,
    many_bodies,
    motions,
    provenance,
    random_bodies,
    ratios,
    scenes,
    speed,
    summary,
    tumbling,
    twins,
)
from .measured import Measured, of_scene

SECTIONS: dict[str, Any] = {each.STUDY.name: each for each in (many_bodies, long_time, motions, twins)}
"""Sections of the rows and samples of one study, by its name."""
SCHEMA = 2
"""Version of the layout of measurements.json; a change that breaks a reader raises it."""


def build(plan: Plan, measurements: Measurements, source: Provenance) -> Document:
    """Return the document of measurements. Every number that a report shows is computed here; nothing is measured."""
    measured = Measured(plan, measurements, source)
    found = tumbling.results(measured)
    points = {scene.name: of_scene(measured.points, scene.name) for scene in plan.scenes}
    summaries = {scene.name: summary.of_scene(points[scene.name], scene.integrable) for scene in plan.scenes}
    rows = measured.scene_rows
    details: list[Section] = [ratios.section(measured)]
    if random.STUDY.name in plan.names:
        details.append(random_bodies.section(measured.ratios, plan.bodies, plan.seed, random_bodies.truths(measured.rows)))
    details += [scenes.section(measured, scene, summaries[scene.name]) for scene in plan.scenes]
    of_engines = {name: part for name, part in SECTIONS.items() if STUDIES[name].named is Named.ONLY}
    pages = engine_page.pages(measured, of_engines) if plan.engines else {}
    if pages:
        section = engines.section(measured)
        links = Links([(f"Page of {page.title}", f"{name}.html") for name, page in pages.items()])
        details.append(replace(section, blocks=[links, *section.blocks]))
    for name, part in SECTIONS.items():
        if name in plan.names:
            details.append(replace(part.section(measured.rows, measured.samples), source={"study": name}))
    details += hard_cases.sections(measured.rows)
    details.append(failures.section(rows))
    blocks = [tumbling.section(measured, found), speed.section(measured, summaries), drift.section(measured, found)]
    blocks += [advice.section(measured), provenance.section(measured, [replace(each, folded=True) for each in details])]
    tables = [closing.scene_table(measured.rows, points[each.name], each, bool(plan.named)) for each in plan.scenes]
    sentences = [random_bodies.sentence(measured.ratios)] if measured.ratios else []
    sentences += [each.sentence for each in summaries.values()]
    return Document(
        "conservative report",
        "conservative: which integrator for a rotating body?",
        blocks,
        brief=[*tables, Paragraph(f"{closing.LEGEND}\n"), *engines.tables(measured), *map(Paragraph, sentences)],
        data={"schema": SCHEMA, **vars(source), "rows": records(measurements.table)},
        failures=failures.failures_of_ours(rows),
        pages=pages,
    )


def records(table: pd.DataFrame) -> list[dict[str, object]]:
    """Return the rows of a table for JSON."""
    return [
        {str(name): value for name, value in row.items()}
        for row in table.astype(object).where(table.notna(), None).to_dict("records")
    ]
