"""One study: its statements, tables and rows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import convergence, random, work_precision
from conservative.outcome import OutcomeKind

from ..document.attempt import attempt
from ..document.cells import DASH, number
from ..document.model import Block, Document, Facts, Figure, Paragraph, Row, Section, Table, filled
from ..rows import lines
from ..rows.names import with_names
from ..rows.points import points
from ..run.measure import Measurements, records
from . import random_bodies, scenes
from .measured import of_scene
from .report import SECTIONS


def build(name: str, measured: Measurements, made: Mapping[str, str]) -> Document:
    """Return the document of a study: its own section if it has one, such as ratios of random bodies, and otherwise its rows.

    `made` has the facts of the run. If the section cannot be made, the document has a sentence about that, and the rows.
    """
    data: dict[str, Any] = {"study": name, **made}
    named = with_names(measured.table)

    def of_random_bodies() -> list[Block]:
        ratios, compiled = (random_bodies.ratios(named, time) for time in random.TIMES)
        typed = [random_bodies.typed_ratios(named, time) for time in random.TIMES]
        about = (random_bodies.sentence(ratios), random_bodies.counts(ratios), random_bodies.truths(named))
        sentence = Paragraph(" ".join(filter(None, about)))
        picture = random_bodies.figure(ratios, named["body"].nunique(), int(named["seed"].max()))
        data["ratios"] = random_bodies.records(ratios)
        data["typed"] = random_bodies.typed_records(typed[0])
        tables = random_bodies.as_table(ratios, compiled), random_bodies.typed_table(*typed), random_bodies.by_engine(ratios)
        return filled(picture, *tables, sentence)

    def of_section() -> list[Block]:
        part = SECTIONS[name].section(named, with_names(measured.samples))
        return [block for block in part.blocks if isinstance(block, Table | Section | Figure)]

    own: list[Block] | Paragraph  # a paragraph if it failed: see `attempt`
    if name == random.STUDY.name:
        own, terms = attempt("The ratios", of_random_bodies), random_bodies.TERMS
    elif name in SECTIONS:
        own, terms = attempt("The section", of_section), SECTIONS[name].TERMS
    else:
        charts = attempt("The charts", lambda: pictures(name, named))
        own, terms = [*([charts] if isinstance(charts, Paragraph) else charts), rows_table(name, named)], ""
    shown: list[Block] = [own, rows_table(name, named)] if isinstance(own, Paragraph) else own
    data |= {"rows": records(measured.table), "samples": records(measured.samples)}
    origin = Section("How this was made", [Facts(list(made.items()))])
    blocks = filled(Paragraph(terms) if terms else None, *shown, origin)
    return Document("conservative study", f"Study: {name}", blocks, brief=shown, data=data)


def pictures(name: str, table: pd.DataFrame) -> list[Figure]:
    """Return the figures of named rows of a study, one for each scene; none for studies without a chart of their own."""
    names = [str(scene) for scene in table["scene"].dropna().unique()]
    if name == work_precision.STUDY.name:
        measured = points(table)
        return [scenes.work_figure(of_scene(measured, scene), scene) for scene in names if scene in set(measured["scene"])]
    if name == convergence.STUDY.name:
        errors = lines.errors(table, Measure.ATTITUDE_MAX)
        by_scene = {scene: of_scene(errors, scene) for scene in names}
        return [scenes.convergence_figure(rows, lines.fits(rows), scene) for scene, rows in by_scene.items() if len(rows)]
    return []


def rows_table(name: str, table: pd.DataFrame) -> Table:
    """Return named rows (see `names.with_names`) as a table."""
    header = ["scene", "method", "step, s", "measure", "value", "unit", "outcome"]
    rows: list[Row] = []
    for row in table.to_dict("records"):
        step = DASH if math.isnan(row["dt"]) else f"{row['dt']:.4g}"
        measure = f"{row['quantity']} {row['measure']}".lstrip()
        end = "" if row["outcome"] == OutcomeKind.OK else f"{row['outcome']}{': ' * bool(row['reason'])}{row['reason']}"
        rows.append([row["scene"], row["name"], step, measure, number(row["value"], 3), row["unit"], end])
    return Table(header, rows, f"{name}: {len(table)} rows")
