"""Answers of the gate as text and JSON: verdicts on results, and results that were accepted."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, cast

from conservative.benchmarks.gate import baseline, results
from conservative.benchmarks.gate import compare as comparison


@dataclass(frozen=True)
class Comparison:
    """The verdict on each file of results."""

    verdicts: Sequence[comparison.Verdict]

    @property
    def passed(self) -> bool:
        """Whether the gate is passed by all."""
        return all(verdict.passed for verdict in self.verdicts)

    def json_text(self) -> str:
        """Return verdicts with their violations and notes as JSON."""
        verdicts = [{"passed": verdict.passed, **asdict(verdict)} for verdict in self.verdicts]
        return json.dumps({"passed": self.passed, "verdicts": verdicts}, indent=2, ensure_ascii=False)

    def __str__(self) -> str:
        return "\n".join(map(str, self.verdicts))


@dataclass(frozen=True)
class Acceptance:
    """The baseline that was written, how many rows it has, and the new entry of its history."""

    path: Path
    rows: int
    entry: Mapping[str, Any]
    passed: bool = True

    def json_text(self) -> str:
        """Return it as JSON."""
        content = {"passed": self.passed, "baseline": str(self.path), "rows": self.rows, "entry": dict(self.entry)}
        return json.dumps(content, indent=2, ensure_ascii=False)

    def __str__(self) -> str:
        changes = [f"{len(self.entry[kind])} {kind}" for kind in ("added", "changed", "removed")]
        return f"{self.path}: {self.rows} rows from {self.entry['runs']} runs; {', '.join(changes)}"


def compare(paths: Sequence[Path], path: Path | None, times: str) -> Comparison:
    """Return the verdicts on each file of results against the baseline at `path`, by default the project's.

    Raises
    ------
    BadInput
        A file holds no results, or there is no baseline.
    """
    before = baseline.read(path or baseline.PATH)
    return Comparison([comparison.judge(before, content, cast(comparison.Times, times)) for content in _read(paths)])


def accept(paths: Sequence[Path], path: Path | None, reason: str) -> Acceptance:
    """Write the baseline that accepts results, and return what changed.

    Raises
    ------
    BadInput
        A file holds no results, no reason is given, or the results cannot be accepted; the baseline is there but damaged.
    """
    target = path or baseline.PATH
    before = baseline.read(target) if target.exists() else None
    after = baseline.update_baseline(before, _read(paths), reason)
    baseline.write(after, target)
    return Acceptance(target, len(after.rows), after.history[-1])


def _read(paths: Sequence[Path]) -> list[results.Results]:
    return [results.read(path) for path in (paths or [results.FOLDER / results.FILE])]
