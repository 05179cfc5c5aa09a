"""What a report measures, piece by piece; each piece is kept as soon as it is finished."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.measures import measurement, samples
from conservative.benchmarks.studies import studies

from ..terminal.progress import Step
from .checkpoint import Partial
from .plan import Plan

Report = Callable[[int, int, str], None]
"""Called before each run: runs done, runs in all, and what comes next."""


@dataclass(frozen=True)
class Measured:
    """What was measured: the tidy table, and the table of the lines of pictures."""

    table: pd.DataFrame
    samples: pd.DataFrame


def measure(made: Plan, step: Step, kept: Partial) -> Measured:
    """Return all rows, and samples, in the order of the plan.

    What `kept` has is not measured again; what is measured is kept there.
    """
    left = [name for name in made.pieces if name not in kept.pieces]
    spans = made.spans(left)
    by_name = {study.name: study for study in made.studies}
    for name in left:
        report = _within(step, name, spans[name])
        kept.keep(name, studies.findings(by_name[name], report))
    pieces = [kept.pieces[name] for name in made.pieces]
    return Measured(
        measurement.frame(row for piece in pieces for row in piece.rows),
        samples.frame(line for piece in pieces for line in piece.samples),
    )


def _within(step: Step, name: str, span: tuple[float, float]) -> Report:
    """Return a piece's progress as a share of the whole."""
    start, end = span
    return lambda done, total, what: step(start + (end - start) * done / total, f"{name.replace('_', ' ')}: {what}")
