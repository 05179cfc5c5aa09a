"""Random bodies: errors and times of our methods and of engines.

`conservative.scenes.random_body` describes the distribution of the bodies. Each method has up to 17 settings per body, with the
same step sizes for every method with a step and the same tolerances for every adaptive method.

* The error of a setting is the largest attitude error at `SAMPLES` instants, the same for all methods, over 12 rad at the
  initial rate (10 to 20 rad of actual rotation for nine in ten of 120 bodies). Asymmetric bodies in a field amplify errors: an
  initial relative error of the rates by a factor of 10 at the median, of 19 or more on one body in ten, and of 1,400 at most.
  Over 48 rad the factor is 33 at the median and 1,400 or more on one body in twenty.
* A setting has two times of the same motion, final state only. `Measure.TIME_DELIVERED` is the time of a user's call, and both
  sides deliver the attitude R_WB and the rates w_WB_B: a call of our prepared run; an engine's own calls and the conversion of
  its final state (`speed.final_call`). `Measure.TIME` is the time of the compiled loops alone, as in other studies.
* Settings that cannot be the fastest are not timed, to save time: see `worth_timing`. Neither at an error, nor among the
  methods with a tolerance at one of the tolerances `TYPED`.

The reference solution of each body is confirmed by an independent one (`references.truth.confirm`). A body on which they differ
by more than a tenth of the smallest of `DECADES` is not compared; a row has the reason.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Generator, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

from conservative.attitude import angle_between
from conservative.check import positive_integer
from conservative.grid import Grid
from conservative.method import Method, Role, Run
from conservative.outcome import Outcome, OutcomeKind
from conservative.references.precise import Precise
from conservative.references.truth import BITS, Disagreement, confirm
from conservative.references.worker.client import time_limit
from conservative.scenes.random_body import FIELDS, name_of, random_body
from conservative.trajectory import Trajectory

from ..measures.measure import Measure, Value, blanks
from ..measures.measurement import Measurement
from ..measures.processes import Processes
from ..measures.timing import wall_time
from ..speed_ratio import cost, list_deciding
from .case import NOT_DRAWN, Case, Drawn, outcome_of_error
from .declaration import Declaration
from .line import list_settings
from .selection import Missing, tolerance_setting
from .speed import Runs, check_end, keep_end, time_runs
from .study import Progress, Study, remember_truths

BODIES = 10
"""Random bodies in each field."""
DECADES = tuple(10.0**-k for k in range(2, 13))
"""Attitude errors, rad, at which methods are compared."""
SAMPLES = 12
"""Instants of the error. The longest step is the time between two of them."""
STEPS = tuple(SAMPLES * k for k in (1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 18, 22, 27, 33, 40, 50, 60))
"""Steps of the motion, long to short."""
TOLERANCES = (0.5, *(10.0**-k for k in range(1, 17)))
"""Tolerances of adaptive methods; heyoka has its lowest order, 2, at the first."""
TYPED = (1e-3, 1e-6, 1e-9, 1e-12)
"""Tolerances at which methods are compared as a user types them, who does not know their errors."""
TIMES = (Measure.TIME_DELIVERED, Measure.TIME)
"""The times of a setting."""
FEW = slice(None, None, 2)
"""Step sizes and tolerances of a quick study."""
ORDER = 4
"""Smallest order of a method. Methods of lower order take thousands of steps instead of a dozen."""
FLOOR = DECADES[-1] / 10
"""A method that is below this error twice gets no shorter steps, because no decade is left."""
MARGIN = 3.0
"""A setting is timed if its estimated time is at most this multiple of the fastest setting's on its side."""
SLOW, EVERY = 0.01, 3
"""Time, s, of a run above which only every third setting of a line is measured."""
UNTIMED = Outcome(OutcomeKind.SKIPPED, f"estimated time above {MARGIN:g} times the time of another setting with this error")


def random_study(methods: tuple[Method, ...], bodies: int = BODIES, seed: int = 0, **settings: Any) -> Study:
    """Return the study of `bodies` random bodies in each field. The first bodies do not depend on the number.

    `settings` are fields of `Study` by keyword.

    Raises
    ------
    BadInput
        bodies is not an integer of 1 or more, seed not one of 0 or more, or there is no method.
    """
    positive_integer("bodies", bodies)
    places = [(field, seed, index) for field in FIELDS for index in range(bodies)]
    scenes = tuple(random_body(*place).rename(name_of(*place)) for place in places)
    drawn = tuple(Drawn(*place) for place in places)
    return Study(STUDY.name, scenes, methods, truth=remember_truths(confirm), drawn=drawn, **settings)


def settings(method: Method) -> tuple[Method, ...]:
    """Return the settings of a family, of order `ORDER` or more.

    For our methods these are the candidates of the automatic choice and settings with a tolerance, for engines all settings
    that may be the fastest, and for baselines none.
    """
    variants = method.settings_for("fastest")
    if method.role in (Role.OURS, Role.BASELINE):
        approximate = method.method_info.rank is not None and not method.method_info.exact
        variants = (*method.settings_for("candidates"), *filter(tolerance_setting, variants)) if approximate else ()
    return tuple(variant for variant in variants if (variant.order or ORDER) >= ORDER)


def select(methods: Iterable[Method]) -> tuple[Method, ...]:
    """Return the default methods of the study; see `settings`."""
    return tuple(method for method in methods if isinstance(method, Missing) or method in settings(method))


@dataclass(frozen=True)
class TimedSetting:
    """A setting whose run succeeded: its error, rad, its estimated time, s per simulated second, and its trajectory."""

    case: Case
    error: float
    spent: float
    trajectory: Trajectory = field(compare=False)


Line = list[TimedSetting]
"""The points of one line, coarse to fine."""


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield the error of every setting on every body, and the time of those that are worth timing."""
    drawn_of_scenes = study.drawn or (NOT_DRAWN,) * len(study.scenes)
    tell = study.count(progress, len(study.lines) + 2)
    with Processes(study.processes) as processes:
        for scene, drawn in zip(study.scenes, drawn_of_scenes, strict=True):
            tell(f"{scene.name}: truth")
            coarsest = Grid(scene.t_end / SAMPLES, SAMPLES)
            about = Case(study.name, scene, Precise(BITS), coarsest, drawn)
            try:
                truth = study.truth(scene, coarsest)
            except Disagreement as error:
                yield about.row(Value(Measure.AGREEMENT, error.agreement_rad), Outcome(OutcomeKind.SKIPPED, str(error)))
                continue
            yield about.row(Value(Measure.AGREEMENT, truth.agreement_rad), detail=truth.names[1])
            lines: list[Line] = []
            for method, same in study.programs(scene):
                tell(f"{scene.name}: errors of {method.name}")
                if same:
                    yield replace(about, method=method).row(Value(Measure.ATTITUDE_MAX, math.nan), same)
                    continue
                cases = list_cases(Case(study.name, scene, method, coarsest, drawn), study.quick)
                lines.append((yield from find_errors(study, cases, truth.trajectory)))
            chosen = worth_timing(lines)
            tell(f"{scene.name}: timing {len(chosen)} settings")
            yield from time_rows(study, chosen, processes)
            untimed = (point for line in lines for point in line if point not in chosen)
            yield from (row for point in untimed for row in point.case.rows(blanks(*TIMES), UNTIMED))


def list_cases(case: Case, quick: bool = False) -> list[Case]:
    """Return the settings of a line, coarse to fine; `case` has the coarsest step."""
    few, t_end = FEW if quick else slice(None), case.scene.t_end
    return list_settings(case, [Grid(t_end / n, n, n // SAMPLES) for n in STEPS[few]], TOLERANCES[few])


def find_errors(study: Study, settings: list[Case], truth: Trajectory) -> Generator[Measurement, None, Line]:
    """Yield the errors of a line, coarse to fine, until there is no decade left; return its points."""
    line: Line = []
    for i, case in enumerate(settings):
        slow = bool(line) and line[-1].spent * case.scene.t_end > SLOW
        omitted = (slow and i % EVERY) or [point.error < FLOOR for point in line[-2:]] == [True, True]
        if omitted and typed_tolerance(case.method) is None:
            continue
        done = study.attempt_here(case)
        if isinstance(done, Outcome):
            yield case.row(Value(Measure.ATTITUDE_MAX, math.nan), done)
            continue
        error = float(angle_between(truth.R_WB, done.trajectory.R_WB).max())
        spent = min(wall_time(done.run) for _ in range(2))  # the first may compile
        if spent <= SLOW:
            spent = min(spent, *(wall_time(done.run) for _ in range(3)))
        line.append(TimedSetting(case, error, spent / case.scene.t_end, done.trajectory))
        yield case.row(Value(Measure.ATTITUDE_MAX, error))
    return line


def worth_timing(lines: Iterable[Line]) -> list[TimedSetting]:
    """Return the points that can determine the fastest setting of a side, for a decade or at a typed tolerance.

    A side is our methods, or an engine. The points belong to lines with an estimated time of at most `MARGIN` times the fastest
    of the side. Each line contributes the coarsest point that is credited with the decade (see `speed_ratio`), and the one
    before it, or its point at the tolerance.
    """
    sides: dict[str, list[Line]] = {}
    for line in filter(None, lines):
        method = line[0].case.method
        sides.setdefault(Role.OURS if method.role == Role.OURS else method.family, []).append(line)
    chosen: dict[TimedSetting, None] = {}
    for side, error in itertools.product(sides.values(), DECADES):
        costs = [cost([p.error for p in line], [p.spent for p in line], error) for line in side]
        least = min((seconds for seconds in costs if not math.isnan(seconds)), default=math.nan)
        for line, seconds in zip(side, costs, strict=True):
            if seconds <= MARGIN * least:
                chosen.update((line[i], None) for i in list_deciding([p.error for p in line], error))
    for side, typed in itertools.product(sides.values(), TYPED):
        points = [point for line in side for point in line if typed_tolerance(point.case.method) == typed]
        least = min((point.spent for point in points), default=math.nan)
        chosen.update((point, None) for point in points if point.spent <= MARGIN * least)
    return list(chosen)


@lru_cache(maxsize=4096)
def typed_tolerance(method: Method) -> float | None:
    """Return the tolerance of a method if it is one of `TYPED`."""
    setting = tolerance_setting(method)
    value = None if setting is None else getattr(method, setting)
    return next((typed for typed in TYPED if value is not None and math.isclose(typed, value)), None)


def time_rows(study: Study, points: list[TimedSetting], processes: Processes) -> Iterator[Measurement]:
    """Yield the `TIMES` of the points of a body, s per simulated second, final state only, a row for each process."""
    ready: Runs = {}
    with time_limit(study.hang_limit):
        for point in points:
            case = replace(point.case, grid=keep_end(point.case.grid))
            done = prepare_unchecked(case)
            outcome = done if isinstance(done, Outcome) else check_end(point.trajectory, done[1], point.error)
            if isinstance(done, Outcome) or not outcome.ok:
                yield from case.rows(blanks(*TIMES), outcome)
            else:
                ready.update({(case, measure): (case, done[0]) for measure in TIMES})
        yield from time_runs(study, ready, processes)


def prepare_unchecked(case: Case) -> tuple[Run, Trajectory] | Outcome:
    """Return the run and its trajectory, or the outcome of its failure.

    Its drift is not checked, because its errors are measured. With a check of the drift, engines would lose loose tolerances
    that reach a large error.
    """
    try:
        run = case.method.prepare(case.scene, case.grid)
        trajectory = run()
    except Exception as error:
        return outcome_of_error(case.method, error)
    return (run, trajectory) if trajectory.outcome.ok else trajectory.outcome


STUDY = Declaration(
    findings,
    apart=True,
    timed=True,
    in_turn=True,
    draw=random_study,
    settings=settings,
    in_report=select,
    options=("methods", "bodies", "seed"),
)
