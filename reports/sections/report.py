"""The document of `conservative report`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any, TypeVar

import pandas as pd

from conservative.benchmarks.studies import random

from ..document.attempt import attempt
from ..document.model import Block, Document, Links, Paragraph, Section
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
    provenance,
    random_bodies,
    ratios,
    scenes,
    speed,
    summary,
    tumbling,
    verified_engines,
)
from .measured import Measured, of_scene

T = TypeVar("T")
SECTIONS: dict[str, Any] = {module.STUDY.name: module for module in (many_bodies, long_time)}
"""Sections of the rows and samples of one study, by its name."""
EVERYTHING = "Everything else: the motion, speed, drift, what to use, how it was measured, and all tables"
"""Title of the part behind the click."""


def build(plan: Plan, measurements: Measurements, source: Provenance) -> Document:
    """Return the document of measurements. Every number that a report shows is computed here; nothing is measured.

    The page shows a table, two charts and the command that repeats them. Everything else is folded.
    A section that cannot be made is a sentence (see `attempt`), and a failure of the document.
    """
    measured = Measured(plan, measurements, source)
    results = cache(lambda: tumbling.results(measured))
    points = {scene.name: of_scene(measured.points, scene.name) for scene in plan.scenes}
    summaries = cache(lambda: {scene.name: summary.of_scene(points[scene.name], scene.integrable) for scene in plan.scenes})
    rows = measured.scene_rows

    def part(title: str, make: Callable[[], T]) -> T | Paragraph:
        return attempt(f"The section {title!r}", make)

    def random_section() -> Section:
        rows = measured.rows
        compiled = random_bodies.ratios(rows, random.TIMES[1])
        typed = [random_bodies.typed_ratios(rows, time) for time in random.TIMES]
        about = random_bodies.truths(rows)
        return random_bodies.section(measured.ratios, plan.bodies, plan.seed, about, compiled, typed)

    details: list[Block] = [part("ratios", lambda: ratios.section(measured))]
    if random.STUDY.name in plan.names:
        details.append(part("random bodies", random_section))
    for scene in plan.scenes:
        make = partial(lambda scene: scenes.section(measured, scene, summaries()[scene.name]), scene)
        details.append(part(f"all tables of {scene.name}", make))
    pages = part("pages of engines", lambda: engine_page.pages(measured)) if plan.engines else {}
    if isinstance(pages, Paragraph):
        details.append(pages)
        pages = {}
    if pages:
        links = Links([(f"Page of {page.title}", f"{name}.html") for name, page in pages.items()])
        section = part("engines", lambda: engines.section(measured))
        linked = replace(section, blocks=[links, *section.blocks]) if isinstance(section, Section) else section
        details.append(linked)
    if verified := measurements.verified:
        details.append(part("verification", lambda: verified_engines.section(verified)))
    for name, module in SECTIONS.items():
        if name in plan.names:
            section = part(name, partial(module.section, measured.rows, measured.samples))
            details.append(replace(section, source={"study": name}) if isinstance(section, Section) else section)
    cases = part("hard cases", lambda: hard_cases.sections(measured.rows))
    details += [cases] if isinstance(cases, Paragraph) else cases
    details.append(part("failures", lambda: failures.section(measured.together)))
    make_table = partial(closing.paper_table, measured.together, points, plan.scenes)
    paper = part("table for a paper", make_table) if plan.latex else None
    if isinstance(paper, Paragraph):
        details.append(paper)
        paper = None
    folded = [replace(detail, folded=True) if isinstance(detail, Section) else detail for detail in details]
    drawn = cache(lambda: speed.pictures(measured, summaries()))
    everything: list[Block] = [
        part("the motion", lambda: tumbling.motion_section(measured, results())),
        part("speed", lambda: speed.section(measured, drawn())),
        part("drift", lambda: drift.section(measured, results())),
        part("advice", lambda: advice.section(measured)),
    ]
    origin = part("provenance", lambda: provenance.section(measured, folded))
    everything += [origin] if isinstance(origin, Section) else [origin, *folded]
    blocks: list[Block] = [
        part("results", lambda: tumbling.section(measured, results())),
        part("charts", lambda: speed.first_figure(drawn())),
        provenance.repeat(measured),
        Section(EVERYTHING, everything, folded=True),
    ]
    return Document(
        "conservative report",
        "conservative: how wrong is the rotation of a rigid body?",
        blocks,
        brief=list(brief(measured, points, results)),
        data=measurements.content(source),
        failures=failures.failures_of_ours(rows),
        pages=pages,
        for_paper=paper,
    )


def brief(
    measured: Measured, points: Mapping[str, pd.DataFrame], results: Callable[[], Sequence[tumbling.Result]]
) -> Iterator[Block]:
    """Yield the lines for the terminal: a table of each scene with few of our methods, and sentences."""
    for scene in measured.plan.scenes:
        yield attempt(f"The table of {scene.name}", partial(closing.brief_table, measured, points[scene.name], scene))
    yield Paragraph(f"{closing.LEGEND}\n")
    tables = attempt("The tables of engines", lambda: engines.tables(measured))
    yield from [tables] if isinstance(tables, Paragraph) else tables
    if measured.ratios:
        yield attempt("The sentence on random bodies", lambda: Paragraph(random_bodies.sentence(measured.ratios)))
    yield attempt("The summary", lambda: Paragraph(tumbling.sentence(results(), measured.main_scene)))
