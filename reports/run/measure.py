"""The measurements of a report. Each finished study is stored in the checkpoint."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.measures import measurement
from conservative.benchmarks.measures.measurement import Measurement, Samples
from conservative.benchmarks.studies import studies
from conservative.benchmarks.studies.study import Finding

from ..terminal.progress import Step, announce
from .checkpoint import Checkpoint
from .plan import Plan


@dataclass(frozen=True, eq=False)
class Measurements:
    """The measurements of a report: the tidy table (see `Measurement`), and the samples of lines (see `Samples`)."""

    table: pd.DataFrame
    samples: pd.DataFrame

    @classmethod
    def of(cls, findings: Iterable[Finding]) -> Measurements:
        """Return the tables of findings."""
        every = list(findings)
        return cls(
            measurement.frame(each for each in every if isinstance(each, Measurement)),
            measurement.samples_frame(each for each in every if isinstance(each, Samples)),
        )


def measure(plan: Plan, step: Step, checkpoint: Checkpoint) -> Measurements:
    """Return rows and samples in the order of the plan.

    Studies in the checkpoint are not measured again, others are added to it. `step` is called with the finished share.
    """
    for i, study in enumerate(plan.studies):
        if study.name in checkpoint.results:
            continue
        title = f"study {i + 1} of {len(plan.studies)}, {study.name.replace('_', ' ')}"
        announce(title)

        def tell(share: float, what: str, i: int = i, title: str = title) -> None:
            step((i + share) / len(plan.studies), f"{title}: {what}")

        checkpoint.store(study.name, studies.findings(study, tell))
    return Measurements.of(finding for name in plan.names for finding in checkpoint.results[name].findings)
