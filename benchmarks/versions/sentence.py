"""One sentence for a pull request on the free rotation of each method: errors, order and the first bad motion, if they changed.

The tests that authors of engines copy print the same sentence (`references/motions`).
"""

from __future__ import annotations

from collections.abc import Iterator

from conservative import registry

from ..gate.baseline import ATTITUDE, COUNTS, ORDER
from ..gate.compare import Decision
from ..gate.results import Row
from .project import TIME, ProjectComparison, changed, error_of

FREE = "free rotation at your step"
ORDERS = 0.2
"""Orders differ if their difference is at least this."""
_NO_MOTION = {TIME, "definition", "engine version", *COUNTS}
"""Measures that say nothing about a motion."""


def sentences(comparison: ProjectComparison, decision: Decision) -> tuple[str, ...]:
    """Return the sentences of the methods whose accuracy on free bodies changed, with their names if there are several methods.

    Errors are the largest ones in both versions, over the scenes on which the error changed by more than round-off explains.
    """
    methods = list(dict.fromkeys(line.setting for line in comparison.lines))
    found = ((method, "; ".join(_parts(comparison, decision, method))) for method in methods)
    return tuple(f"{FREE}{f', {method}' * (len(methods) > 1)}: {text}" for method, text in found if text)


def _parts(comparison: ProjectComparison, decision: Decision, method: str) -> Iterator[str]:
    lines = [line for line in comparison.lines if line.setting == method and registry.scene(line.scene).free]
    pairs = [(was, now) for line in lines if (was := line.results[0]) and (now := line.results[-1])]
    numbers = ", ".join(filter(None, (_errors(pairs), _orders(pairs))))
    if numbers:
        yield numbers
    rows = {line.scene: line.results for line in lines}
    for change in decision.violations:
        if change.row.method == method and change.row.scene in rows and change.row.measure not in _NO_MOTION:
            was, now = rows[change.row.scene][0], rows[change.row.scene][-1]
            if now is not None:
                yield f"first bad motion: {change.row.scene} ({_reason(was, now)})"
                return


def _errors(pairs: list[tuple[Row, Row]]) -> str:
    grown = [(error_of(was), error_of(now)) for was, now in pairs if changed(was, now, ATTITUDE)]
    was, now = (f"{max(errors):.2g}" for errors in zip(*grown, strict=True)) if grown else ("", "")
    return f"attitude error {was} to {now} rad" if was != now else ""


def _orders(pairs: list[tuple[Row, Row]]) -> str:
    orders = [(was.values[ORDER], now.values[ORDER]) for was, now in pairs if ORDER in was.values and ORDER in now.values]
    was, now = max(orders, key=lambda pair: abs(pair[1] - pair[0]), default=(0.0, 0.0))
    return f"order {was:.1f} to {now:.1f}" if abs(now - was) >= ORDERS else ""


def _reason(was: Row | None, now: Row) -> str:
    """Return the mistake that the later version makes and the earlier one does not, or the outcome of a run that failed."""
    if now.mistake not in ("", "unknown", was.mistake if was else ""):
        return now.mistake
    return "no known mistake" if now.outcome.ok else now.outcome.kind.value
