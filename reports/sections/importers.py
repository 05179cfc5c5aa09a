"""The bodies that engines have after loading model files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..document.model import Check, Document, Emphasis, Item, Items, Paragraph, Table, filled

if TYPE_CHECKING:
    from conservative.references.importers.compare import FileAnswer


def build(findings: Sequence[FileAnswer]) -> Document:
    """Return the document of `compare_files`: a table of files and engines, and what is not right."""
    engines = list(dict.fromkeys(each.engine for each in findings))
    files = list(dict.fromkeys(each.file for each in findings))
    answers = {(each.file, each.engine): each for each in findings}
    bad = [each for each in findings if each.outcome not in ("right", "")]
    used = [each for each in findings if each.outcome]
    rows = [[file, *(answers[file, engine].outcome or "–" for engine in engines)] for file in files]
    lead = f"{len(used) - len(bad)} of {len(used)} answers of {len(engines)} engines are right, for {len(files)} files."
    blocks = filled(
        Paragraph(lead, Emphasis.LEAD),
        Table(["file", *engines], rows),
        Items([Item(f"{each.file}: {each.words}", f"{each.engine} {each.outcome}", True) for each in bad]),
    )
    checks = [Check(each.engine, each.file, failure=each.words if each in bad else "") for each in used]
    data = {"right": not bad, "findings": findings}
    failures = [f"{each.engine}, {each.file}: {each.words}" for each in bad]
    return Document(
        "conservative importers", f"Importers: {len(files)} files", blocks, data=data, checks=checks, failures=failures
    )
