"""The time per body in batches, for our methods and for engines with batches.

`conservative.benchmarks.studies.ensembles` draws the bodies: tops and free bodies that all differ, and many starts of one top.
Each method runs with several step sizes or tolerances and in every way it has: many bodies at once, on one thread and on two,
and for our methods also one body at a time.

* The error of a setting on a body is the largest attitude error at `SAMPLES` instants. Rows contain the median and the 95th
  percentile over the first `bodies` of a kind. Each body has a reference solution that an independent one confirms
  (`conservative.references.truth`); a body for which they disagree is dropped.
* The time is the time of a prepared run over the same motion, final state only, in interleaved rounds and several processes.
  The time of the preparation has its own row. Only settings that determine the cost at one of `ERRORS` are timed: the coarsest
  that reaches it and the one before it, and exact solutions.
* With increasing numbers of bodies, a setting is skipped as soon as a call would exceed the time budget.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from functools import partial
from operator import methodcaller
from typing import Any

import numpy as np

from conservative.attitude import Array, angle_between
from conservative.batch import Batch
from conservative.check import positive_integer
from conservative.errors import BadInput, MissingEngine
from conservative.grid import Grid
from conservative.method import Method
from conservative.number_text import number
from conservative.outcome import Outcome, OutcomeKind
from conservative.references.exact.method import Exact
from conservative.references.truth import Disagreement, Truth
from conservative.scene import Scene

from ..measures.measure import Measure, Value
from ..measures.measurement import Measurement
from ..measures.processes import Processes
from ..speed_ratio import list_deciding
from .case import Case, Drawn, outcome_of_error
from .declaration import Declaration, Extent
from .ensembles import DURATION, KINDS, draw
from .line import list_settings
from .many_runs import ManyDone, RunBlocks, Way, attempt_many, family_settings, list_ways
from .paper import agreement_row
from .selection import Missing, takes_exact_steps, tolerance_setting
from .speed import CALL, UNCOUNTED, keep_end
from .study import Progress, Study

ERRORS = (1e-3, 1e-6, 1e-9)
"""Attitude errors, rad, at which methods are compared."""
SAMPLES = 12
"""Instants of the errors."""
STEPS = tuple(
    SAMPLES * k for k in (1, 2, 3, 4, 6, 8, 11, 16, 23, 32, 45, 64, 91, 128, 181, 256, 362, 512, 724, 1024, 1448, 2048)
)
"""Steps of the motion, long to short."""
EXACT_STEPS = 120
"""Number of steps of exact solutions, which is arbitrary."""
TOLERANCES = tuple(10.0**-k for k in range(1, 14))
FEW = slice(1, None, 3)
"""Step sizes and tolerances of a quick study."""
SIZES, QUICK_SIZES = tuple(10**k for k in range(7)), (1, 100)
"""Numbers of bodies."""
BODIES, QUICK_BODIES = 64, 8
"""Number of bodies whose errors are measured."""
PREPARATION = 8.0
"""Largest time of a preparation, in units of the time limit of a call."""
MEDIAN, MOST = "median", "95 %"
"""Statistics of the errors of the bodies."""
EXACT = "closed form"
"""Detail of errors that do not depend on the step."""


@dataclass(frozen=True)
class ThroughputStudy(Study):
    """The study of many bodies, drawn from a `seed`: errors are measured on `bodies` of them, and times on each of `sizes`.

    Raises
    ------
    BadInput
        As for `Study`, or a size or `bodies` is not an integer of 1 or more.
    """

    sizes: tuple[int, ...] = SIZES
    bodies: int = BODIES
    seed: int = 0

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
    return ThroughputStudy(STUDY.name, scenes, methods, quick, **{**usual, **extent})


@dataclass(frozen=True, eq=False)
class Kind:
    """Bodies of one kind, the indices (n,) of the `measured` ones, and their exact attitudes (n, samples, 3, 3)."""

    study: ThroughputStudy
    bodies: Batch
    measured: Array
    truth: Array


@dataclass(frozen=True, eq=False)
class BatchSetting:
    """A setting and a way whose run succeeded: errors, rad, by statistic, and the time per body, s.

    The time is a share of a call and of its preparation without compilation.
    """

    way: Way
    case: Case
    errors: dict[str, float]
    spent: float
    prepare: float


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield errors of all settings on a few bodies of each kind, and times of the deciding ones for all numbers of bodies."""
    assert isinstance(study, ThroughputStudy)
    ways = [way for method in study.competitors for way in list_ways(method)]
    tell = study.count(progress, len(ways) + len(study.sizes))
    with Processes(study.processes) as processes:
        for scene in study.scenes:
            try:
                kind = yield from find_truth(study, scene)
            except MissingEngine as error:
                case = _case(study, scene, Missing("heyoka", error=error), SAMPLES)
                yield case.row(Value(Measure.AGREEMENT, math.nan), outcome_of_error(case.method, error, study.skip_missing))
                continue
            points: list[BatchSetting] = []
            for way in ways:
                tell(f"{scene.name}: errors of {way.method.name}")
                points += select_deciding((yield from measure_errors(kind, way)))
            for size in study.sizes:
                tell(f"{scene.name}: timing {size} bodies")
                points = yield from time_rows(kind, points, size, processes)


def find_truth(study: ThroughputStudy, scene: Scene) -> Generator[Measurement, None, Kind]:
    """Yield the largest difference of two reference solutions, rad, and a row for each dropped body; return the bodies.

    A body whose two solutions disagree is dropped, and its row has the reason.
    """
    bodies, grid, truths = draw(scene.name, max(*study.sizes, study.bodies), study.seed), _grid(SAMPLES), dict[int, Truth]()
    for i in range(study.bodies):
        try:
            truths[i] = study.truth(bodies.take(i), grid)
        except Disagreement as error:
            case = Case(study.name, scene, Exact(), grid, Drawn(scene.name, study.seed, i))
            yield case.row(Value(Measure.AGREEMENT, error.agreement_rad), Outcome(OutcomeKind.SKIPPED, str(error)))
    worst = max(truths.values(), key=lambda truth: truth.agreement_rad)
    yield replace(agreement_row(study, scene, grid.dt, worst), field=scene.name, seed=study.seed)
    return Kind(study, bodies, np.array(list(truths)), np.array([truth.trajectory.R_WB for truth in truths.values()]))


def _case(study: ThroughputStudy, scene: Scene, method: Method, n: int) -> Case:
    return Case(study.name, scene, method, _grid(n), Drawn(scene.name, study.seed))


def _grid(n: int) -> Grid:
    return Grid(DURATION / n, n, n // SAMPLES)


def measure_errors(kind: Kind, way: Way) -> Generator[Measurement, None, list[BatchSetting]]:
    """Yield the errors of a line, coarse to fine, down to the last of `ERRORS` or to the time budget; return its points.

    Errors are the median and the 95th percentile, rad, of the bodies; a failed body has an error of pi.
    """
    study, n, line = kind.study, len(kind.measured), list[BatchSetting]()
    exact, few = takes_exact_steps(way.method), FEW if study.quick else slice(None)
    one = _case(study, kind.bodies.scene, way.method, EXACT_STEPS if exact else SAMPLES)
    one = replace(one, bodies=n, way=way.text)
    for case in list_settings(one, map(_grid, STEPS[few]), TOLERANCES[few]):
        # Clearly below the smallest error, or too slow: a finer setting does not determine a cost.
        if line and (line[-1].errors[MOST] < ERRORS[-1] / 3 or line[-1].spent * n > 2 * study.longest_run):
            break
        chosen = replace(way, method=case.method)
        done = attempt_many(chosen, kind.bodies[kind.measured], case.grid, study.hang_limit, study.skip_missing)
        if isinstance(done, Outcome):
            yield case.row(Value(Measure.ATTITUDE_MAX, math.nan, MEDIAN), done)
            if done.kind is OutcomeKind.UNSUPPORTED and tolerance_setting(way.method):
                break  # it is unsupported at any tolerance
            continue
        _, block, cost = done
        with np.errstate(all="ignore"):  # too long a step can overflow
            off = angle_between(kind.truth, block.R_WB).max(axis=1)
        off = np.where(block.finished & np.isfinite(off), off, math.pi)
        errors = {MEDIAN: float(np.median(off)), MOST: float(np.quantile(off, 0.95))}
        if block.finished.all():  # otherwise a run ends early, and its time is not the time of the motion
            line.append(BatchSetting(chosen, case, errors, cost.first_call / n, cost.prepare / n))
        values = (Value(Measure.ATTITUDE_MAX, error, statistic) for statistic, error in errors.items())
        yield from case.rows(values, detail=EXACT if exact else "")
    return line


def select_deciding(line: list[BatchSetting]) -> list[BatchSetting]:
    """Return the points of a line that determine the cost at an error."""
    if line and takes_exact_steps(line[0].case.method):
        return line
    errors_of_lines = [[point.errors[statistic] for point in line] for statistic in (MEDIAN, MOST)]
    chosen = {i for errors in errors_of_lines for error in ERRORS for i in list_deciding(errors, error)}
    return [line[i] for i in sorted(chosen)]


def time_rows(
    kind: Kind, points: list[BatchSetting], size: int, processes: Processes
) -> Generator[Measurement, None, list[BatchSetting]]:
    """Yield the times of points on `size` bodies; return the points that can run more bodies within the time budget.

    They are time, s per simulated second, steps per second and preparation, s, each per body.
    """
    study, ready = kind.study, dict[BatchSetting, ManyDone]()
    for point in [replace(point, case=replace(point.case, bodies=size)) for point in points]:
        grid, refused = keep_end(point.case.grid), refuse_long(point, size, study.longest_run)
        done = refused or attempt_many(point.way, kind.bodies[:size], grid, study.hang_limit)
        if isinstance(done, Outcome):
            yield point.case.row(Value(Measure.TIME, math.nan), done)
        else:
            ready[point] = done
    timings = processes.time(
        {point: run for point, (run, *_) in ready.items()},
        {point: partial(prepare_drawn, point.way, point.case.drawn, size, keep_end(point.case.grid)) for point in ready},
        limit=study.hang_limit * (1 + len(ready)),
        rounds=study.rounds,
        min_time=CALL,
        budget=study.timing_budget,
    )
    timed = []
    for point, of_processes in timings.items():
        case, timing, prepare = point.case, of_processes[0], ready[point][2].prepare / size
        yield from case.time_rows(Measure.TIME, of_processes, size * DURATION)
        if timing.outcome.ok and tolerance_setting(case.method):
            yield case.row(Value(Measure.BODY_STEPS, math.nan), UNCOUNTED)
        else:
            yield case.time_row(Measure.BODY_STEPS, case.grid.n_steps * size / timing.minimum, timing)
        yield case.time_row(Measure.PREPARE, prepare, timing)
        if timing.outcome.ok:
            timed.append(replace(point, spent=min(point.spent, timing.minimum / size), prepare=prepare))
    return timed


def prepare_drawn(way: Way, drawn: Drawn, size: int, grid: Grid) -> RunBlocks:
    """Return the run of the first bodies of a kind and seed."""
    assert drawn.seed is not None
    return RunBlocks(way, draw(drawn.field, size, drawn.seed), grid)


def refuse_long(point: BatchSetting, size: int, limit: float) -> Outcome | None:
    """Return the outcome of a skipped run if a call with `size` bodies would take longer than `limit`, s."""
    for what, seconds, most in (("a call", point.spent, limit), ("preparing a call", point.prepare, PREPARATION * limit)):
        if size > 1 and seconds * size > most:
            return Outcome(OutcomeKind.SKIPPED, f"{what} would take {number(seconds * size)} s; --time-limit raises that")
    return None


STUDY = Declaration(
    findings,
    Extent.LONG,
    named=True,
    apart=True,
    timed=True,
    in_turn=True,
    draw=throughput_study,
    settings=methodcaller("settings_for", "many"),
    in_report=family_settings,
    options=("methods", "bodies", "seed", "sizes"),
    report_keywords=(("quick", True), ("bodies", QUICK_BODIES)),  # coarse: preparing engines takes minutes
)
