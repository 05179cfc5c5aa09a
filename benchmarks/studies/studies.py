"""Which rows to make: scenes x methods x steps, six kinds of study.

for study in studies.studies(selection.scenes(), selection.methods()):
    for row in studies.rows(study): ...
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

from conservative.check import choice
from conservative.errors import BadInput
from conservative.method import Grid, Method
from conservative.scene import Scene

from ..measures.measurement import Measurement

if TYPE_CHECKING:
    from conservative.references.truth import Truth

Progress = Callable[[int, int, str], None]
"""Called before each piece of work: pieces done, pieces in all, and what comes next."""
FindTruth = Callable[[Scene, Grid], "Truth"]

CROSSED = ("paper", "convergence", "speed", "work_precision")
"""Studies of chosen scenes."""
HARD = ("stability", "hard_cases")
"""Studies of the hard cases; the last takes every registered scene."""
NAMES = CROSSED + HARD


@lru_cache(maxsize=32)
def reference(scene: Scene, grid: Grid) -> Truth:
    """Return the exact motion from two independent truths that agree (`conservative.references.truth`)."""
    from conservative.references import truth

    return truth.reference(scene, grid)


@dataclass(frozen=True)
class Study:
    """A study.

    Attributes
    ----------
    name
        paper: drifts and errors at the paper's steps. convergence: errors over a ladder of steps, and the observed order.
        speed: wall time at the scene's step, all methods interleaved. work_precision: error and time of each step or tolerance.
        stability: the largest step that works. hard_cases: errors, drifts and status over the first part of each motion.
    scenes, methods
        What is crossed; methods that cannot do a scene get rows that say so.
    quick
        Fewer points and rounds.
    skip_missing
        Rows with status "missing" instead of `MissingEngine`.
    truth
        Where the exact motion comes from.

    Raises
    ------
    BadInput
        The name is not that of a study, or there is nothing to cross.
    """

    name: str
    scenes: tuple[Scene, ...]
    methods: tuple[Method, ...]
    quick: bool = False
    skip_missing: bool = False
    truth: FindTruth = reference

    @property
    def rounds(self) -> int:
        """Rounds of interleaved timing."""
        return 3 if self.quick else 9

    @property
    def timing_budget(self) -> float:
        """Time, s, for all rounds of one run; slow ones get fewer rounds."""
        return 0.06 if self.quick else 0.6

    @property
    def longest_run(self) -> float:
        """Time, s, of the longest single run that the study waits for on the way down a ladder of steps."""
        return 0.15 if self.quick else 0.6

    def __post_init__(self) -> None:
        choice("name", self.name, NAMES)
        for argument in ("scenes", "methods"):
            if not getattr(self, argument):
                raise BadInput(argument, "none", "one or more")


def studies(
    scenes: tuple[Scene, ...], methods: tuple[Method, ...], quick: bool = False, skip_missing: bool = False
) -> tuple[Study, ...]:
    """Return the four studies of the same scenes and methods, in the order of `CROSSED`."""
    return tuple(Study(name, scenes, methods, quick, skip_missing) for name in CROSSED)


def hard(methods: tuple[Method, ...], skip_missing: bool = False) -> tuple[Study, ...]:
    """Return the studies of the hard cases: stability, and every registered scene with one or two settings of each family."""
    from . import hard_cases, selection, stability

    return (
        Study("stability", selection.scenes(stability.SCENES), methods, skip_missing=skip_missing),
        Study("hard_cases", hard_cases.scenes(), hard_cases.settings(methods), skip_missing=skip_missing),
    )


def _silent(done: int, total: int, what: str) -> None:
    """Report to nobody."""


def rows(study: Study, progress: Progress = _silent) -> Iterator[Measurement]:
    """Yield the rows of a study as they are measured.

    Raises
    ------
    MissingEngine
        An engine is not installed, and the study does not skip what is missing.
    """
    from . import hard_cases, paper, speed, stability

    makers = {
        "paper": paper.paper,
        "convergence": paper.convergence,
        "speed": speed.speed,
        "work_precision": speed.work_precision,
        "stability": stability.stability,
        "hard_cases": hard_cases.hard_cases,
    }
    return makers[study.name](study, progress)
