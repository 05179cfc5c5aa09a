"""The studies by name, and the studies of a report.

for study in studies.cross_studies(studies.MAIN, selection.scenes(), selection.methods()):
    for finding in studies.findings(study): ...
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from conservative.check import choice
from conservative.method import Method
from conservative.scene import Scene

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
    paper,
    paper_figures,
    price,
    random,
    selection,
    speed,
    stability,
    throughput,
    work_precision,
)
from .study import Finding, Maker, Progress, Study, remember_truths

_IN_ORDER = (
    *(motion, paper, convergence, speed, work_precision, each_step, long_runs, long_time, paper_figures),
    *(engines_at_one_step, engines_over_steps, stability, hard_cases, random, price, throughput),
)
MAKERS: Mapping[str, Maker] = {study.__name__.rpartition(".")[2]: study.findings for study in _IN_ORDER}
"""Function of each study, by the name of its file."""
HARD = ("stability", "hard_cases")
"""Studies of the hard cases: of selected scenes, and of every registered scene."""
ENGINES = ("engines_at_one_step", "engines_over_steps")
"""Studies of the selected scenes with engines only."""
RANDOM, THROUGHPUT, LONG_TIME, PRICE = "random", "throughput", "long_time", "price"
"""Studies of random bodies, of many random bodies, of errors over a million turns, and of new processes."""
MAIN = ("motion", "paper", "convergence", "speed", "work_precision", "long_runs")
"""Studies of the selected scenes and methods in every report."""
IN_TURN = ("random", "work_precision", "each_step", "throughput")
"""Studies of times that several processes measure in turn, in a full report and alone."""
MORE = ("each_step", LONG_TIME, "paper_figures")
"""Studies of the same scenes and methods in a full report only."""


def cross_studies(
    names: Iterable[str],
    scenes: tuple[Scene, ...],
    methods: tuple[Method, ...],
    quick: bool = False,
    skip_missing: bool = False,
    time_limit: float | None = None,
    processes: int = 1,
) -> tuple[Study, ...]:
    """Return the named studies of the same scenes and methods; they share their reference solutions.

    Those in `IN_TURN` measure times in a number of `processes`.
    """
    truths = remember_truths()
    return tuple(
        Study(name, scenes, methods, quick, skip_missing, truths, time_limit, processes if name in IN_TURN else 1)
        for name in names
    )


def list_hard_studies(
    methods: tuple[Method, ...], skip_missing: bool = False, time_limit: float | None = None
) -> tuple[Study, ...]:
    """Return the studies of the hard cases: stability, and every registered scene with one or two settings of each family."""
    scenes, settings = selection.scenes(stability.SCENES), hard_cases.settings(methods)
    return (
        Study("stability", scenes, methods, skip_missing=skip_missing, time_limit=time_limit),
        Study("hard_cases", hard_cases.scenes(), settings, skip_missing=skip_missing, time_limit=time_limit),
    )


def findings(study: Study, progress: Progress = lambda share, what: None) -> Iterator[Finding]:
    """Yield rows and samples of a study as they are measured.

    Raises
    ------
    BadInput
        There is no study of this name.
    MissingEngine
        An engine is not installed, and `skip_missing` is False.
    """
    choice("name", study.name, tuple(MAKERS))
    return MAKERS[study.name](study, progress)


def rows(study: Study) -> Iterator[Measurement]:
    """Yield only the rows of a study; see `findings`."""
    return (finding for finding in findings(study) if isinstance(finding, Measurement))
