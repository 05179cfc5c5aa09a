"""The study of throughput: what a body costs among many, of ours and of engines that run many at once.

The bodies are those of `conservative.benchmarks.studies.ensembles`: they all differ. A method is taken at a ladder of steps, or
of tolerances, and run in every way it has: many at once, on one thread and on two, and, of ours, one at a time.

* The error of a setting on a body is the largest attitude error at `SAMPLES` instants. Of the first `bodies` of a kind the
  median counts, and the 95th percentile. Truth is heyoka in double precision, at a tolerance below round-off; a row says how
  well another formulation agrees with it.
* Times are those of a prepared run over the same motion of which only the start and the end are kept, in interleaved rounds; a
  row apart has what preparing costs. They are taken of the settings that decide what each of `ERRORS` costs (see
  `cost_at_error`): the coarsest credited with it, and the one before it; and of exact solutions, which take any step.
* From one number of bodies to the next a setting is left out, with a row that says so, as soon as a call would take longer than
  the study plans for.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from conservative.attitude import Array, angle_between
from conservative.batch import Batch
from conservative.check import positive_integer
from conservative.errors import BadInput, MissingEngine
from conservative.grid import Grid
from conservative.method import Method
from conservative.outcome import Outcome, OutcomeKind
from conservative.references.engines.heyoka import SMALLEST_TOL, Heyoka

from ..contest import credit, first_within
from ..measures.measure import Measure, Value
from ..measures.measurement import Measurement
from ..measures.timing import Timing, time_interleaved
from .case import Case, Drawn
from .ensembles import DURATION, KINDS, draw
from .many_runs import ManyDone, Way, attempt_many, list_ways
from .selection import Missing, at_tolerance, takes_exact_steps, tolerance_setting
from .speed import CALL, UNCOUNTED, keep_end
from .study import Progress, Study

ERRORS = (1e-3, 1e-6, 1e-9)
"""Attitude errors, rad, at which methods are compared."""
SAMPLES = 12
"""Instants at which errors are read."""
STEPS = tuple(
    SAMPLES * k for k in (1, 2, 3, 4, 6, 8, 11, 16, 23, 32, 45, 64, 91, 128, 181, 256, 362, 512, 724, 1024, 1448, 2048)
)
"""Steps of the motion, long to short."""
EXACT_STEPS = 120
"""Steps of exact solutions, whose length is free."""
TOLERANCES = tuple(10.0**-k for k in range(1, 14))
FEW = slice(1, None, 3)
"""What a quick study takes of both."""
SIZES, QUICK_SIZES = tuple(10**k for k in range(7)), (1, 100)
"""Numbers of bodies."""
BODIES, QUICK_BODIES = 64, 8
"""Bodies whose errors are read."""
PREPARATION = 8.0
"""How many times longer than a call its preparation may take."""
ROUNDS, QUICK_ROUNDS = 5, 3
MEDIAN, MOST = "median", "95 %"
"""Which error of the bodies a value is of."""
EXACT = "closed form"
"""Detail of errors that do not depend on the step."""


@dataclass(frozen=True)
class ThroughputStudy(Study):
    """The study, of so many bodies.

    Attributes
    ----------
    sizes
        Numbers of bodies that are timed.
    bodies, seed
        Number of bodies whose errors are read, and where they are drawn from.

    Raises
    ------
    BadInput
        As `Study` does, and where a size or `bodies` is not an integer of 1 or more.
    """

    sizes: tuple[int, ...] = SIZES
    bodies: int = BODIES
    seed: int = 0

    @property
    def longest_errors(self) -> float:
        """Longest run, s, on the way to smaller errors."""
        return 4 * self.longest_run

    def __post_init__(self) -> None:
        super().__post_init__()
        for size in self.sizes:
            positive_integer("sizes", size)
        if not self.sizes:
            raise BadInput("sizes", "none", "one or more")
        positive_integer("bodies", self.bodies)


def throughput_study(methods: tuple[Method, ...], quick: bool = False, **extent: Any) -> ThroughputStudy:
    """Return the study of many random bodies; `extent` has fields of `ThroughputStudy` by keyword, fewer bodies if it is quick.

    Raises
    ------
    BadInput
        A number is not an integer of 1 or more, a seed not one of 0 or more, or there is no method.
    """
    scenes = tuple(draw(kind, 1, extent.get("seed", 0)).scene for kind in KINDS)
    usual = {"sizes": QUICK_SIZES, "bodies": QUICK_BODIES} if quick else {}
    return ThroughputStudy("throughput", scenes, methods, quick, **{**usual, **extent})


@dataclass(frozen=True, eq=False)
class Kind:
    """Bodies of one kind: as many as are timed, and the exact attitudes (n, samples, 3, 3) of those whose errors are read."""

    study: ThroughputStudy
    bodies: Batch
    truth: Array

    @property
    def few(self) -> Batch:
        """The bodies whose errors are read."""
        return self.bodies[: len(self.truth)]


@dataclass(frozen=True, eq=False)
class Point:
    """A setting that reaches its end, in one way: errors, rad, by which one they are, and what a body costs, s.

    That is a share of a call, and of its preparation with what is compiled at hand.
    """

    way: Way
    case: Case
    errors: dict[str, float]
    spent: float
    prepare: float


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield errors of all settings on a few bodies of each kind, and times of those that decide on more and more bodies."""
    assert isinstance(study, ThroughputStudy)
    ways = [way for method in study.competitors for way in list_ways(method)]
    pieces = len(ways) + len(study.sizes)
    for i, scene in enumerate(study.scenes):
        try:
            kind = yield from find_kind(study, scene.name)
        except MissingEngine as error:
            if not study.skip_missing:
                raise
            grid = Grid(DURATION / SAMPLES, SAMPLES)
            case = Case(study.name, scene, Missing("heyoka", "heyoka", "heyoka"), grid, Drawn(scene.name, study.seed))
            yield case.row(Value(Measure.AGREEMENT, math.nan), Outcome(OutcomeKind.MISSING, str(error)))
            continue
        points: list[Point] = []
        for j, way in enumerate(ways):
            progress(i * pieces + j, len(study.scenes) * pieces, f"{scene.name}: errors of {way.method.name}")
            points += decide((yield from measure_errors(kind, way)))
        for j, size in enumerate(study.sizes, start=len(ways)):
            progress(i * pieces + j, len(study.scenes) * pieces, f"{scene.name}: timing {size} bodies")
            points = yield from time_rows(kind, points, size)


def find_kind(study: ThroughputStudy, name: str) -> Generator[Measurement, None, Kind]:
    """Yield how well two formulations of the truth agree, rad, on the worst body; return the bodies."""
    bodies = draw(name, max(*study.sizes, study.bodies), study.seed)
    grid, few = Grid(DURATION / SAMPLES, SAMPLES), bodies[: study.bodies]
    methods = [Heyoka(SMALLEST_TOL, frame) for frame in ("base_vectors", "body")]
    found = [_attitudes(attempt_many(Way(method, together=False), few, grid, study.hang_limit)) for method in methods]
    kind = Kind(study, bodies, found[0])
    agreement = float(angle_between(*found).max(axis=1).max())
    yield _case(kind, methods[0], grid).row(Value(Measure.AGREEMENT, agreement), detail=methods[1].label)
    return kind


def _attitudes(found: ManyDone | Outcome) -> Array:
    assert isinstance(found, ManyDone), found
    return found.block.R_WB


def _case(kind: Kind, method: Method, grid: Grid) -> Case:
    scene = kind.bodies.scene
    return Case(kind.study.name, scene, method, grid, Drawn(scene.name, kind.study.seed))


def list_cases(kind: Kind, method: Method) -> list[Case]:
    """Return the settings of a line, coarse to fine."""
    few, setting = FEW if kind.study.quick else slice(None), tolerance_setting(method)
    if takes_exact_steps(method):
        return [_case(kind, method, _grid(EXACT_STEPS))]
    if setting is None:
        return [_case(kind, method, _grid(n)) for n in STEPS[few]]
    return [_case(kind, at_tolerance(method, setting, tol), _grid(SAMPLES)) for tol in TOLERANCES[few]]


def _grid(n: int) -> Grid:
    return Grid(DURATION / n, n, n // SAMPLES)


def measure_errors(kind: Kind, way: Way) -> Generator[Measurement, None, list[Point]]:
    """Yield the errors of a line, coarse to fine, to the last of `ERRORS` or the longest run planned for; return its points."""
    line: list[Point] = []
    for case in list_cases(kind, way.method):
        if line and (line[-1].errors[MOST] < ERRORS[-1] / 3 or 2 * line[-1].spent * len(kind.few) > kind.study.longest_errors):
            break
        found = attempt_many(
            replace(way, method=case.method), kind.few, case.grid, kind.study.hang_limit, kind.study.skip_missing
        )
        if isinstance(found, Outcome):
            yield case.row(Value(Measure.ATTITUDE_MAX, math.nan, MEDIAN), found, bodies=len(kind.few), way=way.text)
            if way.method.unsupported(kind.bodies.scene):
                break
            continue
        errors = read_errors(found, kind.truth)
        n = len(kind.few)
        line.append(Point(way, case, errors, found.spent / n, found.prepare / n))
        detail = EXACT if takes_exact_steps(case.method) else ""
        for statistic, error in errors.items():
            yield case.row(Value(Measure.ATTITUDE_MAX, error, statistic), detail=detail, bodies=n, way=way.text)
    return line


def read_errors(found: ManyDone, truth: Array) -> dict[str, float]:
    """Return the median and the 95th percentile, rad, of the bodies' errors; a body that did not get there is off by pi."""
    with np.errstate(all="ignore"):  # too long a step may leave the range of floats
        off = angle_between(truth, found.block.R_WB).max(axis=1)
    off = np.where(found.block.finished & np.isfinite(off), off, math.pi)
    return {MEDIAN: float(np.median(off)), MOST: float(np.quantile(off, 0.95))}


def decide(line: list[Point]) -> list[Point]:
    """Return the points of a line that decide what an error costs."""
    if line and takes_exact_steps(line[0].case.method):
        return line
    chosen: set[int] = set()
    for name in (MEDIAN, MOST):
        credited = credit([point.errors[name] for point in line])
        firsts = [first_within(credited, error) for error in ERRORS]
        chosen.update(i for first in firsts if first is not None for i in (first - 1, first) if i >= 0)
    return [line[i] for i in sorted(chosen)]


def time_rows(kind: Kind, points: list[Point], size: int) -> Generator[Measurement, None, list[Point]]:
    """Yield the times of points on so many bodies; return those for which more bodies do not take too long, either."""
    study, ready = kind.study, {}
    for i, point in enumerate(points):
        if reason := too_long(point, size, study.longest_run):
            yield point.case.row(Value(Measure.TIME, math.nan), reason, bodies=size, way=point.way.text)
            continue
        way = replace(point.way, method=point.case.method)
        found = attempt_many(way, kind.bodies[:size], keep_end(point.case.grid), study.hang_limit)
        if isinstance(found, Outcome):
            yield point.case.row(Value(Measure.TIME, math.nan), found, bodies=size, way=point.way.text)
        else:
            ready[str(i)] = found
    rounds = QUICK_ROUNDS if study.quick else ROUNDS
    timings = time_interleaved({key: found.run for key, found in ready.items()}, rounds, CALL, budget=study.timing_budget)
    done = [
        replace(points[int(key)], spent=min(points[int(key)].spent, timings[key].minimum / size), prepare=found.prepare / size)
        for key, found in ready.items()
    ]
    for point, timing in zip(done, timings.values(), strict=True):
        yield from rows_of(point, size, timing)
    return [point for point, timing in zip(done, timings.values(), strict=True) if timing.outcome.ok]


def too_long(point: Point, size: int, limit: float) -> Outcome | None:
    """Return why so many bodies are not run, if a call would take longer than `limit`, s."""
    for what, seconds, most in (("a call", point.spent, limit), ("preparing a call", point.prepare, PREPARATION * limit)):
        if size > 1 and seconds * size > most:
            return Outcome(OutcomeKind.SKIPPED, f"{what} would take {seconds * size:.2g} s; --time-limit raises that")
    return None


def rows_of(point: Point, size: int, timing: Timing) -> Iterator[Measurement]:
    """Yield what a body costs among so many: the time, s per simulated second, steps per second, and the preparation, s."""
    case, a_body = point.case, timing.minimum / size
    values = {
        Measure.TIME: a_body / DURATION,
        Measure.BODY_STEPS: math.nan if tolerance_setting(case.method) else case.grid.n_steps / a_body,
        Measure.PREPARE: point.prepare,
    }
    for measure, value in values.items():
        outcome = UNCOUNTED if timing.outcome.ok and math.isnan(value) else timing.outcome
        detail = str(timing) if outcome.ok else ""
        yield case.row(Value(measure, value), outcome, detail, bodies=size, way=point.way.text)
