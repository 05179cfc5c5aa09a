"""The study of prices: times of runs in a new process, as medians over random bodies."""

from __future__ import annotations

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.price import MEASURES
from conservative.benchmarks.studies.price_program import ERROR, RUNS, TOL
from conservative.benchmarks.studies.studies import PRICE

from ..document.cells import DASH, numeric, tolerance
from ..document.model import Emphasis, Paragraph, Row, Section, Table

TERMS = (
    "Wall time in a new process since before the import, in the median over random bodies of all fields. Ours is "
    f"`integrate(scene, error={tolerance(ERROR)})` including its search, then {RUNS - 1} runs of the body with other rates, "
    "one after the other, by the method and the step size that it chose. heyoka is built and compiled for the body's field, "
    f"then run with the tolerance {tolerance(TOL)}. The error is the largest of the final attitudes. Our kernels are compiled "
    "once after the installation (empty cache) and then read from a cache."
)
"""Explanation of the table."""


def section(table: pd.DataFrame, samples: pd.DataFrame) -> Section:
    """Return the section of a report from named rows of the study: a row for each side and state of its cache."""
    here = table[table["study"] == PRICE]
    names = here["family"].where(here["role"] == "engine", "conservative") + (", " + here["way"]).where(here["way"] != "", "")
    rows: list[Row] = []
    for name, members in here.groupby(names, sort=False):
        values = {measure: members[members["measure"] == measure.text]["value"].dropna() for measure in MEASURES.values()}
        worst = members[members["measure"] == Measure.ATTITUDE_FINAL.text]["value"].max()
        medians = [numeric(each.median(), digits=3) if len(each) else DASH for each in values.values()]
        rows.append([str(name), str(len(values[Measure.PRICE_ONCE])), *medians, numeric(worst)])
    header = ["side", "bodies", "one run, s", f"{RUNS:,} runs, s", "first run of another body, s", "largest error, rad"]
    compared = Table(header, rows, "The price of a run, with imports, search and compilation")
    return Section("The price of a run", [compared, Paragraph(TERMS, Emphasis.NOTE)], "price")
