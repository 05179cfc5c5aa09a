"""The rows of one run of benchmarks, and their file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from conservative.errors import BadInput
from conservative.files import make_folder, read_text, write_text
from conservative.outcome import Outcome, OutcomeKind

from ..measures.measure import Measure, Value

FOLDER = Path(".benchmarks") / "gate"
"""Path of the results of a gated run, relative to the root of the project."""
FILE = "results.json"
HISTORY = "bencher.json"
"""The rows once more, for the service Bencher, which draws them over time."""
RUNAWAY = 1.0
"""Relative energy drift above which a run has failed, even if it ended without an error."""
ENERGY_DRIFT = Value(Measure.DRIFT_MAX, RUNAWAY, "energy").key


@dataclass(frozen=True)
class Row:
    """One benchmark.

    Attributes
    ----------
    id, scene, method
        Name of the test with its parameters, and names for readers.
    outcome
        Outcome of the run, with the reason why there are no values.
    engine
        Name and version of a foreign engine, such as `mujoco==4.0.0/RK4`; empty for the project under test.
    definition
        Hash of scene, method and steps.
    values, spreads
        Measures that must not get worse, and the change of each by round-off alone.
    seconds
        Shortest time of a call, s, which is not gated; 0 if it was not timed.
    mistake, cause
        Keys of the mistakes that explain the motion, and their sentences; only of two versions.
    """

    id: str
    scene: str
    method: str
    outcome: Outcome
    engine: str = ""
    definition: str = ""
    values: Mapping[str, float] = field(default_factory=dict)
    spreads: Mapping[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    mistake: str = ""
    cause: str = ""


@dataclass(frozen=True)
class Results:
    """The rows of one run, by id, its machine and commit, and the ids of benchmarks that exist and were not selected."""

    machine: str
    rows: Mapping[str, Row]
    commit: str = ""
    left_out: tuple[str, ...] = ()


def find_runaway(values: Mapping[str, float]) -> str:
    """Return the reason why a run counts as a runaway; empty if it does not."""
    drift = values.get(ENERGY_DRIFT, 0.0)
    return "" if drift <= RUNAWAY else f"{ENERGY_DRIFT} is {drift:.2g}, more than {RUNAWAY:g}: the run failed"


def write(results: Results, path: Path) -> None:
    """Write results as JSON, with NaN as NaN, and beside them the file for Bencher. Raise `NotWritten` if that fails."""
    rows = [{**vars(row), "outcome": vars(row.outcome)} for row in results.rows.values()]
    content = {**vars(results), "rows": rows}
    make_folder(path.parent, "results")
    write_text(path, json.dumps(content, indent=1) + "\n", "results")
    write_text(path.with_name(HISTORY), json.dumps(to_bencher(results), indent=1) + "\n", "results")


def to_bencher(results: Results) -> dict[str, dict[str, dict[str, float]]]:
    """Return the rows that passed in Bencher's metric format: accuracy with its spread, and the time as `latency`, ns."""
    rows: dict[str, dict[str, dict[str, float]]] = {}
    for row in results.rows.values():
        if row.outcome.ok:
            metrics = rows[row.id] = {"latency": {"value": 1e9 * row.seconds}} if row.seconds > 0 else {}
            for name, value in row.values.items():
                spread = row.spreads.get(name, 0.0)
                metrics[name] = {"value": value, "lower_value": value - spread, "upper_value": value + spread}
    return rows


def read(path: Path) -> Results:
    """Return the results that a gated run left in a file.

    Raises
    ------
    BadInput
        There is no such file, or it holds no results of this version.
    """
    allowed = "a file of results, which `pytest --benchmark --gate` leaves"
    try:
        content = json.loads(read_text(path))
        rows = [Row(**{**row, "outcome": _outcome(**row["outcome"])}) for row in content["rows"]]
        return Results(content["machine"], {row.id: row for row in rows}, content["commit"], tuple(content["left_out"]))
    except OSError as error:
        raise BadInput("results", f"{path} ({error.strerror})", allowed) from None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise BadInput("results", f"{path} ({type(error).__name__}: {error})", allowed) from None


def _outcome(kind: str, **details: Any) -> Outcome:
    return Outcome(OutcomeKind(kind), **details)
