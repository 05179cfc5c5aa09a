"""How often the comparison of two versions is wrong about times.

    python -m conservative.benchmarks.verification.comparison_alarms --runs 100

It compares one version of this project with itself, in one environment, as the command does: two sides, several processes of
each, what looks slower measured again. Every row is measured three times over: as it is, which must raise no alarm, and with
a tenth and a fifth more steps on one side than it says, which must. `--factors 1` leaves the latter two out.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from conservative import registry
from conservative.references.environments.lock import Source

from ..comparison.side import Side, TimedRun
from ..comparison.times import PROCESSES, Timed, TimeRow, compare_times
from ..comparison.version import Version, install_version

METHODS = ("reduced", "reduced:order=4", "reduced:order=6", "moser_veselov:order=2", "moser_veselov")
FACTORS = (1.0, 1.1, 1.2)
"""Parts of its work that a row does: as much as it says, a tenth more, a fifth more."""
_MARK = " x"


class Slowed(Side):
    """A side that takes as many times more steps as the name of a method ends with; with `plant` False none more."""

    def __init__(self, version: Version, plant: bool) -> None:
        super().__init__(version)
        self._plant = plant

    def timed(self, scene: str, method: str, dt: float, n_steps: int) -> TimedRun:
        name, _, factor = method.partition(_MARK)
        return super().timed(scene, name, dt, round(n_steps * float(factor)) if self._plant else n_steps)


def compare_once(version: Version, rows: Sequence[Timed], processes: int) -> dict[str, TimeRow]:
    """Return what one comparison of a version with itself finds."""
    sides = Slowed(version, plant=False), Slowed(version, plant=True)
    try:
        return compare_times(*sides, rows, processes)
    finally:
        for side in sides:
            side.close()


def as_record(found: dict[str, TimeRow]) -> dict[str, Any]:
    """Return the ratios of a comparison as JSON has them, by row."""
    return {
        id: {"first": vars(row.first), "again": row.again and vars(row.again), "failed": row.failed}
        for id, row in found.items()
    }


def summarize(records: Iterable[dict[str, Any]]) -> dict[str, Any]:
    """Return how many comparisons raised a false alarm in any row, and of how many rows each slow-down was caught."""
    every = list(records)
    alarms = [id for record in every for id, row in record.items() if id.endswith(f"{_MARK}{FACTORS[0]}") and row["failed"]]
    wrong = sum(any(row["failed"] for id, row in each.items() if id.endswith(f"{_MARK}{FACTORS[0]}")) for each in every)
    rows = Counter(id.rpartition(_MARK)[2] for record in every for id in record)
    caught = Counter(id.rpartition(_MARK)[2] for record in every for id, row in record.items() if row["failed"])
    return {
        "comparisons": len(every),
        "with a false alarm": wrong,
        "rows with a false alarm": alarms,
        "alarms by factor": {factor: f"{caught[factor]} of {count}" for factor, count in sorted(rows.items())},
    }


def main() -> None:
    """Run, and print one JSON object for each comparison and one with the summary."""
    parser = argparse.ArgumentParser(
        prog="python -m conservative.benchmarks.verification.comparison_alarms", description=__doc__
    )
    parser.add_argument("--runs", type=int, default=100, help="comparisons")
    parser.add_argument("--processes", type=int, default=PROCESSES, help="processes of each version in a measurement")
    parser.add_argument("--version", default=".", help="a git ref, a folder or a wheel")
    parser.add_argument("--scene", default="brick_flip")
    parser.add_argument("--methods", nargs="+", default=METHODS)
    parser.add_argument("--factors", nargs="+", type=float, default=FACTORS, help="of the work of rows")
    options = parser.parse_args()
    version, dt = install_version(options.version, Path(), Source()), registry.scene(options.scene).dt
    names = [f"{method}{_MARK}{factor}" for method in options.methods for factor in options.factors]
    rows = [Timed(f"{options.scene} / {name}", options.scene, name, dt) for name in names]
    records = []
    for _ in range(options.runs):
        records.append(as_record(compare_once(version, rows, options.processes)))
        print(json.dumps(records[-1]), flush=True)
        print(json.dumps(summarize(records)), flush=True)


if __name__ == "__main__":
    main()
