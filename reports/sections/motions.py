"""The study of motions: what each engine fails, and the mistakes that explain it."""

from __future__ import annotations

from collections import Counter

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.motions import STUDY
from conservative.outcome import OutcomeKind

from ..document.cells import DASH
from ..document.model import Paragraph, Row, Section, Table
from ..rows.names import of_measure, of_study

TERMS = (
    "48 exact motions, at |w| h = 0.01 rad. A motion fails if an error of attitude, rates, energy or momentum exceeds the "
    "tolerance of the engine's order. The mistakes are those whose four errors are near, with the number of motions that each "
    "explains."
)
"""Explanation of the section."""


def section(table: pd.DataFrame, samples: pd.DataFrame) -> Section:
    """Return the section of a report from named rows of the study (see `names.with_names`)."""
    rows, body = of_measure(of_study(table, STUDY.name), Measure.ALLOWED), list[Row]()
    for name, group in rows.groupby("name", sort=False):
        ran = group[group["outcome"] == OutcomeKind.OK]
        failed = ran[~(ran["value"] <= 1)]
        causes = Counter(text for text in failed["detail"] if text).most_common(3)
        ended = group[~group["outcome"].isin([OutcomeKind.OK, OutcomeKind.UNSUPPORTED])]
        names = ", ".join(failed["scene"][:4]) + f" and {len(failed) - 4} more" * (len(failed) > 4)
        counts = len(ran) - len(failed), len(failed), len(ended), len(group) - len(ran) - len(ended)
        told = ", ".join(f"{cause} ({count})" for cause, count in causes)
        body.append([str(name), f"{counts[0]} of {len(ran)}", *map(str, counts[2:]), names or DASH, told or DASH])
    header = ["engine", "passed", "ended early", "not taken", "failed motions", "mistakes that explain them"]
    return Section("Motions", [Paragraph(TERMS), Table(header, body, "Exact motions")], "motions")
