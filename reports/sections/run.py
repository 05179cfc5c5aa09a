"""Single runs: outcome, drifts and final state; of several methods a table."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from conservative.outcome import OutcomeKind

from ..document.cells import DASH, angle, bound, number
from ..document.model import Block, Document, Facts, Items, Table
from ..run.single_run import is_right, status_of


def build(summaries: Sequence[dict[str, Any]]) -> Document:
    """Return the document of the summaries of one or more methods on a scene (see `single_run.summarize`)."""
    first = next(summary for summary in summaries if summary["outcome"].kind is not OutcomeKind.UNSUPPORTED)
    title = f"{first['scene']}: {first['t_end']:g} s with dt = {first['dt']:g} s"
    data = [summary | {"status": str(status_of(summary))} for summary in summaries]
    blocks: list[Block] = [Facts(list(_facts(first)))]
    if len(summaries) > 1:
        advice = dict.fromkeys(
            f"More accurate: {_advice(summary['error'])}" for summary in summaries if "better" in summary["error"]
        )
        blocks = [_table(summaries, title), *([Items.of(list(advice))] if advice else [])]
    failed = [
        f"{summary['label']} on {summary['scene']}: {status_of(summary)}" for summary in summaries if not is_right(summary)
    ]
    return Document("conservative run", title, blocks, data=data[0] if len(data) == 1 else data, failures=failed)


def _facts(summary: dict[str, Any]) -> Iterator[tuple[str, str]]:
    yield "scene", summary["scene"]
    yield "method", summary["label"]
    yield "status", str(status_of(summary))
    if choice := summary["choice"]:
        yield "chosen for", f"an attitude error of {choice['error']:g} rad; estimated {angle(choice['estimate'])} rad"
    if "better" in summary["error"]:
        yield "more accurate", _advice(summary["error"])
    yield "run", f"{summary['t_end']:g} s with dt = {summary['dt']:g} s"
    yield "work", ", ".join(f"{count} {name}" for name, count in summary["counters"].items() if count is not None)
    error = summary["error"]
    for name, unit, shown in (("attitude", "rad", angle), ("rate", "rad/s", bound)):
        yield f"{name} error", error.get("reason") or f"{shown(error[name])} {unit}"
    if "truth" in error:
        yield "error against", f"{error['truth']}, largest of {error['samples']} samples"
    for name, value in summary["drift"].items():
        yield f"drift of {name}", f"{bound(value, 3)} (relative)" if not math.isnan(value) else DASH
    yield "orthonormality", bound(summary["orthonormality"], 3)
    if last := summary["last"]:
        yield f"at t = {last['t']:g} s", ""
        yield from ((f"R_WB row {i}", _numbers(row)) for i, row in enumerate(last["R_WB"], start=1))
        yield "w_WB_B, rad/s", _numbers(last["w_WB_B"])


def _advice(error: dict[str, Any]) -> str:
    if error["better"] is None:
        return "no accurate run was found; use a shorter --dt or a shorter --t-end"
    end = ", which stays accurate up to that time only" if error["better"]["shorter"] else ""
    return f"{error['better']['command']} (attitude error {angle(error['better']['attitude'])} rad{end})"


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value:+.12g}" for value in values)


def _table(summaries: Sequence[dict[str, Any]], title: str) -> Table:
    drifts = list(next(summary["drift"] for summary in summaries if "drift" in summary))
    header = [
        "method",
        "outcome",
        *(f"drift of {name}" for name in drifts),
        "attitude error, rad",
        "rate error, rad/s",
        "steps",
        "wall time, s",
    ]
    rows = [
        [
            summary["typed"],
            status_of(summary).short,
            *(_cell(summary.get("drift", {}).get(name)) for name in drifts),
            *(_cell(summary["error"].get(name), shown) for name, shown in (("attitude", angle), ("rate", bound))),
            f"{summary['counters']['steps']:,}" if "counters" in summary else DASH,
            number(summary["wall_time"]) if "wall_time" in summary else DASH,
        ]
        for summary in summaries
    ]
    return Table(header, rows, title)


def _cell(value: float | None, shown: Callable[[float], str] = bound) -> str:
    return DASH if value is None else shown(value)
