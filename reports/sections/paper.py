"""The paper's figures, drawn again, and the errors of its figure 2."""

from __future__ import annotations

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.paper_figures import STUDY

from ..charts import paper
from ..document.model import Figure, Layout, Section, Table, filled
from ..rows import lines
from ..rows.names import of_study


def section(table: pd.DataFrame, samples: pd.DataFrame) -> Section:
    """Return the section, without figures whose scene is not in the report."""
    rates, errors, positions = lines.body_rates(samples), lines.conservation_errors(samples), lines.centre_of_mass(samples)
    figures = []
    if len(rates):
        words = "The brick, disturbed by 1e-8, turns over repeatedly about its middle axis; signed errors of energy and |L|."
        title = "Figure 1 of the paper: body rates, energy and momentum"
        figures.append(Figure("paper_figure_1", title, words, *paper.figure_1(rates, errors), Layout.PANELS))
    if len(positions):
        words = "The top's centre of mass for two steps, and exact. The tables of drift above show what the map conserves."
        title = "Figure 2 of the paper: centre of mass of the top"
        figures.append(Figure("paper_figure_2", title, words, *paper.figure_2(positions), Layout.PANELS))
    blocks = filled(*figures, position_errors(table))
    return Section("The paper's figures, drawn again", blocks, "paper", "The paper", source={"study": STUDY.name})


def position_errors(table: pd.DataFrame) -> Table | None:
    """Return the errors of the top's centre of mass after one period of precession; None without that study."""
    rows = of_study(table, STUDY.name)
    if rows.empty:
        return None
    wide = rows.pivot(index="dt", columns="measure", values="value").sort_index(ascending=False)
    body = []
    for dt, row in wide.iterrows():
        t, x1, distance = (row[measure.text] for measure in (Measure.PERIOD, Measure.PERIOD_X1, Measure.PERIOD_DISTANCE))
        body.append([f"{dt:g}", f"{t:g}", f"{x1:.4f}", f"{distance:.4f}"])
    caption = "Error of the centre of mass of the top after one period of precession (the nearest whole number of steps)"
    return Table(["dt, s", "t, s", "error of x1, m", "distance, m"], body, caption)
