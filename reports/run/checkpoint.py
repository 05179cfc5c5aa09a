"""The measurements of an unfinished report, in a file next to its folder, from which `--resume` continues.

The file is replaced as a whole after each study and removed when the report is written. It contains the terms of the
measurements: only measurements of the same scenes, methods, versions, source and machine are combined.
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

from conservative.benchmarks.measures import measurement
from conservative.benchmarks.measures.measurement import Measurement, Samples
from conservative.benchmarks.studies.study import Finding
from conservative.errors import BadInput
from conservative.files import open_file, read_text, remove_leftovers, write_text

from .plan import Plan
from .provenance import Provenance
from .verification import Verified, from_plain, to_plain

FORMAT = 5
VERIFICATION = "verification"
"""Name of the verification of engines among the parts of a report; the other parts are studies."""
_BEGINNING = '{"format": '
"""First characters of every file of unfinished work."""
_MOST_DIFFERENCES = 3
"""Largest number of differences in a message."""
_PACKAGES = (".", "references", "benchmarks")
"""Packages whose source determines measurements. `reports` only shows them.

`.` is `conservative` itself. In a checkout the other two are links in it, which `rglob` does not follow.
"""


Result = Finding | Verified
"""A result of a study, or of the verification."""
Origin = dict[str, str]
"""A process: its `command`, `start` time and `commit` (see `Provenance`)."""


@dataclass(frozen=True)
class StudyResult:
    """The findings of a study or of the verification, and the process that measured it."""

    findings: tuple[Result, ...]
    by: Origin


@dataclass(frozen=True)
class Checkpoint:
    """The finished studies of a report by name, which are also in a file.

    Attributes: `path` of the file, `names` of all studies and of the verification, `terms` (see `terms`), the current
    `process`, and `results`.
    """

    path: Path
    names: tuple[str, ...]
    terms: Mapping[str, Any]
    process: Origin
    results: dict[str, StudyResult] = field(default_factory=dict)

    def store(self, name: str, findings: Iterable[Result]) -> None:
        """Store the findings of a study, also in the file. Raise `NotWritten` if that fails."""
        result = StudyResult(tuple(findings), self.process)
        studies = {
            name: {
                "by": stored.by,
                "rows": [measurement.flat(row) for row in stored.findings if isinstance(row, Measurement)],
                "samples": [measurement.flat_samples(line) for line in stored.findings if isinstance(line, Samples)],
                "verified": to_plain(part for part in stored.findings if isinstance(part, Verified)),
            }
            for name, stored in {**self.results, name: result}.items()
        }
        content = {"format": FORMAT, "command": self.process["command"], "terms": self.terms, "studies": studies}
        write_text(self.path, json.dumps(content, ensure_ascii=False), "out")  # floats are restored exactly, NaN as NaN
        self.results[name] = result

    def remove(self) -> None:
        """Remove the file: the report is written."""
        self.path.unlink(missing_ok=True)
        remove_leftovers(self.path)

    @property
    def summary(self) -> str:
        """The finished studies, their file, and the command that continues, in words."""
        if not self.results:
            return "no study was finished"
        command = self.process["command"]
        again = command if "--resume" in shlex.split(command) else f"{command} --resume"
        done = f"{len(self.results)} of {len(self.names)} studies are finished ({', '.join(self.results)})"
        return f"{done} and stored in {str(self.path)!r}; continue with: {again}"

    def describe_earlier(self) -> tuple[str, ...]:
        """Return a sentence for each other process that measured a part; empty if one process measured everything."""
        return tuple(
            f"{', '.join(name for name, _ in items)}: measured by an earlier process, which was interrupted; "
            f"started {by['start']} at commit {by['commit']} with `{by['command']}`"
            for by, items in groupby(self.results.items(), key=lambda item: item[1].by)
            if by != self.process
        )


def path_for(out: Path) -> Path:
    """Return the file for the unfinished work of a report into the folder `out`."""
    folder = out.resolve()
    path = folder.parent / f"{folder.name}.partial.json"
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path


def find_unfinished(out: Path) -> Path | None:
    """Return the file of an unfinished report into the folder `out`, whole or damaged; None if there is none.

    Raises
    ------
    BadInput
        The file was not written by a report and must not be replaced.
    """
    path = path_for(out)
    if not path.exists():
        return None
    try:
        with open_file(path) as stream:
            if stream.read(len(_BEGINNING)) != _BEGINNING.encode():
                raise BadInput("out", f"{str(path)!r}, which no report wrote", "a folder without such a file next to it")
    except OSError as error:
        raise BadInput("out", f"{str(path)!r} ({error.strerror})", "a readable file, or no file of this name") from None
    return path


def begin(plan: Plan, out: Path, source: Provenance, resume: bool) -> Checkpoint:
    """Return the first checkpoint: empty, or the studies of an unfinished report if `resume`.

    Raises
    ------
    BadInput
        There is nothing to resume, its terms differ or it is damaged; or the file was not written by a report.
    """
    path = find_unfinished(out)
    process = {"command": source.command, "start": source.date, "commit": source.commit}
    names = (*plan.names, *[VERIFICATION] * plan.verified)
    fresh = Checkpoint(path_for(out), names, terms(plan, source), process)
    if not resume:
        return fresh
    if path is None:
        raise BadInput("resume", f"no {str(fresh.path)!r}", "the folder --out of a report that was interrupted")
    for scene in plan.scenes:
        if unknown := scene.identity.unknown:
            got = f"True, for the scene {scene.name!r} with {unknown}, which cannot be compared with the earlier scene"
            raise BadInput("resume", got, "no --resume, to start again, or scenes made of numbers, tables and pure functions")
    command, before, results = read(path)
    # The new terms as they would be read back.
    if different := list(differences(before, json.loads(json.dumps(fresh.terms)))):
        more = f" and {len(different) - _MOST_DIFFERENCES} more" if len(different) > _MOST_DIFFERENCES else ""
        got = f"{str(path)!r}, which was made with {'; '.join(different[:_MOST_DIFFERENCES])}{more}"
        raise BadInput("resume", got, f"the same again (it was `{command}`), or no --resume, to start again")
    fresh.results.update(results)
    return fresh


def terms(plan: Plan, source: Provenance) -> dict[str, dict[str, Any]]:
    """Return the terms of measurements as JSON values, in groups."""
    return {
        "studies": dict.fromkeys(plan.names, ""),
        "scenes": {scene.name: f"{scene.key[:16]}, step {scene.dt:g} s" for scene in plan.scenes},
        "methods": {method.name: method.label for method in plan.methods},
        "engines": {method.name: method.label for method in plan.engines},
        "environments": {lock.name: ", ".join(lock.packages) for lock in plan.locks},
        "options": {
            "--quick": plan.quick,
            "--skip-missing": plan.skip_missing,
            "--time-limit": plan.time_limit,
            "--bodies": plan.bodies,
            "--seed": plan.seed,
        },
        "source": {"hash": _source_hash()},
        "machine": {key: source.machine[key] for key in ("processor", "cores")},
        "versions": {"python": source.python, **source.compared},
    }


def _source_hash() -> str:
    """Return the hash of all source that determines measurements. A commit does not show local changes and needs git."""
    root = Path(__file__).parents[2]
    digest = hashlib.sha256()
    for file in sorted(
        {file for package in _PACKAGES for file in (root / package).rglob("*.py")} - set((root / "reports").rglob("*"))
    ):
        digest.update(f"{file.relative_to(root)}\n".encode() + file.read_bytes())
    return digest.hexdigest()[:12]


def differences(before: Mapping[str, Mapping[str, Any]], now: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """Yield the differences between two terms, in words."""
    for group in {**before, **now}:
        old, new = before.get(group, {}), now.get(group, {})
        for key in {**old, **new}:
            if key not in new:
                yield f"{group}: {key} (now without)"
            elif key not in old:
                yield f"{group}: {key} missing (now with)"
            elif old[key] != new[key]:
                yield f"{group}: {key} {old[key]}, now {new[key]}"


def read(path: Path) -> tuple[str, dict[str, Any], dict[str, StudyResult]]:
    """Return command, terms and results of a file of unfinished work.

    Raises
    ------
    BadInput
        It cannot be read, or is another kind of file.
    """
    try:
        content = json.loads(read_text(path))
        if content["format"] != FORMAT:
            raise ValueError(f"format {content['format']}")
        results = {
            name: StudyResult(
                (
                    *map(measurement.from_flat, record["rows"]),
                    *map(measurement.samples_from_flat, record["samples"]),
                    *from_plain(record["verified"]),
                ),
                {name: record["by"][name] for name in ("command", "start", "commit")},
            )
            for name, record in content["studies"].items()
        }
        return str(content["command"]), dict(content["terms"]), results
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        got = f"{str(path)!r}, which is damaged ({type(error).__name__}: {error})"
        raise BadInput("resume", got, "a file that an interrupted report of this version left, or no --resume") from None
