"""What is measured of a report that is not written yet: one file beside its folder, so that `--resume` can go on.

The file is replaced as a whole whenever a piece is finished, and goes when the report is there. It says on which terms it was
made: measurements are only ever put together with others of the same scenes, methods, versions, source and machine.
"""

from __future__ import annotations

import hashlib
import json
import shlex
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any

from conservative.benchmarks.measures import measurement, samples
from conservative.benchmarks.measures.measurement import Measurement
from conservative.benchmarks.measures.samples import Samples
from conservative.benchmarks.studies.study import Finding
from conservative.benchmarks.suite.points import Point
from conservative.errors import BadInput
from conservative.methods.reduced import Reduced

from ..terminal.atomic_files import text_file
from .plan import Plan
from .provenance import Provenance

FORMAT = 2
_SOURCE = (".", "references", "benchmarks")
"""What decides about a measurement; the rest of `reports` only shows it."""
_SHOWN = 3
"""How many differences a complaint has at most."""


@dataclass(frozen=True)
class Process:
    """What measured a piece: the command, when it began, and the commit (see `Provenance`)."""

    command: str
    begun: str
    commit: str


@dataclass(frozen=True)
class Piece:
    """A finished piece: its rows, lines of its pictures, and what measured it."""

    rows: tuple[Measurement, ...]
    samples: tuple[Samples, ...]
    by: Process


@dataclass(frozen=True)
class Partial:
    """The finished pieces of a report by name, and the file that has them too, except before the first."""

    path: Path
    names: tuple[str, ...]
    terms: Mapping[str, Any]
    process: Process
    pieces: dict[str, Piece] = field(default_factory=dict)

    def keep(self, name: str, findings: Iterable[Finding]) -> None:
        """Keep a finished piece, in the file as well; what an earlier report left there goes."""
        every = list(findings)
        rows = tuple(found for found in every if isinstance(found, Measurement))
        lines = tuple(found for found in every if isinstance(found, Samples))
        self.pieces[name] = Piece(rows, lines, self.process)
        with text_file(self.path, "out") as stream:
            stream.write(_as_json(self))

    def remove(self) -> None:
        """Remove the file: the report is written."""
        self.path.unlink(missing_ok=True)

    @property
    def story(self) -> str:
        """Say what is finished, where it is and how to go on."""
        if not self.pieces:
            return "nothing was finished, nothing is kept"
        command = self.process.command
        again = command if "--resume" in shlex.split(command) else f"{command} --resume"
        done = f"{len(self.pieces)} of {len(self.names)} studies are finished ({', '.join(self.pieces)})"
        return f"{done} and kept in {str(self.path)!r}; go on with: {again}"

    @property
    def earlier(self) -> tuple[str, ...]:
        """What other processes measured, one sentence each; empty where one process measured everything."""
        found = groupby(self.pieces.items(), key=lambda item: item[1].by)
        return tuple(
            f"{', '.join(name for name, _ in items)}: measured by an earlier process, which was interrupted; "
            f"begun {by.begun} at commit {by.commit} with `{by.command}`"
            for by, items in found
            if by != self.process
        )


def path_for(out: Path) -> Path:
    """Return where the unfinished work of a report into the folder `out` is kept."""
    folder = out.resolve()
    path = folder.parent / f"{folder.name}.partial.json"
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path


def begun(made: Plan, out: Path, source: Provenance, resume: bool) -> Partial:
    """Return what to begin with: nothing, or with `resume` what an earlier process has finished.

    Raises
    ------
    BadInput
        There is nothing to resume, or it was made on other terms; or the file is none of ours, so that it must stay.
    """
    path = path_for(out)
    fresh = Partial(path, made.pieces, terms(made, source), Process(source.command, source.date, source.commit))
    if not path.exists():
        if resume:
            raise BadInput("resume", f"no {str(path)!r}", "the folder --out of a report that was interrupted")
        return fresh
    was, pieces = read(path)
    if not resume:
        return fresh
    different = list(differences(was["terms"], json.loads(json.dumps(fresh.terms))))
    if different:
        more = f" and {len(different) - _SHOWN} more" if len(different) > _SHOWN else ""
        raise BadInput(
            "resume",
            f"{str(path)!r}, which was made with {'; '.join(different[:_SHOWN])}{more}",
            f"the same again (it was `{was['command']}`), or no --resume, to begin anew",
        )
    fresh.pieces.update(pieces)
    return fresh


def terms(made: Plan, source: Provenance) -> dict[str, Any]:
    """Return what has to be the same for measurements to be put together, as what JSON knows."""
    return {
        "studies": list(made.pieces),
        # What a scene is, whatever its file is called; that it is hashed as a point of `Reduced` is the same for all.
        "scenes": {scene.name: Point(scene, Reduced()).definition for scene in made.scenes},
        "methods": {method.name: method.label for method in made.methods},
        "--quick": made.quick,
        "--skip-missing": made.skip_missing,
        "source": _source_hash(),
        "machine": {key: source.machine[key] for key in ("processor", "cores")},
        "versions": {"python": source.python, **source.compared},
    }


def differences(was: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """Yield in words what differs between two terms."""
    for name in {**was, **now}:
        old, new = was.get(name), now.get(name)
        if isinstance(old, dict) and isinstance(new, dict):
            yield from (f"{name}: {key} {text}" for key, text in _between(old, new))
        elif old != new:
            yield f"{name} {_shown(old)}, now {_shown(new)}"


def _between(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for key in {**old, **new}:
        if key not in new:
            yield key, "(now without)"
        elif key not in old:
            yield key, "missing (now with)"
        elif old[key] != new[key]:
            yield key, f"{_shown(old[key])}, now {_shown(new[key])}"


def _shown(value: Any) -> str:
    return ", ".join(value) if isinstance(value, list) else str(value)


def _source_hash() -> str:
    """Return the hash of all source that decides about a measurement: a commit would not tell of changes, nor without git."""
    root = Path(__file__).parents[2]
    found = hashlib.sha256()
    for place in _SOURCE:
        path = root / place
        for file in sorted(path.rglob("*.py")):
            found.update(f"{file.relative_to(root)}\n".encode() + file.read_bytes())
    return found.hexdigest()[:12]


def _as_json(partial: Partial) -> str:
    """Return the file: floats come back as they are, nan as nan."""
    pieces = {
        name: {
            "by": vars(piece.by),
            "rows": list(map(measurement.flat, piece.rows)),
            "samples": list(map(samples.flat, piece.samples)),
        }
        for name, piece in partial.pieces.items()
    }
    content = {"format": FORMAT, "command": partial.process.command, "terms": partial.terms, "pieces": pieces}
    return json.dumps(content, ensure_ascii=False)


def read(path: Path) -> tuple[dict[str, Any], dict[str, Piece]]:
    """Return the content of a file of unfinished work, and its pieces.

    Raises
    ------
    BadInput
        It cannot be read, or is something else.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if content["format"] != FORMAT:
            raise ValueError(f"format {content['format']}")
        pieces = {
            name: Piece(
                tuple(map(measurement.from_flat, piece["rows"])),
                tuple(map(samples.from_flat, piece["samples"])),
                Process(**piece["by"]),
            )
            for name, piece in content["pieces"].items()
        }
        return {"command": str(content["command"]), "terms": dict(content["terms"])}, pieces
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        allowed = "unfinished work that an interrupted report left, or no such file: remove it"
        raise BadInput("out", f"{str(path)!r} ({type(error).__name__}: {error})", allowed) from None
