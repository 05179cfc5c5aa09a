"""The bodies that engines have after loading model files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..document.model import Check, Document, Emphasis, Item, Items, Paragraph, Table, filled

if TYPE_CHECKING:
    from conservative.benchmarks.verification.bodies.loaded import FileAnswer


GOOD = ("right", "undecided", "")
"""Outcomes that are not faults of an engine."""


def build(findings: Sequence[FileAnswer]) -> Document:
    """Return the document of `compare_files`: a table of files and engines, what is not right, by all readers, and notes."""
    engines = list(dict.fromkeys(each.engine for each in findings))
    files = list(dict.fromkeys(each.file for each in findings))
    answers = {(each.file, each.engine): each for each in findings}
    bad = [each for each in findings if each.outcome not in GOOD]
    used = [each for each in findings if each.outcome]
    open_ = [each for each in findings if each.outcome == "undecided"]
    words = [each for each in findings if each.words and each not in bad and each not in open_ and each.outcome]
    rows = [[file, *(answers[file, engine].outcome or "–" for engine in engines)] for file in files]
    lead = (
        f"{len(used) - len(bad) - len(open_)} of {len(used)} answers of {len(engines)} engines are right, for {_count(files)}."
    )
    lead += f" {len(open_)} are undecided." * bool(open_)
    notes = dict.fromkeys((each.file, note) for each in findings for note in each.notes)
    parties = [
        [each.file, each.engine, *_readings(each), "–" if each.seen is None else _body(each.seen)]
        for each in [*bad, *open_]
        if each.seen or each in open_
    ]
    blocks = filled(
        Paragraph(lead, Emphasis.LEAD),
        Table(["body", *engines], rows),
        Items([Item(f"{each.file}: {each.words}", f"{each.engine} {each.outcome}", True) for each in bad]),
        Items([Item(f"{each.file}: {each.words}", f"{each.engine} {each.outcome}") for each in [*open_, *words]]),
        Table(["body", "engine", "by the reference reader", "by this package", "in the engine"], parties) if parties else None,
        Items([Item(note, file) for file, note in notes]),
    )
    checks = [Check(each.engine, each.file, failure=each.words if each in bad else "") for each in used]
    data = {"right": not bad, "findings": findings}
    failures = [f"{each.engine}, {each.file}: {each.words}" for each in bad]
    return Document(
        "conservative importers", f"Importers: {_count(files)}", blocks, data=data, checks=checks, failures=failures
    )


def _count(bodies: Sequence[str]) -> str:
    return f"{len(bodies)} {'body' if len(bodies) == 1 else 'bodies'}"


def _readings(answer: FileAnswer) -> list[str]:
    """Return the bodies by the reference reader and by this package, which is the last one."""
    *reference, own = answer.readers.items()
    shown = [f"{name}: {_body(part)}" for name, part in reference] or ["–"]
    return [*shown, _body(own[1])]


def _body(part: dict[str, Any] | str) -> str:
    from conservative.benchmarks.verification.bodies.loaded import describe
    from conservative.references.model_files.pieces import Piece

    if isinstance(part, str):
        return part[:120]
    return describe(Piece(part["mass"], np.array(part["com"]), np.array(part["inertia"])))
