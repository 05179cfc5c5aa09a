"""What a study is: which rows to make, of scenes x methods x steps, and whom to tell how far it is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache

from conservative.check import positive_number
from conservative.errors import BadInput
from conservative.grid import Grid
from conservative.method import Method, Role
from conservative.references.truth import Truth, reference
from conservative.scene import Scene

from ..measures.measurement import Measurement, Samples

Progress = Callable[[int, int, str], None]
"""Called before each piece of work: pieces done, pieces in all, and what comes next."""
MOST_TRUTHS = 32
"""Motions that `Truths` keeps: some six for each scene of a report."""
HANG_LIMIT = 60.0
"""Shortest time, s, after which a run that does not end is ended: a first run may compile."""
HANG_FACTOR = 10.0
"""How many times longer than what a study plans with a run may take before it is ended."""
FindTruth = Callable[[Scene, Grid], Truth]
Finding = Measurement | Samples
"""What a study yields: rows of the table, and lines of pictures."""


class Truths:
    """A cache of exact motions, which studies of the same scenes share: it keeps the last `MOST_TRUTHS` that were asked for.

    `find` gives the motion of a scene at the samples of a grid, by default from two independent truths that agree.
    """

    def __init__(self, find: FindTruth = reference) -> None:
        self._find = lru_cache(maxsize=MOST_TRUTHS)(find)

    def __call__(self, scene: Scene, grid: Grid) -> Truth:
        """Return the motion of a scene at the samples of a grid."""
        return self._find(scene, grid)


@dataclass(frozen=True)
class Study:
    """A study.

    Attributes
    ----------
    name
        One of those in `conservative.benchmarks.studies.studies`.
    scenes, methods
        What is crossed; methods that cannot do a scene get rows that say so.
    quick
        Fewer points and rounds.
    skip_missing
        Rows with the outcome "missing" instead of `MissingEngine`.
    truth
        Where the exact motion comes from; studies of the same scenes can share what they find.
    time_limit
        Longest single run, s, that the study plans for; default 0.6, or 0.15 with `quick`. A slower method gets fewer points.

    Raises
    ------
    BadInput
        There is nothing to cross, or the limit is not a finite duration above 0.
    """

    name: str
    scenes: tuple[Scene, ...]
    methods: tuple[Method, ...]
    quick: bool = False
    skip_missing: bool = False
    truth: FindTruth = field(default_factory=Truths)
    time_limit: float | None = None

    @property
    def rounds(self) -> int:
        """Rounds of interleaved timing."""
        return 3 if self.quick else 9

    @property
    def timing_budget(self) -> float:
        """Time, s, for all rounds of one run, at most that of the longest run; slow ones get fewer rounds."""
        return min(0.06 if self.quick else 0.6, self.longest_run)

    @property
    def longest_run(self) -> float:
        """Time, s, of the longest single run that the study plans for: on the way to shorter steps, and of a timed call."""
        return self.time_limit or (0.15 if self.quick else 0.6)

    @property
    def hang_limit(self) -> float:
        """Time, s, after which a run is ended."""
        return max(HANG_LIMIT, HANG_FACTOR * self.longest_run)

    @property
    def competitors(self) -> tuple[Method, ...]:
        """The methods without those that the others are measured against."""
        return tuple(method for method in self.methods if method.role != Role.TRUTH)

    def __post_init__(self) -> None:
        for argument in ("scenes", "methods"):
            if not getattr(self, argument):
                raise BadInput(argument, "none", "one or more")
        if self.time_limit is not None:
            positive_number("time_limit", self.time_limit, "a finite duration above 0, s")


Maker = Callable[[Study, Progress], Iterator[Finding]]
"""What makes the findings of a study."""
