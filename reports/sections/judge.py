"""A recorded motion: the verdict, what was compared, what explains its error, and errors and drifts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from conservative.benchmarks.verification.finding import Verdict, Verification
from conservative.benchmarks.verification.recordings.verdict import Details, Unit

from ..document.cells import bound
from ..document.model import Document, Emphasis, Items, Paragraph, Table, filled

LISTED = 12
"""Mistakes that the table lists."""


def build(verification: Verification) -> Document:
    """Return the document of the verification of a recording."""
    name, wrong = verification.subject, verification.verdict is Verdict.WRONG
    blocks = [Paragraph(f"{verification.sentence}.", Emphasis.LEAD), *recording_blocks(verification)]
    failures = [f"{verification.sentence}."] if wrong else []
    return Document("conservative judge", f"Judged: {name}", blocks, data=as_data(verification), failures=failures)


def as_data(verification: Verification) -> dict[str, Any]:
    """Return the verification of a recording for JSON, without its series."""
    details = verification.details
    assert isinstance(details, Details)
    (finding,) = verification.findings
    shown = {name: value for name, value in vars(details).items() if name not in ("times", "series")}
    return {
        "judged": verification.subject,
        "verdict": verification.verdict,
        "right": verification.verdict is Verdict.RIGHT,
        "reason": verification.reason,
        "undecided": finding.detail if verification.verdict is Verdict.UNDECIDED else "",
        "causes": finding.causes,
        "notes": verification.notes,
        **shown,
    }


def recording_blocks(verification: Verification) -> list[Any]:
    """Return the blocks on a recording that follow the sentence of its verdict: noise, mistakes, quantities, columns."""
    details = verification.details
    assert isinstance(details, Details)
    (finding,) = verification.findings
    sentences = []
    if finding.by == "noise" and max(details.noise) > 0:
        sentence = f"The noise of an axis is {_amount(details.noise, details.units)}"
        if max(details.first_row) > 0:
            sentence += f"; from the first row alone the motion is off by {_amount(details.first_row, details.units)}"
            sentence += ", so its start is fitted"
        sentences.append(f"{sentence}.")
    proven, candidates = details.explaining, details.candidates
    left = [
        f"{each.sentence}: leaves {_amount(each.left, details.units)} of {_amount(each.plain, details.units)}"
        for each in (proven if len(proven) > 1 else candidates)
    ]
    heading = "These explain the file equally well:" if len(proven) > 1 else ""
    if verification.verdict is Verdict.WRONG and not proven:
        heading = "No known mistake explains the error" + (": none of these candidates is proven." if candidates else ".")
    compared = "; ".join(f"{kind}: {', '.join(columns)}" for kind, columns in details.used.items())
    used = [f"Compared: {compared} ({details.compared:,} of {details.in_file:,} rows)."] if compared else []
    unused = [f"Not used: {column}, {reason}." for column, reason in details.unused.items()]
    quantities = [[each.name, bound(each.largest), bound(each.final)] for each in details.quantities]
    tried = [[each.name, _amount(each.left, details.units)] for each in details.tried[:LISTED]]
    return filled(
        Paragraph(" ".join(sentences)) if sentences else None,
        Paragraph(heading) if heading else None,
        Items.of(left if heading else []),
        Table(["quantity", "largest", "at the end"], quantities),
        Table(["mistake", "error that is left"], tried),
        Items.of([*used, *unused, *verification.notes]),
    )


def _amount(errors: Sequence[float], units: Sequence[Unit]) -> str:
    return " and ".join(f"{bound(error * size)} {unit}" for error, (unit, size) in zip(errors, units, strict=True) if size)
