"""One sentence for a pull request on the free rotation of each method: errors, order and the first bad motion, if they changed.

The tests that authors of engines copy print the same sentence (`references/motions`).
"""

from __future__ import annotations

from conservative import registry

from ..gate.baseline import ATTITUDE, COUNTS, ORDER
from ..gate.compare import Decision
from ..gate.results import Row
from ..measures.sentence import UNKNOWN, change_of
from .project import TIME, ProjectComparison, ProjectLine, changed, error_of

_NO_MOTION = {TIME, "definition", "engine version", *COUNTS}
"""Measures that say nothing about a motion."""


def sentences(comparison: ProjectComparison, decision: Decision) -> tuple[str, ...]:
    """Return the sentences of the methods whose accuracy on free bodies changed, with their names if there are several methods.

    Errors are the largest ones in both versions, over the scenes on which the error changed by more than round-off explains.
    """
    methods = list(dict.fromkeys(line.setting for line in comparison.lines))
    each = (_sentence(comparison, decision, method, method * (len(methods) > 1)) for method in methods)
    return tuple(filter(None, each))


def _sentence(comparison: ProjectComparison, decision: Decision, method: str, subject: str) -> str:
    lines = [line for line in comparison.lines if line.setting == method and registry.scene(line.scene).free]
    pairs = [(was, now) for line in lines if (was := line.results[0]) and (now := line.results[-1])]
    return change_of(_errors(pairs), _orders(pairs), _first_bad(lines, decision, method), subject)


def _errors(pairs: list[tuple[Row, Row]]) -> tuple[float, float]:
    grown = [(error_of(was), error_of(now)) for was, now in pairs if changed(was, now, ATTITUDE)]
    return (max(was for was, _ in grown), max(now for _, now in grown)) if grown else UNKNOWN


def _orders(pairs: list[tuple[Row, Row]]) -> tuple[float, float]:
    orders = [(was.values[ORDER], now.values[ORDER]) for was, now in pairs if ORDER in was.values and ORDER in now.values]
    return max(orders, key=lambda pair: abs(pair[1] - pair[0]), default=UNKNOWN)


def _first_bad(lines: list[ProjectLine], decision: Decision, method: str) -> str:
    rows = {line.scene: line.results for line in lines}
    for change in decision.violations:
        if change.row.method == method and change.row.scene in rows and change.row.measure not in _NO_MOTION:
            was, now = rows[change.row.scene][0], rows[change.row.scene][-1]
            if now is not None:
                return f"{change.row.scene} ({_reason(was, now)})"
    return ""


def _reason(was: Row | None, now: Row) -> str:
    """Return the mistake that the later version makes and the earlier one does not, or the outcome of a run that failed."""
    if now.mistake not in ("", "unknown", was.mistake if was else ""):
        return now.mistake
    return "no known mistake" if now.outcome.ok else now.outcome.kind.value
