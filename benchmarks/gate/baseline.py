"""The stored baseline: values and limits of every row, and the reason of every change. A hash shows edits by hand."""

from __future__ import annotations

import hashlib
import json
import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from conservative.errors import BadInput
from conservative.files import make_folder, read_text, write_text
from conservative.outcome import OutcomeKind
from conservative.trajectory import Counters

from ..measures.change import Range
from ..measures.errors import LOST, is_lost
from ..measures.measure import Measure
from .results import Results, Row, find_runaway

PATH = Path("benchmarks") / "baseline.json"
"""Path of a project's baseline, relative to its root."""
FORMAT, WITH_TIMES = 2, 1
"""Format of the file, and the format of baselines that also held times."""
ORDER, ATTITUDE = Measure.ORDER.text, Measure.ATTITUDE_MAX.text
COUNTS = tuple(field.name for field in fields(Counters))
"""Measures that are whole numbers: the work that a method counts."""
SPREADS = 5.0
"""Largest allowed change of a value, in units of its measured spread."""
ROUND_OFF = 8 * 2.0**-52
"""Smallest allowed change of an error or a drift: the last digits."""
ORDER_MARGIN = 0.05
"""Largest allowed decrease of an observed order."""


class NothingToCompare(BadInput):
    """No row can be compared: exit code 2, never a pass."""


class NoBaseline(NothingToCompare):
    """There is no usable baseline."""


@dataclass(frozen=True)
class Allowed:
    """A value, its measured spread, the number of runs, and the limit that follows from them."""

    value: float
    spread: float
    runs: int
    limit: float

    @property
    def range(self) -> Range:
        """The values that are no change: to the limit, and as far on the other side."""
        return Range(self.value, *sorted((self.limit, 2 * self.value - self.limit)))


@dataclass(frozen=True)
class BaselineRow:
    """A row of a baseline: scene, method, version of a foreign engine, hash of the definition, and measures by name."""

    scene: str
    method: str
    engine: str
    definition: str
    measures: Mapping[str, Allowed]


@dataclass(frozen=True)
class Baseline:
    """The rows by id, and every change of them with its reason, oldest first."""

    rows: Mapping[str, BaselineRow]
    history: Sequence[Mapping[str, Any]]


def limit(measure: str, value: float, spread: float) -> float:
    """Return the worst value that passes: above it for errors, drifts and counts, below it for an observed order.

    No interval: values do not scatter between processes. They change by the last digits of the start only, and `spread` is the
    range of a few of such changes, of which nothing is known about the tails. An attitude that none of these changes loses
    may not be lost: next to a separatrix, a spread of 0.16 rad would otherwise allow 0.46 rad to become 1.26 rad.
    """
    if measure == ORDER:
        return value - ORDER_MARGIN
    if measure in COUNTS:
        return value + SPREADS * spread
    largest = value + max(SPREADS * spread, 1e-6 * abs(value), ROUND_OFF)
    return min(largest, LOST) if measure == ATTITUDE and not is_lost(value + spread) else largest


def update_baseline(old: Baseline | None, runs: Sequence[Results], reason: str) -> Baseline:
    """Return the baseline that accepts runs of one commit, with the reason in its history.

    Rows that were not run, or skipped, are dropped; the history lists them. Those that a run left out stay.

    Raises
    ------
    BadInput
        No reason is given, a row failed, or the runs disagree about which rows there are or how they are defined.
    """
    if not reason.strip():
        raise BadInput("update", repr(reason), "the reason for the change, which goes into the history of the baseline")
    before = old.rows if old else {}
    accepted = (OutcomeKind.OK, OutcomeKind.SKIPPED)
    failed = [row.id for run in runs for row in run.rows.values() if row.outcome.kind not in accepted]
    if failed:
        raise BadInput("results", f"rows that failed: {', '.join(failed)}", "runs without failures: a failure is not accepted")
    rows = {row.id: _row(row, runs) for row in runs[0].rows.values() if row.outcome.ok}
    left_out = {id for run in runs for id in run.left_out}
    rows = {id: row for id, row in before.items() if id in left_out and id not in runs[0].rows} | rows
    entry = {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "reason": reason.strip(),
        "commit": runs[0].commit,
        "runs": len(runs),
        "machines": sorted({run.machine for run in runs}),
        "added": sorted(rows.keys() - before.keys()),
        "removed": sorted(before.keys() - rows.keys()),
        "changed": sorted(id for id in rows.keys() & before.keys() if rows[id] != before[id]),
    }
    return Baseline(rows, [*(old.history if old else ()), entry])


def _row(first: Row, runs: Sequence[Results]) -> BaselineRow:
    same = [run.rows[first.id] for run in runs if first.id in run.rows]
    kinds = {(row.outcome, row.definition, row.engine) for row in same}
    if len(same) < len(runs) or len(kinds) > 1:
        raise BadInput("results", f"runs that disagree about {first.id}", "runs of the same benchmarks with the same engines")
    measures = {name: _measure(name, same) for name in first.values}
    return BaselineRow(first.scene, first.method, first.engine, first.definition, measures)


def _measure(name: str, rows: Sequence[Row]) -> Allowed:
    """Return the limit that follows from the spread within and between runs."""
    values = [row.values[name] for row in rows]
    if not all(math.isfinite(value) for value in values):
        raise BadInput("results", f"{name} = {values} of {rows[0].id}", "finite values: NaN is not accepted")
    spreads = [row.spreads.get(name, 0.0) for row in rows]
    if not all(0 <= spread < math.inf for spread in spreads):
        raise BadInput("results", f"spreads {spreads} of {name} of {rows[0].id}", "finite spreads of 0 or more")
    if runaway := find_runaway({name: max(values)}):
        raise BadInput("results", f"{rows[0].id}, whose {runaway}", "runs that keep their energy: a failure is not accepted")
    spread = max(*spreads, max(values) - min(values))
    value = statistics.median(values)
    return Allowed(value, spread, len(values), limit(name, value, spread))


def read(path: Path, also_with_times: bool = False) -> Baseline:
    """Return the baseline in a file; with `also_with_times` also from the format that held times, without them.

    Raises
    ------
    NoBaseline
        There is no file, it is cut off, it was edited by hand, or it has another format.
    """
    allowed = 'a baseline, which `conservative gate --update "REASON"` writes'
    try:
        content = json.loads(read_text(path))
    except OSError as error:
        raise NoBaseline("baseline", f"no baseline: {path} ({error.strerror})", allowed) from None
    except (ValueError, RecursionError) as error:
        raise NoBaseline("baseline", f"truncated or damaged: {path} ({error})", allowed) from None
    version = content.get("format") if isinstance(content, dict) else None
    if version == WITH_TIMES and not also_with_times:
        again = f'format {FORMAT}; run the benchmarks, then `conservative gate --update "REASON"`'
        raise NoBaseline("baseline", f"format {WITH_TIMES} of an earlier version, with times: {path}", again)
    if version not in (FORMAT, WITH_TIMES):
        raise NoBaseline("baseline", f"another format: {path}", f"{allowed}, of format {FORMAT}")
    if content.pop("sha256", None) != _digest(content):
        raise NoBaseline("baseline", f"edited by hand: {path}, whose content does not have its own sha256", allowed)
    rows = {}
    for id, row in content["rows"].items():
        row.pop("time_ratios", None)
        rows[id] = BaselineRow(**{**row, "measures": {name: Allowed(**limit) for name, limit in row["measures"].items()}})
    return Baseline(rows, content["history"])


def write(baseline: Baseline, path: Path) -> None:
    """Write a baseline and a hash of it, which shows edits by hand and merges. Raise `NotWritten` if that fails."""
    rows = {
        id: {**vars(row), "measures": {name: vars(allowed) for name, allowed in row.measures.items()}}
        for id, row in sorted(baseline.rows.items())
    }
    content = {"format": FORMAT, "rows": rows, "history": list(baseline.history)}
    make_folder(path.parent, "baseline")
    write_text(path, json.dumps({**content, "sha256": _digest(content)}, indent=1) + "\n", "baseline")


def _digest(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
