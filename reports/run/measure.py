"""What a report measures, study by study; each is kept in the checkpoint as soon as it is done."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.measures import measurement, samples
from conservative.benchmarks.studies import studies
from conservative.benchmarks.studies.study import Progress

from ..terminal.progress import Step
from .checkpoint import Checkpoint
from .plan import Plan


@dataclass(frozen=True, eq=False)
class Measurements:
    """All that a report measures: the tidy table (see `Measurement`), and the samples of lines (see `Samples`)."""

    table: pd.DataFrame
    samples: pd.DataFrame


def measure(plan: Plan, step: Step, checkpoint: Checkpoint) -> Measurements:
    """Return rows and samples in the order of the plan.

    What the checkpoint has is not measured again; what is measured is kept there.
    """
    left = [study for study in plan.studies if study.name not in checkpoint.results]
    spans = plan.spans(study.name for study in left)
    for study in left:
        checkpoint.keep(study.name, studies.findings(study, _progress(step, study.name, spans[study.name])))
    results = [checkpoint.results[name] for name in plan.names]
    return Measurements(
        measurement.frame(row for result in results for row in result.rows),
        samples.frame(line for result in results for line in result.samples),
    )


def _progress(step: Step, name: str, span: tuple[float, float]) -> Progress:
    """Return a study's progress as a share of the whole."""
    start, end = span
    return lambda done, total, what: step(start + (end - start) * done / total, f"{name.replace('_', ' ')}: {what}")
