"""A sweep: outcomes, drifts, and the spread of attitudes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from ..document.cells import angle, bound
from ..document.model import Document, Facts
from ..run.single_run import LARGE
from ..run.sweep import rate_text


def build(summary: dict[str, Any]) -> Document:
    """Return the document of a summary (see `run.sweep.summarize`)."""
    failures = []
    if summary["failures"]:
        failed, first = summary["bodies"] - summary["outcomes"]["ok"], summary["failures"][0]
        text = f"{failed:,} of {summary['bodies']:,} bodies failed, the first of them number {first['body']}: {first['text']}"
        failures.append(f"{summary['label']} on {summary['scene']}: {text}")
    estimate = summary["error"]["estimate"]
    if estimate is not None and estimate > LARGE:
        failures.append(f"{summary['label']} on {summary['scene']}: inaccurate: the attitude error is {angle(estimate)} rad")
    title = f"{summary['bodies']:,} bodies of {summary['scene']}"
    return Document("conservative sweep", title, [Facts(list(_facts(summary)))], data=summary, failures=failures)


def _facts(summary: dict[str, Any]) -> Iterator[tuple[str, str]]:
    yield "scene", summary["scene"]
    yield "method", summary["label"]
    yield "bodies", f"{summary['bodies']:,}: " + ", ".join(f"{count:,} {kind}" for kind, count in summary["outcomes"].items())
    yield "spread", ", ".join(f"{name}={value}" for name, value in summary["spread"].items()) + f"; seed {summary['seed']}"
    run = f"{summary['t_end']:g} s in {summary['steps']:,} steps of {summary['dt']:.3g} s, {summary['samples']} samples each"
    yield "run", run
    error = summary["error"]
    if error["asked"] is None:
        if error["estimate"] is None:
            yield "error", error["reason"]
        else:
            advice = "" if error["reached"] else "; the motions are inaccurate: use --error 1e-6 without --methods and --dt"
            yield "error", f"{angle(error['estimate'])} rad, of the scene itself{advice}"
    else:
        reached = "" if error["reached"] else ", so the target is not reached"
        estimate = f"{angle(error['estimate'])} rad at most, estimated on {error['bodies']:,} bodies"
        yield "error", f"{estimate}; target: {error['asked']:g} rad{reached}"
    bodies, steps = (rate_text(summary[key]) for key in ("bodies_per_second", "body_steps_per_second"))
    before = f"; {summary['found_before']:,} bodies were finished before" if summary["found_before"] else ""
    yield "time", f"{summary['wall_time']:.3g} s in all; while integrating {bodies} bodies/s, {steps} body-steps/s{before}"
    for name, drift in summary["drift"].items():
        text = "none: no body has this invariant, or all bodies failed"
        if drift is not None:
            text = f"{bound(drift['largest'], 3)} at most (body {drift['body']}), median {bound(drift['median'])} (relative)"
        yield f"drift of {name}", text
    yield "angle from the mean attitude", "median, and 5th to 95th percentile of the bodies"
    for row in summary["angle_from_mean"]:
        low, middle, high = ("-" if math.isnan(value) else f"{math.degrees(value):.3g}°" for value in list(row.values())[1:])
        yield f"  at t = {row['t']:.4g} s", f"{middle}, {low} to {high}"
    yield from ((name, summary[name]) for name in ("out", "picture") if summary[name])
    yield from ((f"body {failure['body']}", failure["text"]) for failure in summary["failures"])
