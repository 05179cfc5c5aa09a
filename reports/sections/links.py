"""The links of model files: one line for each, with what a mistake does to the motion and the repair."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ..document.cells import DASH
from ..document.model import Block, Cell, Emphasis, Grade, Paragraph, Row, Style, Table, filled

if TYPE_CHECKING:
    from conservative.benchmarks.verification.finding import Verification

HEADER = ("link", "verdict", "mistake", "what it does to the motion", "repair", "what the file has")
NOTE = (
    "The links are compared with their own shapes, with their twins and with what a body can have, without an engine. "
    "The effect is computed for the link and all that is fixed to it, from the inertia of the file and the repaired one; "
    "without a single repair, from its shapes with uniform density. A repair is named if there is a single one."
)
GRADES = {"right": Grade.GOOD, "wrong": Grade.BAD, "undecided": Grade.FAIR}


def link_blocks(verifications: Sequence[Verification], brief: bool) -> list[Block]:
    """Return the links that are not right, and with all details every link. Nothing if the links were not checked."""
    findings: list[tuple[str, Any]] = [
        (verification.subject, finding)
        for verification in verifications
        for finding in verification.findings
        if finding.check == "links"
    ]
    if not findings:
        return []
    several = len(verifications) > 1
    header = ["file"] * several + list(HEADER)
    doubtful = [(subject, finding) for subject, finding in findings if finding.verdict != "right"]
    if brief:
        doubtful.sort(key=lambda pair: ("wrong", "undecided", "not tested").index(pair[1].verdict))
        return filled(Table(header, [_row(*pair, several) for pair in doubtful], "Links that are not right"))
    full = [*header, "mass", "principal moments, kg m^2"]
    files = _files(verifications) if several else None
    rows = [_row(*pair, several, full=True) for pair in sorted(findings, key=lambda pair: pair[1].verdict == "right")]
    return filled(files, Table(full, rows, "Links", Style.FILTERED), Paragraph(NOTE, Emphasis.NOTE))


def _files(verifications: Sequence[Verification]) -> Table:
    """Return a table of the files with the number of links by verdict."""
    kinds = ("right", "wrong", "undecided", "not tested")
    rows: list[Row] = []
    for verification in verifications:
        counts = [sum(f.verdict == kind for f in verification.findings if f.check == "links") for kind in kinds]
        rows.append([verification.subject, *(Cell(str(count) if count else DASH, value=count) for count in counts)])
    return Table(["file", *kinds], rows, "Links of each file")


def _row(subject: str, finding: Any, several: bool, full: bool = False) -> Row:
    verdict = Cell(str(finding.verdict), GRADES.get(str(finding.verdict), Grade.NONE))
    mistakes = ", ".join(key for cause in finding.causes for key in cause.keys)
    sizes: list[str | Cell] = []
    if full:
        mass = DASH if math.isnan(finding.mass) else f"{finding.mass:.4g} kg"
        sizes = [Cell(mass, value=finding.mass), " ".join(f"{moment:.3g}" for moment in finding.moments) or DASH]
    texts = [text or DASH for text in (mistakes, finding.effect, finding.repair, finding.detail)]
    return [*([subject] if several else []), finding.case or DASH, verdict, *texts, *sizes]
