"""A recorded motion, or two: what was compared, what explains the error, and errors and drifts."""

from __future__ import annotations

from conservative.benchmarks.verification.finding import Verdict, Verification
from conservative.benchmarks.verification.recordings.two import Two
from conservative.benchmarks.verification.recordings.verdict import Details

from ..document.cells import bound
from ..document.model import Block, Items, Paragraph, Section, Table, filled

LISTED = 12
"""Mistakes that the table lists."""


def recording_blocks(verification: Verification) -> list[Block]:
    """Return the blocks on a recording that follow the sentence of its verdict: start, mistakes, quantities, columns."""
    details = verification.details
    assert isinstance(details, Details)
    fitted = max(details.first_row) > 0
    first_row = f"From the first row alone the motion is off by {details.show(details.first_row)}, so its start is fitted."
    proven, candidates = details.explaining, details.candidates
    # A single mistake is in the sentence of the verdict already.
    left = [
        f"{explanation.sentence}: leaves {details.show(explanation.left)} of {details.show(explanation.plain)}"
        for explanation in (proven if len(proven) > 1 else candidates)
    ]
    heading = "These explain the file equally well:" if len(proven) > 1 else ""
    if verification.verdict is Verdict.WRONG and not proven:
        heading = "No known mistake explains the error" + (": none of these candidates is proven." if candidates else ".")
    compared = "; ".join(f"{kind}: {', '.join(columns)}" for kind, columns in details.used.items())
    used = [f"Compared: {compared} ({details.compared:,} of {details.in_file:,} rows)."] if compared else []
    by_reason: dict[str, list[str]] = {}
    for column, reason in details.unused.items():
        by_reason.setdefault(reason, []).append(column)
    unused = [f"Not used: {', '.join(columns)}: {reason}." for reason, columns in by_reason.items()]
    quantities = [[quantity.name, bound(quantity.largest), bound(quantity.final)] for quantity in details.quantities]
    tried = [] if proven else [[explanation.name, details.show(explanation.left)] for explanation in details.tried[:LISTED]]
    return filled(
        Paragraph(first_row) if fitted else None,
        Paragraph(heading) if heading else None,
        Items.of(left if heading else []),
        Table(["quantity", "largest", "at the end"], quantities),
        Table(["mistake that was tried", "error that is left"], tried),
        Items.of([*used, *unused, *verification.notes]),
    )


def described(verification: Verification) -> list[Block]:
    """Return the paragraphs on what a recording is."""
    assert isinstance(verification.details, Details)
    return [Paragraph(line) for line in verification.details.lines]


def two_blocks(verification: Verification) -> list[Block]:
    """Return a section for each of two recordings, with its blocks."""
    details = verification.details
    assert isinstance(details, Two)
    return [
        *([Paragraph(details.assumed)] if details.assumed else []),
        *(
            Section(f"{recording.subject}: {recording.verdict}", [*described(recording), *recording_blocks(recording)])
            for recording in (details.first, details.second)
            if recording.details is not None
        ),  # without a body, a recording that does not determine one is not compared
    ]
