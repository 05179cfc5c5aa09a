"""The measurements of a report. Each finished study is stored in the checkpoint."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed, wait
from contextlib import suppress
from dataclasses import dataclass
from itertools import product
from typing import Any

import pandas as pd

from conservative.benchmarks.measures import measurement
from conservative.benchmarks.measures.measurement import Measurement, Samples
from conservative.benchmarks.studies import studies
from conservative.benchmarks.studies.case import Case, attempt
from conservative.errors import IntegrationFailed
from conservative.grid import Grid
from conservative.kernels import is_first_use
from conservative.method import Role
from conservative.pickling import NotTransferable
from conservative.references.worker.calls import run_within
from conservative.references.worker.client import kill_workers

from ..terminal.progress import Tell, announce
from .checkpoint import VERIFICATION, Checkpoint, Result
from .plan import Plan
from .provenance import Provenance
from .verification import Verified, to_plain, verify_methods

SCHEMA = 3
"""Version of the layout of measurements.json; a change that breaks a reader raises it."""
COMPILERS = 4
"""Largest number of processes that compile kernels; each takes 0.3 GB."""
COMPILATION_LIMIT = 300.0
"""Time, s, after which such a process is ended."""


@dataclass(frozen=True, eq=False)
class Measurements:
    """The measurements of a report.

    Attributes
    ----------
    table, samples
        The tidy table (see `Measurement`), and the samples of lines (see `Samples`).
    verified
        The findings on the engines that the report names.
    """

    table: pd.DataFrame
    samples: pd.DataFrame
    verified: tuple[Verified, ...] = ()

    @classmethod
    def of(cls, findings: Iterable[Result]) -> Measurements:
        """Return the tables of the findings of studies, and those on engines."""
        results = list(findings)
        return cls(
            measurement.frame(row for row in results if isinstance(row, Measurement)),
            measurement.samples_frame(line for line in results if isinstance(line, Samples)),
            tuple(part for part in results if isinstance(part, Verified)),
        )

    def content(self, source: Provenance) -> dict[str, Any]:
        """Return the content of measurements.json."""
        return {"schema": SCHEMA, **vars(source), "rows": records(self.table), "verified": to_plain(self.verified)}


def records(table: pd.DataFrame) -> list[dict[str, object]]:
    """Return the rows of a table for JSON."""
    return [
        {str(name): value for name, value in row.items()}
        for row in table.astype(object).where(table.notna(), None).to_dict("records")
    ]


def compile_kernels(plan: Plan, tell: Tell) -> None:
    """Compile the kernels of a plan side by side if none is stored yet. Otherwise each is compiled when it is needed.

    Each process takes two steps with all methods that share a kernel, so that no kernel is compiled twice.
    """
    if not is_first_use():
        return
    announce("compilation of kernels, for the first time")
    cases: dict[str, set[Case]] = defaultdict(set)
    for study in plan.studies:
        for scene, method in product(study.scenes, study.competitors):
            if method.role != Role.ENGINE:
                case = Case("compilation", scene, method, Grid(scene.dt, 2))
                cases[method.method_info.kernel or method.family].add(case)

    def compile_one(kernel: str) -> None:
        mine = cases[kernel]

        def take_steps() -> None:
            for case in mine:
                attempt(case)

        with suppress(IntegrationFailed, NotTransferable):  # then the study compiles, and finds out why
            run_within(COMPILATION_LIMIT, take_steps)

    with ThreadPoolExecutor(min(COMPILERS, os.cpu_count() or 1)) as threads:
        futures = [threads.submit(compile_one, kernel) for kernel in cases]
        try:
            for i, future in enumerate(as_completed(futures), start=1):
                future.result()
                tell(0.0, f"compilation of kernels, for the first time: {i} of {len(cases)}")
        except BaseException:  # such as an interrupt, which does not reach the threads
            while wait(futures, 0.1).not_done:
                kill_workers()  # again, because a thread may just be starting one
            raise


def measure(plan: Plan, tell: Tell, checkpoint: Checkpoint) -> Measurements:
    """Return rows and samples in the order of the plan.

    Studies in the checkpoint are not measured again, others are added to it. `tell` is called with the finished share.
    """
    compile_kernels(plan, tell)
    for i, study in enumerate(plan.studies):
        if study.name in checkpoint.results:
            continue
        title = f"study {i + 1} of {len(plan.studies)}, {study.name.replace('_', ' ')}"
        announce(title)

        def tell_part(share: float, what: str, i: int = i, title: str = title) -> None:
            tell((i + share) / len(plan.studies), f"{title}: {what}")

        checkpoint.store(study.name, studies.findings(study, tell_part))
    if VERIFICATION in checkpoint.names and VERIFICATION not in checkpoint.results:
        announce("verification of engines")
        checkpoint.store(VERIFICATION, verify_methods(plan.engines, lambda share, what: tell(1.0, f"verification: {what}")))
    return Measurements.of(finding for name in checkpoint.names for finding in checkpoint.results[name].findings)
