"""The page of one comparison of two versions: rows, ratios with their intervals, filters; it opens from disk."""

from __future__ import annotations

import math
from dataclasses import dataclass

from jinja2 import Environment, PackageLoader, StrictUndefined

from conservative.benchmarks.comparison.times import SLOWER, Ratio

from ..tables.comparison import EXPLANATION, HEADER, Answer, Standing

WIDEST = 1.35
"""Largest ratio, and one over the smallest, that the picture of a row has room for."""


@dataclass(frozen=True)
class Bar:
    """Where the ratio of a row and its interval lie in a picture, in per cent of its width."""

    value: float
    low: float
    high: float

    @property
    def width(self) -> float:
        """Of the interval; never too thin to be seen."""
        return max(self.high - self.low, 0.7)


def render(answer: Answer) -> str:
    """Return the page."""
    loader = PackageLoader("conservative.reports")
    environment = Environment(loader=loader, undefined=StrictUndefined, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    template = environment.get_template("comparison.html.j2")
    return template.render(
        answer=answer,
        header=HEADER,
        explanation=EXPLANATION,
        bar=bar,
        limit=place(1 + SLOWER),
        standings=[each for each in Standing if any(line.standing is each for line in answer.lines)],
    )


def bar(ratio: Ratio | None) -> Bar | None:
    """Return the picture of a ratio; None where there is none."""
    if ratio is None or math.isnan(ratio.value):
        return None
    return Bar(place(ratio.value), place(ratio.low), place(ratio.high))


def place(ratio: float) -> float:
    """Return where a ratio lies on a logarithmic axis with 1 in the middle, in per cent of its length."""
    share = 0.5 + 0.5 * math.log(ratio) / math.log(WIDEST)
    return round(100 * min(max(share, 0.0), 1.0), 2)
