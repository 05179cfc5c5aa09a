"""The study of growth: errors over up to a million turns, and how they grow."""

from __future__ import annotations

import math

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.long_time import ATTITUDE, STUDY
from conservative.outcome import OutcomeKind

from ..charts import figures, vega_embed
from ..charts.style import families_of
from ..document.cells import DASH, bound, number, numeric
from ..document.model import Cell, Emphasis, Figure, Layout, Paragraph, Row, Section, Style, Table, filled
from ..rows.lines import early_ends

TERMS = (
    "The largest error so far, over runs of up to a million turns at the scene's step: relative drifts, and the attitude error "
    "in rad where the motion has a closed form. In parentheses the exponent p of the growth t^p over the last two decades: 0 "
    "is bounded, 0.5 a random walk of round-off, 1 linear, 2 quadratic. Slow methods stop earlier."
)
"""Explanation of the section."""


def section(table: pd.DataFrame, samples: pd.DataFrame) -> Section:
    """Return the section of a report from named rows and samples of the study (see `names.with_names`)."""
    lines = samples.loc[samples["study"] == STUDY.name, ["scene", "quantity", "family", "name", "t", "value"]]
    figure = None
    if len(lines):
        title, picture = "Growth of errors over a million turns", figures.growth(lines)
        panels = vega_embed.embed(picture, ("name",), 220)
        legend = vega_embed.legend(families_of(lines), marks=False)
        note = f"A level line is bounded.{why_early(lines, table)}"
        figure = Figure("long_time", title, note, picture, panels, legend, Layout.PANELS)
    return Section("Long times", filled(figure, as_table(table), Paragraph(TERMS, Emphasis.NOTE)), "long-times")


def why_early(lines: pd.DataFrame, table: pd.DataFrame) -> str:
    """Return why lines end before the others of their scene; empty if none does."""
    here, ends = table[(table["study"] == STUDY.name) & (table["outcome"] != OutcomeKind.OK)], list[str]()
    for scene, part in lines.groupby("scene", sort=False):
        failed = here[here["scene"] == scene].groupby("name")["reason"].first()
        for name, end in early_ends(part).items():
            ends.append(f"{name} on {scene} ({number(end)} turns: {failed.get(name, 'longer runs exceed the time budget')})")
    return f" Lines that end early: {'; '.join(ends)}." if ends else ""


def as_table(table: pd.DataFrame) -> Table:
    """Return a row for each method on each scene: the turns that it reached, and each error with its growth."""
    here = table[table["study"] == STUDY.name]
    quantities = list(dict.fromkeys(here.loc[here["measure"] == Measure.GROWTH.text, "quantity"]))
    rows: list[Row] = []
    for (scene, name), members in here.groupby(["scene", "name"], sort=False):
        keys = zip(members["measure"], members["quantity"], strict=True)
        value = dict(zip(keys, members["value"].astype(float), strict=True))
        turns = members.loc[(members["measure"] == Measure.TURNS.text) & members["value"].notna(), "value"]
        cells: list[str | Cell] = [numeric(turns.max(), digits=2) if len(turns) else DASH]
        for quantity in quantities:
            key = (Measure.ATTITUDE_MAX.text, "") if quantity == ATTITUDE else (Measure.DRIFT_MAX.text, quantity)
            growth = number(value.get((Measure.GROWTH.text, quantity), math.nan))
            cells.append(numeric(value[key], f"{bound(value[key])} ({growth})") if key in value else DASH)
        failed = members[members["outcome"] != OutcomeKind.OK]
        rows.append([str(scene), str(name), *cells, ", ".join(failed["outcome"] + ": " + failed["reason"])])
    header = ["scene", "method", "turns", *(f"{quantity} (p)" for quantity in quantities), "how it ended"]
    return Table(header, rows, "Errors after long runs, and their growth", Style.FILTERED)
