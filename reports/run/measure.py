"""What a report measures, piece by piece; each piece is kept as soon as it is finished."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.measures import measurement
from conservative.benchmarks.measures.measurement import Measurement
from conservative.benchmarks.studies import long_runs, studies
from conservative.method import Role

from ..terminal.progress import Step
from .checkpoint import Partial
from .plan import Plan

Report = Callable[[int, int, str], None]
"""Called before each run: runs done, runs in all, and what comes next."""


@dataclass(frozen=True)
class Measured:
    """What was measured: the tidy table, and drifts over time (see `long_runs.samples`)."""

    table: pd.DataFrame
    drifts: pd.DataFrame


def measure(made: Plan, step: Step, kept: Partial) -> Measured:
    """Return all rows, in the order of the plan: the studies, then long runs for the drift over time.

    What `kept` has is not measured again; what is measured is kept there.
    """
    left = [name for name in made.pieces if name not in kept.pieces]
    spans = made.spans(left)
    by_name = {study.name: study for study in made.studies}
    for name in left:
        report = _within(step, name, spans[name])
        if name in by_name:
            kept.keep(name, list(studies.rows(by_name[name], report)))
        else:
            kept.keep(name, *_long_runs(made, report))
    rows = [row for name in made.pieces for row in kept.pieces[name].rows]
    return Measured(
        measurement.frame(rows), pd.DataFrame(kept.pieces[long_runs.STUDY].samples, columns=list(long_runs.COLUMNS))
    )


def _within(step: Step, name: str, span: tuple[float, float]) -> Report:
    """Return a piece's progress as a share of the whole."""
    start, end = span
    return lambda done, total, what: step(start + (end - start) * done / total, f"{name.replace('_', ' ')}: {what}")


def _long_runs(made: Plan, report: Report) -> tuple[list[Measurement], list[list[object]]]:
    """Return the rows of the long runs, and the samples of their picture under `long_runs.COLUMNS`."""
    pairs = [(scene, method) for scene in made.scenes for method in made.methods if method.role != Role.TRUTH]
    rows, samples = [], []
    for k, (scene, method) in enumerate(pairs):
        report(k, len(pairs), f"{scene.name}: {method.name}")
        found, picture = long_runs.measured(long_runs.case_for(scene, method), made.skip_missing)
        rows += found
        samples += picture.to_numpy(dtype=object).tolist()
    return rows, samples
