"""The summary of a sweep, for a person and for a program."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import Any

Summary = dict[str, Any]


def json_text(summary: Summary) -> str:
    """Return the summary as JSON."""
    return json.dumps(summary, indent=2, ensure_ascii=False, allow_nan=False)


def summary_text(summary: Summary) -> str:
    """Return the summary for a person."""
    lines = list(_lines(summary))
    width = max(len(name) for name, _ in lines)
    return "\n".join(f"{name:<{width}}  {value}".rstrip() for name, value in lines)


def _lines(summary: Summary) -> Iterator[tuple[str, str]]:
    yield "scene", summary["scene"]
    yield "method", summary["label"]
    yield "bodies", f"{summary['bodies']:,}: " + ", ".join(f"{count:,} {kind}" for kind, count in summary["outcomes"].items())
    yield "spread", ", ".join(f"{name}={value}" for name, value in summary["spread"].items()) + f"; seed {summary['seed']}"
    run = f"{summary['t_end']:g} s in {summary['steps']:,} steps of {summary['dt']:.3g} s, {summary['samples']} samples each"
    yield "run", run
    if summary["error"]:
        yield "error", _error_text(summary["error"])
    yield "time", _time_text(summary)
    for name, drift in summary["drift"].items():
        yield f"drift of {name}", _drift_text(drift)
    yield from _angle_lines(summary["angle_from_mean"])
    yield from ((name, summary[name]) for name in ("out", "picture") if summary[name])
    yield from ((f"body {failure['body']}", failure["text"]) for failure in summary["failures"])


def _error_text(error: dict[str, Any]) -> str:
    reached = "" if error["reached"] else ", which is not what was asked for"
    estimate = f"{error['estimate']:.2g} rad at most, estimated on {error['bodies']:,} bodies"
    return f"{estimate}; asked: {error['asked']:g} rad{reached}"


def _time_text(summary: Summary) -> str:
    before = f", {summary['found_before']:,} bodies were there before" if summary["found_before"] else ""
    bodies, steps = (rate_text(summary[key]) for key in ("bodies_per_second", "body_steps_per_second"))
    return f"{summary['wall_time']:.3g} s: {bodies} bodies/s, {steps} body-steps/s{before}"


def _drift_text(drift: dict[str, Any] | None) -> str:
    if drift is None:
        return "none: no body has it, or all failed"
    return f"{drift['largest']:.2e} at most (body {drift['body']}), median {drift['median']:.1e} (relative)"


def _angle_lines(angles: list[dict[str, float | None]]) -> Iterator[tuple[str, str]]:
    yield "angle from the mean", "median, and 5 to 95 % of the bodies"
    for row in angles:
        low, middle, high = ("-" if value is None else f"{math.degrees(value):.3g}°" for value in list(row.values())[1:])
        yield f"  at t = {row['t']:.4g} s", f"{middle}, {low} to {high}"


def rate_text(value: float) -> str:
    """Return a rate with three digits, such as 3,460 or 20.7M; of any unit."""
    for size, prefix in ((1e9, "G"), (1e6, "M")):
        if value >= size:
            return f"{value / size:.3g}{prefix}"
    return f"{float(f'{value:.3g}'):,.0f}" if value >= 100 else f"{value:.3g}"
