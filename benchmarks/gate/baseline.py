"""The baseline: the value and the limit of every row, and the reason for every change. A hash shows edits by hand."""

from __future__ import annotations

import hashlib
import json
import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from conservative.errors import BadInput
from conservative.files import make_folder, write_text
from conservative.trajectory import Counters

from ..measures.measure import Measure
from .results import Results, Row, Status, find_runaway

PATH = Path("benchmarks") / "baseline.json"
"""Where a project keeps its baseline, relative to its root."""
FORMAT = 1
ORDER = Measure.ORDER.text
COUNTS = tuple(field.name for field in fields(Counters))
"""Measures that are whole numbers: the work that a method counts."""
SPREADS = 5.0
"""How many times its measured spread a value may move."""
ROUND_OFF = 8 * 2.0**-52
"""How far any error or drift may move: a change of the last digits is none."""
ORDER_MARGIN = 0.05
"""How far an observed order may fall."""
FALSE_ALARMS = 0.01
"""Share of the runs of an unchanged commit that may fail because of a time, all rows together."""
REPEATS = 5
"""With fewer repeats the spread is unknown, and the threshold is the widest."""
NARROWEST, WIDEST = 0.05, 0.10
"""Limits of the threshold of a time ratio, as a part: below the first, another build differs as much; above the second, a
slow-down of 20 % would not be seen 95 times in 100."""


class NoBaseline(BadInput):
    """There is no baseline that can be used: exit code 2, never a pass."""


@dataclass(frozen=True)
class Allowed:
    """A value as it was, the spread measured about it, in how many runs, and the limit that follows."""

    value: float
    spread: float
    runs: int
    limit: float


@dataclass(frozen=True)
class BaselineRow:
    """A row of a baseline: what it is of, its measures, and its time ratio on each machine."""

    scene: str
    method: str
    engine: str
    definition: str
    measures: Mapping[str, Allowed]
    time_ratios: Mapping[str, Allowed] = field(default_factory=dict)


@dataclass(frozen=True)
class Baseline:
    """The rows by id, and every change of them with its reason, oldest first."""

    rows: Mapping[str, BaselineRow]
    history: Sequence[Mapping[str, Any]]


def limit(measure: str, value: float, spread: float) -> float:
    """Return the worst value that passes: above it for errors, drifts and counts, below it for an observed order."""
    if measure == ORDER:
        return value - ORDER_MARGIN
    return value + (SPREADS * spread if measure in COUNTS else max(SPREADS * spread, 1e-6 * abs(value), ROUND_OFF))


def time_limit(ratios: Sequence[float], rows: int) -> Allowed:
    """Return the largest time ratio that passes, from repeats of the same commit on the same machine.

    The next logarithm exceeds their middle by t s sqrt(1 + 1/n) with a probability that a quantile t of Student's distribution
    gives: `FALSE_ALARMS` for all rows together, divided among them. Middle and spread s are the median and the median distance
    from it, scaled to a standard deviation, as a repeat in a slow spell of the machine says nothing about the others. The
    result is kept between `NARROWEST` and `WIDEST`.
    """
    from scipy.stats import t

    logarithms = [math.log(ratio) for ratio in ratios]
    n = len(logarithms)
    middle = statistics.median(logarithms)
    spread = 1.4826 * statistics.median(abs(logarithm - middle) for logarithm in logarithms)
    margin = WIDEST
    if n >= REPEATS:
        quantile = float(t.ppf(1 - FALSE_ALARMS / rows, n - 1))
        margin = min(max(quantile * spread * math.sqrt(1 + 1 / n), NARROWEST), WIDEST)
    value = math.exp(middle)
    return Allowed(value, spread * value, n, value * (1 + margin))


def update_baseline(old: Baseline | None, runs: Sequence[Results], reason: str) -> Baseline:
    """Return the baseline that accepts runs of one commit, with the reason in its history.

    Time ratios of machines that took no part stay. Rows that were not run, or skipped, are dropped, which the history says.

    Raises
    ------
    BadInput
        No reason is given, a row failed, or the runs disagree about which rows there are or how they are defined.
    """
    if not reason.strip():
        raise BadInput("update", repr(reason), "the reason for the change, which goes into the history of the baseline")
    before = old.rows if old else {}
    failed = [row.id for run in runs for row in run.rows.values() if row.status in (Status.FAILED, Status.ERROR)]
    if failed:
        raise BadInput("results", f"rows that failed: {', '.join(failed)}", "runs without failures: a failure is not accepted")
    timed = sum(row.time_ratio is not None for row in runs[0].rows.values())
    rows = {row.id: _row(row, runs, before.get(row.id), timed) for row in runs[0].rows.values() if row.status is Status.PASSED}
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


def _row(first: Row, runs: Sequence[Results], before: BaselineRow | None, timed: int) -> BaselineRow:
    same = [run.rows[first.id] for run in runs if first.id in run.rows]
    kinds = {(row.status, row.definition, row.engine) for row in same}
    if len(same) < len(runs) or len(kinds) > 1:
        raise BadInput("results", f"runs that disagree about {first.id}", "runs of the same benchmarks with the same engines")
    keep = before is not None and before.definition == first.definition
    ratios = dict(before.time_ratios) if before and keep and first.time_ratio is not None else {}
    for machine in dict.fromkeys(run.machine for run in runs):
        found = [run.rows[first.id].time_ratio for run in runs if run.machine == machine]
        if first.time_ratio is not None:
            ratios[machine] = time_limit([ratio for ratio in found if ratio is not None], timed)
    return BaselineRow(
        first.scene, first.method, first.engine, first.definition, {name: _measure(name, same) for name in first.values}, ratios
    )


def _measure(name: str, rows: Sequence[Row]) -> Allowed:
    """Return the limit that follows from the spread within and between runs."""
    values = [row.values[name] for row in rows]
    if not all(math.isfinite(value) for value in values):
        raise BadInput("results", f"{name} = {values} of {rows[0].id}", "finite values: what is not a number is not accepted")
    if runaway := find_runaway({name: max(values)}):
        raise BadInput("results", f"{rows[0].id}, whose {runaway}", "runs that keep their energy: a failure is not accepted")
    spread = max(max(row.spreads.get(name, 0.0) for row in rows), max(values) - min(values))
    value = statistics.median(values)
    return Allowed(value, spread, len(values), limit(name, value, spread))


def read(path: Path) -> Baseline:
    """Return the baseline in a file.

    Raises
    ------
    NoBaseline
        There is no file, it is cut off, it was edited by hand, or its format is another.
    """
    allowed = 'a baseline, which `conservative gate --update "REASON"` writes'
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise NoBaseline("baseline", f"no baseline: {path} ({error.strerror})", allowed) from None
    except ValueError as error:
        raise NoBaseline("baseline", f"truncated or damaged: {path} ({error})", allowed) from None
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise NoBaseline("baseline", f"another format: {path}", f"{allowed}, of format {FORMAT}")
    if content.pop("sha256", None) != _digest(content):
        raise NoBaseline("baseline", f"edited by hand: {path}, whose content does not have its own sha256", allowed)
    rows = {id: _row_from(row) for id, row in content["rows"].items()}
    return Baseline(rows, content["history"])


def write(baseline: Baseline, path: Path) -> None:
    """Write a baseline, with the hash that tells a hand's edit or a merge from an update. Raise `NotWritten` if that fails."""
    rows = {id: _row_as_json(row) for id, row in sorted(baseline.rows.items())}
    content = {"format": FORMAT, "rows": rows, "history": list(baseline.history)}
    make_folder(path.parent, "baseline")
    write_text(path, json.dumps({**content, "sha256": _digest(content)}, indent=1) + "\n", "baseline")


def _digest(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _row_as_json(row: BaselineRow) -> dict[str, Any]:
    measures = {name: vars(allowed) for name, allowed in row.measures.items()}
    ratios = {machine: vars(allowed) for machine, allowed in row.time_ratios.items()}
    return {**vars(row), "measures": measures, "time_ratios": ratios}


def _row_from(row: Mapping[str, Any]) -> BaselineRow:
    measures = {name: Allowed(**allowed) for name, allowed in row["measures"].items()}
    ratios = {machine: Allowed(**allowed) for machine, allowed in row["time_ratios"].items()}
    return BaselineRow(**{**row, "measures": measures, "time_ratios": ratios})
