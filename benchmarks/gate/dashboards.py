"""Results for the dashboards that others have: github-action-benchmark, Bencher, and the summary of a workflow's run."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from conservative.files import write_text

from ..measures.measure import Measure
from .baseline import ORDER
from .compare import Verdict
from .results import TIME_RATIO, Results, Row, Status

UNITS = {measure.text: measure.unit for measure in Measure}
SMALLER_IS_BETTER, BMF, SUMMARY = "custom_smaller_is_better.json", "bencher.json", "summary.md"


def write(results: Results, folder: Path) -> None:
    """Write both formats of dashboards into a folder."""
    for name, content in ((SMALLER_IS_BETTER, smaller_is_better(results)), (BMF, bmf(results))):
        write_text(folder / name, json.dumps(content, indent=1, allow_nan=False) + "\n", "results")


def smaller_is_better(results: Results) -> list[dict[str, Any]]:
    """Return what github-action-benchmark reads as `customSmallerIsBetter`; not orders, which should be large."""
    return [
        {"name": f"{_name(row)} / {measure}", "unit": _unit(measure), "value": value, "extra": row.engine or results.commit}
        for row in results.rows.values()
        if row.status is Status.PASSED
        for measure, value in _values(row)
        if measure != ORDER
    ]


def bmf(results: Results) -> dict[str, dict[str, dict[str, float]]]:
    """Return Bencher's metric format: benchmark, measure, value with its lower and upper ends where a spread is known."""
    rows = [row for row in results.rows.values() if row.status is Status.PASSED]
    return {_name(row): {_slug(name): _metric(row, name, value) for name, value in _values(row)} for row in rows}


def _metric(row: Row, name: str, value: float) -> dict[str, float]:
    spread = row.spreads.get(name)
    ends = {} if spread is None else {"lower_value": value - spread, "upper_value": value + spread}
    return {"value": value, **ends}


def _values(row: Row) -> Iterator[tuple[str, float]]:
    """Yield what a dashboard can draw: the finite numbers of a row."""
    found = {**row.values, TIME_RATIO: row.time_ratio, "time": row.seconds}
    return ((name, value) for name, value in found.items() if value is not None and math.isfinite(value))


def _name(row: Row) -> str:
    return f"{row.scene} / {row.method}" if row.scene and row.method else row.id


def _slug(measure: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", measure.lower()).strip("-")


def _unit(measure: str) -> str:
    if measure == "time":
        return "s"
    if measure == TIME_RATIO:
        return "steps of the yardstick"
    return UNITS.get(measure, "1")


def markdown(verdict: Verdict) -> str:
    """Return the summary of a verdict: its violations as a table, its notes as a list."""
    head = (
        f"## Gate: {'passed' if verdict.passed else 'FAILED'}\n\n{verdict.rows} rows, {len(verdict.violations)} violations.\n"
    )
    rows = [
        " | ".join(("", each.measure, each.scene, each.method, each.was, each.now, each.allowed, "")).strip()
        for each in verdict.violations
    ]
    table = (
        ["", "| measure | scene | method | was | is | allowed |", "| --- | --- | --- | --- | --- | --- |", *rows]
        if rows
        else []
    )
    notes = ["", *(f"- {note}" for note in verdict.notes)] if verdict.notes else []
    return "\n".join([head, *table, *notes]) + "\n"
