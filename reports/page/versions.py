"""The pages of `conservative gate --against` and `conservative track`: one HTML file each, which opens from disk."""

from __future__ import annotations

import math
from dataclasses import dataclass

from jinja2 import Environment, PackageLoader, StrictUndefined

from conservative.benchmarks.comparison.times import SLOWER, Ratio

from ..tables import comparison, track

WIDEST = 1.35
"""Largest ratio in the picture of a row, and the reciprocal of the smallest."""


@dataclass(frozen=True)
class Bar:
    """Places of a ratio and of the ends of its interval in a picture, percent of its width."""

    value: float
    low: float
    high: float

    @property
    def width(self) -> float:
        """Width of the interval, large enough to be visible."""
        return max(self.high - self.low, 0.7)


def render_comparison(answer: comparison.Answer) -> str:
    """Return the page of two versions of a project."""
    return _render(
        "comparison.html.j2",
        answer=answer,
        header=comparison.HEADER,
        explanation=comparison.EXPLANATION,
        bar=bar,
        limit=place(1 + SLOWER),
        standings=[each for each in comparison.Standing if any(line.standing is each for line in answer.lines)],
    )


def render_track(answer: track.Answer) -> str:
    """Return the page of the versions of an engine."""
    return _render("track.html.j2", answer=answer, nothing_changed=track.NOTHING_CHANGED, unfinished=track.UNFINISHED)


def _render(template: str, **values: object) -> str:
    loader = PackageLoader("conservative.reports")
    environment = Environment(loader=loader, undefined=StrictUndefined, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return environment.get_template(template).render(values)


def bar(ratio: Ratio | None) -> Bar | None:
    """Return the picture of a ratio; None if there is none."""
    if ratio is None or math.isnan(ratio.value):
        return None
    return Bar(place(ratio.value), place(ratio.low), place(ratio.high))


def place(ratio: float) -> float:
    """Return the place of a ratio on a logarithmic axis with 1 in the middle, percent of its length."""
    share = 0.5 + 0.5 * math.log(ratio) / math.log(WIDEST)
    return round(100 * min(max(share, 0.0), 1.0), 2)
