"""Failed runs, unsupported and missing runs, and the agreement of the reference solutions."""

from __future__ import annotations

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import paper
from conservative.method import Role
from conservative.outcome import OutcomeKind

from ..document.cells import DASH, bound, numeric, outcome_text
from ..document.model import Paragraph, Section, Style, Table, filled
from ..rows.names import ABSENT, of_study, outcomes, with_outcome, without_outcome


def section(table: pd.DataFrame) -> Section:
    """Return the section of the rows of a report that are not apart (see `Measured.together`)."""
    text = (
        "Runs that did not reach their end, and runs that were skipped, such as those that would have exceeded `--time-limit`. "
        "Errors are relative to a reference solution that a second, independent one confirms."
    )
    absent = Section("Unsupported or not installed", filled(unsupported(table)), folded=True)
    title = "Failures, unsupported runs, and the reference solutions"
    return Section(title, filled(Paragraph(text), failures(table), absent, truths(table)), "failures", "Failures")


def failures(table: pd.DataFrame) -> Table:
    """Return the runs that failed or were skipped, with the first reason of each study."""
    rows = without_outcome(table, OutcomeKind.OK, OutcomeKind.NO_ORDER, *ABSENT)
    rows = rows.assign(text=list(map(outcome_text, outcomes(rows))))
    body = []
    for key, members in rows.groupby(["scene", "name", "text"], sort=False):
        steps = sorted(members["dt"].dropna().unique(), reverse=True)
        skipped = members[members["outcome"] == OutcomeKind.SKIPPED].drop_duplicates("study")
        reasons, studies = "; ".join(skipped["reason"].unique()), ", ".join(members["study"].unique())
        body.append([*map(str, key), reasons, studies, ", ".join(f"{step:.3g}" for step in steps) or DASH])
    header = ["scene", "method", "outcome", "reason", "studies", "at steps, s"]
    return Table(header, body, "Runs that failed or were skipped", Style.FILTERED)


def unsupported(table: pd.DataFrame) -> Table:
    """Return the unsupported and missing methods, one row per reason."""
    rows = with_outcome(table, *ABSENT)
    # A reason can contain numbers that differ from step to step: the first one stands for all of a method.
    rows = rows.assign(reason=rows.groupby(["scene", "outcome", "name"])["reason"].transform("first"))
    body = [
        [*map(str, key), ", ".join(members["name"].unique())]
        for key, members in rows.groupby(["scene", "outcome", "reason"], sort=False)
    ]
    return Table(["scene", "outcome", "reason (with the numbers of the first run)", "methods"], body)


def truths(table: pd.DataFrame) -> Table:
    """Return the difference of the two independent reference solutions, for each scene and step."""
    rows = table[table["measure"] == Measure.AGREEMENT.text]
    body = [
        [row["scene"], numeric(row["dt"], f"{row['dt']:g}"), row["label"], numeric(row["value"], bound(row["value"]))]
        for _, row in rows.iterrows()
    ]
    header = ["scene", "dt, s", "reference solutions", "largest angle between them, rad"]
    return Table(header, body, "Agreement of two independent reference solutions")


def failures_of_ours(table: pd.DataFrame) -> list[str]:
    """Return the failures of our methods at the steps of the paper, one line each."""
    rows = of_study(table, paper.STUDY.name)
    rows = without_outcome(rows[rows["role"] == Role.OURS.value], OutcomeKind.OK, OutcomeKind.SKIPPED, *ABSENT)
    lines = [
        f"{method} on {scene}, dt = {dt:g} s: {outcome}"
        for method, scene, dt, outcome in zip(rows["method"], rows["scene"], rows["dt"], outcomes(rows), strict=True)
    ]
    return list(dict.fromkeys(lines))
