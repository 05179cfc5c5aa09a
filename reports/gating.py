"""What `conservative gate` does: read results and baseline, and compare or accept."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import cast

from benchmarks import baseline, results
from benchmarks import gate as comparison


def gate(paths: Sequence[Path], kept: Path | None, times: str) -> tuple[str, bool]:
    """Return the verdicts on each file of results as text, and whether all passed.

    Raises
    ------
    BadInput
        A file holds no results, or there is no baseline.
    """
    before = baseline.read(kept or baseline.PATH)
    verdicts = [comparison.judged(before, found, cast(comparison.Times, times)) for found in _read(paths)]
    return "\n".join(map(str, verdicts)), all(verdict.passed for verdict in verdicts)


def update(paths: Sequence[Path], kept: Path | None, reason: str) -> tuple[str, bool]:
    """Write the baseline that accepts results, and return what changed.

    Raises
    ------
    BadInput
        A file holds no results, no reason is given, or the results cannot be accepted; the baseline is there but damaged.
    """
    path = kept or baseline.PATH
    before = baseline.read(path) if path.exists() else None
    after = baseline.updated(before, _read(paths), reason)
    baseline.write(after, path)
    entry = after.history[-1]
    changes = [f"{len(entry[kind])} {kind}" for kind in ("added", "changed", "removed")]
    return f"{path}: {len(after.rows)} rows from {entry['runs']} runs; {', '.join(changes)}", True


def _read(paths: Sequence[Path]) -> list[results.Results]:
    return [results.read(path) for path in (paths or [results.FOLDER / results.FILE])]
