"""The document of `conservative twins`, and the section of its study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.study import Progress
from conservative.benchmarks.studies.twins import STUDY, compare_methods
from conservative.benchmarks.verification.finding import Verdict
from conservative.benchmarks.verification.pairs import PairFinding
from conservative.method import Method
from conservative.outcome import OutcomeKind

from ..document.cells import DASH
from ..document.model import Check, Document, Emphasis, Paragraph, Row, Section, Table
from ..rows.names import of_measure, of_study
from .pairs import TERMS, pair_blocks
from .pairs import changes as pair_changes

NONE = "No pair could be compared."


def build(results: Sequence[tuple[Method, PairFinding]], made: Mapping[str, str]) -> Document:
    """Return the document of `compare_methods`."""
    engines = list(dict.fromkeys(method.label for method, _ in results))
    found = [each for _, each in results]
    wrong = [each for each in found if each.verdict is Verdict.WRONG]
    ran = [each for each in found if each.verdict is not Verdict.NOT_TESTED]
    named = f"{len(engines)} engines" if len(engines) > 1 else engines[0]
    lead = Paragraph(f"{len(wrong)} of {len(ran)} pairs differ in {named}." if ran else NONE, Emphasis.LEAD)
    return Document(
        "conservative twins",
        f"Twins: {', '.join(engines)}",
        [lead, *pair_blocks(found)],
        data={"made": dict(made), "passed": not wrong and bool(ran), "results": found},
        checks=[Check(each.subject, each.case, failure=each.detail if each in wrong else "") for each in ran],
        failures=[f"{each.subject}, {each.case}: {each.detail}" for each in wrong] or [NONE] * (not ran),
    )


def changes(versions: Sequence[tuple[str, Sequence[Method]]], progress: Progress) -> list[str]:
    """Return a sentence for each pair that began or ceased to differ from one version of an engine to the next."""
    return pair_changes(
        [
            (name, [(each.setting(), [one for _, one in compare_methods((each,), progress)]) for each in some])
            for name, some in versions
        ]
    )


def section(table: pd.DataFrame, samples: pd.DataFrame) -> Section:
    """Return the section of a report from named rows of the study (see `names.with_names`)."""
    rows, body = of_measure(of_study(table, STUDY.name), Measure.ALLOWED), list[Row]()
    for name, group in rows.groupby("name", sort=False):
        ran = group[group["outcome"] == OutcomeKind.OK]
        failed = ran[ran["value"] > 1]
        which = ", ".join(dict.fromkeys(failed["way"]))
        body.append([str(name), str(len(ran) - len(failed)), str(len(failed)), which or DASH])
    header = ["engine", "equal", "different", "pairs that differ"]
    return Section("Twins", [Paragraph(TERMS), Table(header, body, "Pairs of descriptions")], "twins")
