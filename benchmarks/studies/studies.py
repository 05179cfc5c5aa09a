"""The studies by name.

study = STUDIES["convergence"].plan(selection.methods(), selection.scenes())
for finding in findings(study): ...
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from conservative.check import choice
from conservative.grid import grid_for
from conservative.references.truth import Disagreement

from ..measures import errors
from ..measures.measurement import Measurement
from . import (
    convergence,
    each_step,
    hard_cases,
    long_runs,
    long_time,
    motion,
    paper,
    random,
    speed,
    stability,
    throughput,
    work_precision,
)
from .case import Case
from .declaration import Declaration
from .study import Finding, Progress, Study, without_truth

_IN_ORDER = (
    *(random, motion, paper, convergence, speed, work_precision, each_step, long_runs, long_time),
    *(stability, hard_cases, throughput),
)
STUDIES: Mapping[str, Declaration] = {module.STUDY.name: module.STUDY for module in _IN_ORDER}
"""The declaration of each study by its name, in the order of a report."""


def findings(study: Study, progress: Progress = lambda share, what: None) -> Iterator[Finding]:
    """Yield rows and samples of a study as they are measured.

    A scene without a reference solution has rows that are skipped with the reason, and the study goes on with the next scene.
    The studies of accuracy measure the drifts of such a scene all the same.

    Raises
    ------
    BadInput
        There is no study of this name.
    MissingEngine
        An engine is not installed, and `skip_missing` is False.
    """
    choice("name", study.name, tuple(STUDIES))
    return _go_on(study, progress)


def _go_on(study: Study, progress: Progress) -> Iterator[Finding]:
    left: Study | None = study
    while left:

        def tell(share: float, what: str, part: float = len(left.scenes) / len(study.scenes)) -> None:
            progress(1 - part + share * part, what)

        try:
            yield from STUDIES[study.name].findings(left, tell)
            return
        except Disagreement as failure:
            i = [scene.name for scene in left.scenes].index(failure.scene)
            scene, reason = left.scenes[i], without_truth(failure)
            for method in left.competitors:
                case = Case(study.name, scene, method, grid_for(scene, min(scene.dt, scene.t_end)))
                yield from case.rows(errors.blanks(scene), reason)
            later = left.scenes[i + 1 :]
            left = replace(left, scenes=later, drawn=left.drawn[i + 1 :]) if later else None


def rows(study: Study) -> Iterator[Measurement]:
    """Yield only the rows of a study; see `findings`."""
    return (finding for finding in findings(study) if isinstance(finding, Measurement))
