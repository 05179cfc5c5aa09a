"""What is measured of a report that is not written yet: one file beside its folder, so that `--resume` can go on.

The file is replaced as a whole after each study, and goes when the report is there. It says on which terms it was measured:
measurements are only ever put together with others of the same scenes, methods, versions, source and machine.
"""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import groupby
from pathlib import Path
from typing import Any

from conservative.benchmarks.measures import measurement
from conservative.benchmarks.measures.measurement import Measurement, Samples
from conservative.benchmarks.studies.study import Finding
from conservative.errors import BadInput
from conservative.files import remove_leftovers, write_text

from .plan import Plan
from .provenance import Provenance
from .terms import differences, terms

FORMAT = 2
_BEGINNING = '{"format": '
"""How every file of unfinished work begins."""
_MOST_DIFFERENCES = 3
"""How many differences a complaint has at most."""


@dataclass(frozen=True)
class Origin:
    """What measured a study: the command, when it began, and the commit (see `Provenance`)."""

    command: str
    start: str
    commit: str


@dataclass(frozen=True)
class StudyResult:
    """All that one study measured: its rows, lines of its pictures, and the process that measured it."""

    rows: tuple[Measurement, ...]
    samples: tuple[Samples, ...]
    by: Origin


@dataclass(frozen=True)
class Checkpoint:
    """The studies of a report that are done, by name, and the file that has them too, except before the first.

    Attributes: `path` of the file, `names` of all studies, `terms` (see `terms`), the `process` that goes on, and `results`.
    """

    path: Path
    names: tuple[str, ...]
    terms: Mapping[str, Any]
    process: Origin
    results: dict[str, StudyResult] = field(default_factory=dict)

    def keep(self, name: str, findings: Iterable[Finding]) -> None:
        """Keep what a study finds, in the file as well; what an earlier report left there goes. Raise `NotWritten` of it."""
        every = list(findings)
        rows = tuple(finding for finding in every if isinstance(finding, Measurement))
        lines = tuple(finding for finding in every if isinstance(finding, Samples))
        result = StudyResult(rows, lines, self.process)
        write_text(self.path, _content(replace(self, results={**self.results, name: result})), "out")
        self.results[name] = result

    def remove(self) -> None:
        """Remove the file: the report is written."""
        self.path.unlink(missing_ok=True)
        remove_leftovers(self.path)

    @property
    def summary(self) -> str:
        """What is done, where it is and how to go on, in words."""
        if not self.results:
            return "nothing was finished, nothing is kept"
        command = self.process.command
        again = command if "--resume" in shlex.split(command) else f"{command} --resume"
        done = f"{len(self.results)} of {len(self.names)} studies are finished ({', '.join(self.results)})"
        return f"{done} and kept in {str(self.path)!r}; go on with: {again}"

    def describe_earlier(self) -> tuple[str, ...]:
        """Return what other processes measured, one sentence each; empty where one process measured everything."""
        return tuple(
            f"{', '.join(name for name, _ in items)}: measured by an earlier process, which was interrupted; "
            f"begun {by.start} at commit {by.commit} with `{by.command}`"
            for by, items in groupby(self.results.items(), key=lambda item: item[1].by)
            if by != self.process
        )


def path_for(out: Path) -> Path:
    """Return where the unfinished work of a report into the folder `out` is kept."""
    folder = out.resolve()
    path = folder.parent / f"{folder.name}.partial.json"
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path


def find_unfinished(out: Path) -> Path | None:
    """Return the file of an unfinished report into the folder `out`, whole or damaged; None if there is none.

    Raises
    ------
    BadInput
        The file was not written by a report, so that it must not be replaced.
    """
    path = path_for(out)
    if not path.exists():
        return None
    try:
        with path.open("rb") as stream:
            if stream.read(len(_BEGINNING)) != _BEGINNING.encode():
                raise BadInput("out", f"{str(path)!r}, which no report wrote", "a folder without such a file beside it")
    except OSError as error:
        raise BadInput("out", f"{str(path)!r} ({error.strerror})", "a file that can be read, or none of this name") from None
    return path


def begin(plan: Plan, out: Path, source: Provenance, resume: bool) -> Checkpoint:
    """Return the checkpoint to begin with: empty, or with `resume` with the studies of an unfinished report.

    Raises
    ------
    BadInput
        There is nothing to resume, or it was measured on other terms or is damaged; or the file was not written by a report.
    """
    path = find_unfinished(out)
    process = Origin(source.command, source.date, source.commit)
    fresh = Checkpoint(path_for(out), plan.names, terms(plan, source), process)
    if resume:
        if path is None:
            raise BadInput("resume", f"no {str(fresh.path)!r}", "the folder --out of a report that was interrupted")
        before, results = read(path)
        _require_same_terms(path, before, fresh.terms)
        fresh.results.update(results)
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
    results = {name: _record(result) for name, result in checkpoint.results.items()}
    content = {"format": FORMAT, "command": checkpoint.process.command, "terms": checkpoint.terms, "pieces": results}
    return json.dumps(content, ensure_ascii=False)


def _record(result: StudyResult) -> dict[str, Any]:
    return {
        "by": vars(result.by),
        "rows": list(map(measurement.flat, result.rows)),
        "samples": list(map(measurement.flat_samples, result.samples)),
    }


def _result(record: Mapping[str, Any]) -> StudyResult:
    return StudyResult(
        tuple(map(measurement.from_flat, record["rows"])),
        tuple(map(measurement.samples_from_flat, record["samples"])),
        Origin(**record["by"]),
    )


def read(path: Path) -> tuple[dict[str, Any], dict[str, StudyResult]]:
    """Return the command and terms of a file of unfinished work, and its results.

    Raises
    ------
    BadInput
        It cannot be read, or is something else.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if content["format"] != FORMAT:
            raise ValueError(f"format {content['format']}")
        results = {name: _result(record) for name, record in content["pieces"].items()}
        return {"command": str(content["command"]), "terms": dict(content["terms"])}, results
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        got = f"{str(path)!r}, which is damaged ({type(error).__name__}: {error})"
        raise BadInput("resume", got, "a file that an interrupted report of this version left, or no --resume") from None
