"""Published figures and what came of them: lines and JSON."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from decimal import Decimal
from itertools import groupby
from typing import Any

from conservative.benchmarks.published.evaluate import Beside, Finding, Verdict, passed
from conservative.benchmarks.published.figure import Figure, Relation, Source

MOST_DIGITS = 16
"""Significant digits that a double has, about."""
BOUNDS = {Relation.EQUALS: "", Relation.BELOW: "< ", Relation.ABOVE: "> "}


def lines(findings: Iterable[Finding]) -> Iterator[str]:
    """Yield the figures by source as they are measured, each with what was found, and at the end how many came out how."""
    shown = []
    for source, group in groupby(findings, lambda finding: finding.figure.source):
        yield from _heading(source)
        for finding in group:
            shown.append(finding)
            yield from _entry(finding)
        yield ""
    yield closing(shown)


def closing(findings: Sequence[Finding]) -> str:
    """Return how many figures came out how."""
    counts = Counter(finding.verdict for finding in findings)
    parts = [_count(verdict, counts[verdict]) for verdict in Verdict if counts[verdict]]
    return f"{len(findings)} figures: {'; '.join(parts)}"


def _count(verdict: Verdict, count: int) -> str:
    words = f"{count} {verdict}"
    return words if count == 1 else words.replace("differs", "differ")


def _heading(source: Source) -> Iterator[str]:
    yield f"{source.key}: {source.citation}"
    yield f"  {source.url}"
    yield f"  {source.place}" + ("" if source.original else " (taken from an account of it: the original was not at hand)")


def _entry(finding: Finding) -> Iterator[str]:
    figure = finding.figure
    yield f"  {figure.name} ({figure.what}; {figure.setting})"
    yield f"    printed   {BOUNDS[figure.relation]}{'  '.join(figure.printed)}"
    if finding.measured:
        yield f"    measured  {BOUNDS[Relation.EQUALS]}{'  '.join(_numbers(finding))}  by {finding.label}"
    yield f"    {finding.verdict}{_off(finding)}"
    yield from (f"      {text}" for text in _reasons(finding))


def _off(finding: Finding) -> str:
    if finding.off is None:
        return f": {finding.reason}"
    return f", off by {finding.off:.2g}" if finding.off or finding.figure.relation is Relation.EQUALS else ""


def _reasons(finding: Finding) -> Iterator[str]:
    figure = finding.figure
    if finding.measured and figure.instead:
        yield f"instead: {figure.instead}"
    if finding.off is not None and figure.explanation:
        yield f"explanation: {figure.explanation}"
    if found := [each for each in finding.beside if each.off is not None]:
        yield "engines at this step: " + ", ".join(f"{each.label} {each.off:.1e}" for each in found)
    if without := [each for each in finding.beside if each.off is None]:
        yield "engines without a figure: " + ", ".join(f"{each.label} ({each.reason})" for each in without)


def _numbers(finding: Finding) -> Iterator[str]:
    """Yield what was measured with two digits more than are printed."""
    for printed, measured in zip(finding.figure.printed, finding.measured, strict=False):
        digits = min(MOST_DIGITS, len(Decimal(printed).as_tuple().digits) + 2)
        yield f"{measured:.{digits}g}"


def json_text(findings: Sequence[Finding]) -> str:
    """Return the same as JSON, with numbers in full."""
    counts = Counter(str(finding.verdict) for finding in findings)
    found = {"passed": passed(findings), "counts": counts, "figures": [_as_dict(finding) for finding in findings]}
    return json.dumps(found, indent=2, allow_nan=False)


def _as_dict(finding: Finding) -> dict[str, Any]:
    return {
        **_figure(finding.figure),
        "verdict": str(finding.verdict),
        "label": finding.label,
        "measured": [_finite(number) for number in finding.measured],
        "off": _finite(finding.off),
        "reason": finding.reason,
        "engines": [_engine(each) for each in finding.beside],
    }


def _figure(figure: Figure) -> dict[str, Any]:
    source = figure.source
    return {
        "name": figure.name,
        "source": {"key": source.key, "citation": source.citation, "url": source.url, "place": source.place},
        "what": figure.what,
        "setting": figure.setting,
        "printed": list(figure.printed),
        "relation": str(figure.relation),
        "tolerance": figure.allowed,
        "explanation": figure.explanation,
        "instead": figure.instead,
    }


def _engine(beside: Beside) -> dict[str, Any]:
    return {"label": beside.label, "off": _finite(beside.off), "reason": beside.reason}


def _finite(number: float | None) -> float | None:
    return None if number is None or abs(number) == float("inf") or number != number else number
