"""A study: scenes x methods x step sizes whose rows are measured."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

from conservative.check import positive_integer, positive_number
from conservative.errors import BadInput, PotentialFailed, TorqueFailed
from conservative.grid import ROUNDING, Grid
from conservative.method import Method, Role
from conservative.number_text import number
from conservative.outcome import Outcome, OutcomeKind
from conservative.references.environments.engine_method import EngineMethod
from conservative.references.truth import Disagreement, Truth, Unsolvable, reference
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures.measurement import Measurement, Samples
from .case import Case, Drawn, Success
from .selection import series
from .time_limit import attempt_here, attempt_within, find_trial, is_quick

Progress = Callable[[float, str], None]
"""Called before each piece of work with the finished share of all work, 0 to 1, and a description of the next piece."""
MOST_TRUTHS = 32
"""Number of cached reference solutions: about six for each scene of a report."""
HANG_LIMIT = 60.0
"""Shortest time limit of a run, s: a first run may compile."""
ENGINE_LIMIT = 180.0
"""Shortest time limit, s, of an engine in an environment of its own: importing and compiling it can take a minute."""
HANG_FACTOR = 10.0
"""Ratio of the time limit of a run to the time budget."""
SLOW_FACTOR = 100.0
"""Ratio of the time for all slow runs of a study on one scene to the time budget of a run."""
FindTruth = Callable[[Scene, Grid], Truth]
"""Returns the reference solution of a scene at the samples of a grid."""
Finding = Measurement | Samples
"""A result of a study: a row of the table, or the samples of a line in a chart."""


def remember_truths(find: FindTruth = reference) -> FindTruth:
    """Return `find` with a cache of its last `MOST_TRUTHS` reference solutions, for studies of the same scenes to share.

    A scene whose solutions disagree, which can take a minute, is not tried again up to that time or a later one.
    """
    cached, failed = lru_cache(maxsize=MOST_TRUTHS)(find), dict[Scene, tuple[float, Disagreement]]()

    def remembered(scene: Scene, grid: Grid) -> Truth:
        end = grid.n_steps * grid.dt
        if scene in failed and end >= failed[scene][0] * (1 - ROUNDING):
            raise failed[scene][1].with_traceback(None)
        try:
            return cached(scene, grid)
        except Disagreement as failure:
            failed[scene] = end, failure
            raise
        except (BadInput, PotentialFailed, TorqueFailed) as failure:  # such as of a record up to t_end, in a last step beyond
            raise Unsolvable(scene.name, failure) from None

    return remembered


@dataclass(frozen=True)
class Study:
    """A study.

    Attributes
    ----------
    name
        Name of a study in `conservative.benchmarks.studies.studies`.
    scenes, methods
        Scenes and methods. Unsupported combinations have rows with that outcome.
    quick
        Fewer points and rounds.
    skip_missing
        Rows with the outcome "missing" instead of `MissingEngine`.
    truth
        Source of reference solutions; studies of the same scenes can share it.
    time_limit
        Time budget of a run, s; default 0.6, or 0.15 with `quick`. A slower method gets fewer points, and slow runs on a scene
        take up to `SLOW_FACTOR` budgets together (see `skip_slow`).
    processes
        Number of processes that time the same runs in turn, for an interval of each ratio; see `measures.processes`.
    drawn
        The random body that each scene is; empty for other scenes.

    Raises
    ------
    BadInput
        There are no scenes or no methods, two scenes have one name, or the limit is not a finite duration above 0.
    """

    name: str
    scenes: tuple[Scene, ...]
    methods: tuple[Method, ...]
    quick: bool = False
    skip_missing: bool = False
    truth: FindTruth = field(default_factory=remember_truths)
    time_limit: float | None = None
    processes: int = 1
    drawn: tuple[Drawn, ...] = ()

    @property
    def rounds(self) -> int:
        """Rounds of interleaved timing."""
        return 7 if self.quick else 15

    @property
    def timing_budget(self) -> float:
        """Time budget, s, for all rounds of one run; slow runs get fewer rounds."""
        return min(0.06 if self.quick else 0.6, self.longest_run)

    @property
    def longest_run(self) -> float:
        """Time budget, s, of a single run and of a timed call."""
        return self.time_limit or (0.15 if self.quick else 0.6)

    @property
    def hang_limit(self) -> float:
        """Time limit of a run in this process or of a call that is timed, s."""
        return max(HANG_LIMIT, HANG_FACTOR * self.longest_run)

    def limit_of(self, method: Method) -> float:
        """Return the time limit, s, of a run of a method."""
        return max(ENGINE_LIMIT if isinstance(method, EngineMethod) else 0.0, self.hang_limit)

    @property
    def competitors(self) -> tuple[Method, ...]:
        """The methods except reference solutions."""
        return tuple(method for method in self.methods if method.role != Role.TRUTH)

    @property
    def lines(self) -> tuple[Method, ...]:
        """One of the competitors for each line of a chart. Variants that differ only in their tolerance are one line."""
        return tuple({series(method): method for method in self.competitors}.values())

    def programs(self, scene: Scene) -> list[tuple[Method, Outcome | None]]:
        """Return the lines, each with the reason not to measure it if an earlier one runs the same program on the scene."""
        first: dict[object, str] = {}
        pairs = [(method, first.setdefault(method.program(scene), series(method))) for method in self.lines]
        return [
            (method, None if name == series(method) else Outcome(OutcomeKind.SKIPPED, f"the same program as {name}"))
            for method, name in pairs
        ]

    def attempt(self, case: Case) -> Success | Outcome:
        """Return the result of a case within the time limit of a run; see `attempt_within`."""
        return attempt_within(self.limit_of(case.method), case, self.skip_missing)

    def attempt_here(self, case: Case) -> Success | Outcome:
        """Return the result of a case whose run is to be timed; see `time_limit.attempt_here`."""
        return attempt_here(self.limit_of(case.method), case, self.skip_missing)

    def find_truth(self, scene: Scene, grid: Grid) -> Trajectory | Outcome:
        """Return the reference solution, or the outcome of rows that cannot be measured without a confirmed one."""
        try:
            return self.truth(scene, grid).trajectory
        except Disagreement as failure:
            return without_truth(failure)

    def expected_cost(self, case: Case) -> float:
        """Return the wall time, s, that a run of a case is expected to take, from a short run; 0 if its steps are quick."""
        if is_quick(case) or case.method.unsupported(case.scene):
            return 0.0
        cost = find_trial(self.longest_run, self.limit_of(case.method), case, self.skip_missing).expect(case)
        return 0.0 if math.isnan(cost) else cost  # the run itself tells how it fails

    def skip_slow(self, *ranks: Sequence[Case]) -> dict[Case, Outcome]:
        """Return the cases on one scene that are not run, with the reason.

        All others take at most `SLOW_FACTOR` budgets. Cases of the first rank come before the others, and quick ones
        before slow ones. All that counts is measured before.
        """
        left, skipped = SLOW_FACTOR * self.longest_run, dict[Case, Outcome]()
        for rank in ranks:
            costs = {case: self.expected_cost(case) for case in rank}
            for case in sorted(costs, key=costs.__getitem__):
                if costs[case] <= left:
                    left -= costs[case]
                else:
                    skipped[case] = too_long(costs[case], f"the {number(left)} s left for slow runs")
        return skipped

    def count(self, progress: Progress, per_scene: int) -> Callable[[str], None]:
        """Return a function to be called with what comes next, before each of `per_scene` pieces of work for each scene."""
        done, total = itertools.count(), len(self.scenes) * per_scene
        return lambda what: progress(next(done) / total, what)

    def __post_init__(self) -> None:
        for argument in ("scenes", "methods"):
            if not getattr(self, argument):
                raise BadInput(argument, "none", "one or more")
        names = [scene.name for scene in self.scenes]
        if repeated := next((name for name in names if names.count(name) > 1), ""):  # rows would be taken for one scene's
            raise BadInput("scenes", f"two with the name {repeated!r}", "scenes with different names (`name` in a scene file)")
        positive_integer("processes", self.processes)
        if self.time_limit is not None:
            positive_number("time_limit", self.time_limit, "a finite duration above 0, s")


def without_truth(failure: Disagreement) -> Outcome:
    """Return the outcome of rows that need a reference solution, of a scene without a confirmed one."""
    return Outcome(OutcomeKind.SKIPPED, f"no reference solution: {failure}")


def too_long(cost: float, limit: str) -> Outcome:
    """Return the outcome of a run that is not made, because it would take `cost` s, and its limit in words."""
    text = f"would take about {number(cost)} s, more than {limit}; raise --time-limit"
    return Outcome(OutcomeKind.SKIPPED, text)


Maker = Callable[[Study, Progress], Iterator[Finding]]
"""A function that yields the findings of a study."""
