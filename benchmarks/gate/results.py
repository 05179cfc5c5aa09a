"""What one run of benchmarks found, as rows, and the file it is kept in."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from conservative.errors import BadInput
from conservative.files import make_folder, write_text

from ..measures.measure import Measure, key

FOLDER = Path(".benchmarks") / "gate"
"""Where a gated run leaves its results, relative to the root of the project."""
FILE = "results.json"
TIME_RATIO = "time ratio"
RUNAWAY = 1.0
"""Energy drift, relative, above which a run has failed, whatever it says of itself: its energy is not that of its start."""
ENERGY_DRIFT = key(Measure.DRIFT_MAX, "energy")


class Status(StrEnum):
    """How a benchmark ended, as pytest calls it."""

    PASSED = "passed"
    FAILED = "failed"
    SKIPPED = "skipped"
    XFAILED = "xfailed"
    ERROR = "error"


@dataclass(frozen=True)
class Row:
    """One benchmark.

    Attributes
    ----------
    id, scene, method
        What tells it apart: the test's name with its parameters; and what a reader looks for.
    status
        How it ended.
    engine
        Name and version of a foreign engine, such as `mujoco==4.0.0/RK4`; empty for what is itself under test.
    definition
        Hash of what is measured.
    values, spreads
        Measures that must not get worse, and how much round-off alone changes each.
    time_ratio
        Time in units of the yardstick (`conservative.benchmarks.gate.yardstick`); None where time is not gated.
    seconds
        Shortest time of a call, s, for dashboards; not gated.
    """

    id: str
    scene: str
    method: str
    status: Status
    engine: str = ""
    definition: str = ""
    values: Mapping[str, float] = field(default_factory=dict)
    spreads: Mapping[str, float] = field(default_factory=dict)
    time_ratio: float | None = None
    seconds: float | None = None


@dataclass(frozen=True)
class Results:
    """The rows of one run, by id, the machine they were measured on, and the commit."""

    machine: str
    rows: Mapping[str, Row]
    commit: str = ""


def find_runaway(values: Mapping[str, float]) -> str:
    """Return what says that a run ran away, empty if nothing does."""
    drift = values.get(ENERGY_DRIFT, 0.0)
    return "" if drift <= RUNAWAY else f"{ENERGY_DRIFT} is {drift:.2g}, more than {RUNAWAY:g}: the run failed"


def write(results: Results, path: Path) -> None:
    """Write results as JSON; floats come back as they are, nan as nan. Raise `NotWritten` where that cannot be."""
    make_folder(path.parent, "results")
    write_text(path, json.dumps(as_json(results), indent=1) + "\n", "results")


def as_json(results: Results) -> dict[str, Any]:
    """Return results as what JSON knows."""
    return {**vars(results), "rows": [vars(row) for row in results.rows.values()]}


def read(path: Path) -> Results:
    """Return the results in a file: one that a gated run left, or that `pytest --benchmark --benchmark-json=FILE` wrote.

    Raises
    ------
    BadInput
        There is no such file, or it holds no results.
    """
    allowed = "a file of results, which `pytest --benchmark --gate` leaves"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        content = content.get("conservative", content)
        rows = [Row(**{**row, "status": Status(row["status"])}) for row in content["rows"]]
        return Results(content["machine"], {row.id: row for row in rows}, content["commit"])
    except OSError as error:
        raise BadInput("results", f"{path} ({error.strerror})", allowed) from None
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise BadInput("results", f"{path} ({type(error).__name__}: {error})", allowed) from None
