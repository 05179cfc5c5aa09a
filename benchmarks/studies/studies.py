"""The studies by name.

study = STUDIES["convergence"].plan(selection.methods(), selection.scenes())
for finding in findings(study): ...
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from conservative.check import choice

from ..measures.measurement import Measurement
from . import (
    convergence,
    each_step,
    engines_at_one_step,
    engines_over_steps,
    hard_cases,
    long_runs,
    long_time,
    motion,
    motions,
    paper,
    random,
    speed,
    stability,
    throughput,
    twins,
    work_precision,
)
from .declaration import Declaration
from .study import Finding, Progress, Study

_IN_ORDER = (
    *(random, motion, paper, convergence, speed, work_precision, each_step, long_runs, long_time),
    *(engines_at_one_step, engines_over_steps, motions, twins, stability, hard_cases, throughput),
)
STUDIES: Mapping[str, Declaration] = {each.STUDY.name: each.STUDY for each in _IN_ORDER}
"""The declaration of each study by its name, in the order of a report."""


def findings(study: Study, progress: Progress = lambda share, what: None) -> Iterator[Finding]:
    """Yield rows and samples of a study as they are measured.

    Raises
    ------
    BadInput
        There is no study of this name.
    MissingEngine
        An engine is not installed, and `skip_missing` is False.
    """
    choice("name", study.name, tuple(STUDIES))
    return STUDIES[study.name].findings(study, progress)


def rows(study: Study) -> Iterator[Measurement]:
    """Yield only the rows of a study; see `findings`."""
    return (finding for finding in findings(study) if isinstance(finding, Measurement))
