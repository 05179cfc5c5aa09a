"""What is measured of a report that is not written yet: one file beside its folder, so that `--resume` can go on.

The file is replaced as a whole after each study, and goes when the report is there. It says on which terms it was measured:
measurements are only ever put together with others of the same scenes, methods, versions, source and machine.
"""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any

from conservative.benchmarks.measures import measurement, samples
from conservative.benchmarks.measures.measurement import Measurement
from conservative.benchmarks.measures.samples import Samples
from conservative.benchmarks.studies.study import Finding
from conservative.errors import BadInput

from ..terminal.atomic_files import text_file
from .plan import Plan
from .provenance import Provenance
from .terms import differences, terms

FORMAT = 2
_MOST_DIFFERENCES = 3
"""How many differences a complaint has at most."""


@dataclass(frozen=True)
class Process:
    """What measured a piece: the command, when it began, and the commit (see `Provenance`)."""

    command: str
    start: str
    commit: str


@dataclass(frozen=True)
class Piece:
    """All that one study measured: its rows, lines of its pictures, and the process that measured it."""

    rows: tuple[Measurement, ...]
    samples: tuple[Samples, ...]
    by: Process


@dataclass(frozen=True)
class Checkpoint:
    """The pieces of a report that are done, by name, and the file that has them too, except before the first.

    Attributes: `path` of the file, `names` of all studies, `terms` (see `terms`), the `process` that goes on, and `pieces`.
    """

    path: Path
    names: tuple[str, ...]
    terms: Mapping[str, Any]
    process: Process
    pieces: dict[str, Piece] = field(default_factory=dict)

    def keep(self, name: str, findings: Iterable[Finding]) -> None:
        """Keep what a study finds, in the file as well; what an earlier report left there goes."""
        every = list(findings)
        rows = tuple(finding for finding in every if isinstance(finding, Measurement))
        lines = tuple(finding for finding in every if isinstance(finding, Samples))
        self.pieces[name] = Piece(rows, lines, self.process)
        with text_file(self.path, "out") as stream:
            stream.write(_content(self))

    def remove(self) -> None:
        """Remove the file: the report is written."""
        self.path.unlink(missing_ok=True)

    @property
    def story(self) -> str:
        """What is done, where it is and how to go on, in words."""
        if not self.pieces:
            return "nothing was finished, nothing is kept"
        command = self.process.command
        again = command if "--resume" in shlex.split(command) else f"{command} --resume"
        done = f"{len(self.pieces)} of {len(self.names)} studies are finished ({', '.join(self.pieces)})"
        return f"{done} and kept in {str(self.path)!r}; go on with: {again}"

    @property
    def earlier(self) -> tuple[str, ...]:
        """What other processes measured, one sentence each; empty where one process measured everything."""
        return tuple(
            f"{', '.join(name for name, _ in items)}: measured by an earlier process, which was interrupted; "
            f"begun {by.start} at commit {by.commit} with `{by.command}`"
            for by, items in groupby(self.pieces.items(), key=lambda item: item[1].by)
            if by != self.process
        )


def path_for(out: Path) -> Path:
    """Return where the unfinished work of a report into the folder `out` is kept."""
    folder = out.resolve()
    path = folder.parent / f"{folder.name}.partial.json"
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path


def begin(plan: Plan, out: Path, source: Provenance, resume: bool) -> Checkpoint:
    """Return what to begin with: nothing, or with `resume` what an earlier process has done.

    Raises
    ------
    BadInput
        There is nothing to resume, or it was measured on other terms; or the file is none of ours, so that it must stay.
    """
    path = path_for(out)
    process = Process(source.command, source.date, source.commit)
    fresh = Checkpoint(path, plan.names, terms(plan, source), process)
    if not path.exists():
        if resume:
            raise BadInput("resume", f"no {str(path)!r}", "the folder --out of a report that was interrupted")
        return fresh
    before, pieces = read(path)
    if resume:
        _require_same_terms(path, before, fresh.terms)
        fresh.pieces.update(pieces)
    return fresh


def _require_same_terms(path: Path, before: Mapping[str, Any], now: Mapping[str, Any]) -> None:
    """Raise `BadInput` unless a file, as `read` has it, was measured on the terms of now."""
    different = list(differences(before["terms"], json.loads(json.dumps(now))))
    if different:
        more = f" and {len(different) - _MOST_DIFFERENCES} more" if len(different) > _MOST_DIFFERENCES else ""
        raise BadInput(
            "resume",
            f"{str(path)!r}, which was made with {'; '.join(different[:_MOST_DIFFERENCES])}{more}",
            f"the same again (it was `{before['command']}`), or no --resume, to begin anew",
        )


def _content(checkpoint: Checkpoint) -> str:
    """Return the file: floats come back as they are, nan as nan."""
    pieces = {name: _record(piece) for name, piece in checkpoint.pieces.items()}
    content = {"format": FORMAT, "command": checkpoint.process.command, "terms": checkpoint.terms, "pieces": pieces}
    return json.dumps(content, ensure_ascii=False)


def _record(piece: Piece) -> dict[str, Any]:
    return {
        "by": vars(piece.by),
        "rows": list(map(measurement.flat, piece.rows)),
        "samples": list(map(samples.flat, piece.samples)),
    }


def _piece(record: Mapping[str, Any]) -> Piece:
    return Piece(
        tuple(map(measurement.from_flat, record["rows"])),
        tuple(map(samples.from_flat, record["samples"])),
        Process(**record["by"]),
    )


def read(path: Path) -> tuple[dict[str, Any], dict[str, Piece]]:
    """Return the command and terms of a file of unfinished work, and its pieces.

    Raises
    ------
    BadInput
        It cannot be read, or is something else.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if content["format"] != FORMAT:
            raise ValueError(f"format {content['format']}")
        pieces = {name: _piece(record) for name, record in content["pieces"].items()}
        return {"command": str(content["command"]), "terms": dict(content["terms"])}, pieces
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        allowed = "unfinished work that an interrupted report left, or no such file: remove it"
        raise BadInput("out", f"{str(path)!r} ({type(error).__name__}: {error})", allowed) from None
