"""A line: the settings of a method on a scene, coarse to fine, and their errors."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from conservative.errors import BadInput
from conservative.grid import Grid
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.references.environments.engine_method import EngineMethod
from conservative.trajectory import Trajectory

from ..measures import errors
from ..measures.measure import Measure, Value
from ..measures.measurement import Measurement
from .case import Case, Success
from .selection import at_tolerance, takes_exact_steps, tolerance_setting
from .study import Study, too_long

FEWEST_POINTS = 4
"""Smallest number of points, as far as `LINE_LIMIT` allows."""
LINE_LIMIT = 8
"""Time for all points of a slow method, in units of the time budget of a run."""
SLOW_PREPARATION = 1.0
"""Time of a preparation, s, above which an engine gets only every second point: some engines compile for each."""
PREPARATIONS = 30.0
"""Time, s, for all preparations of an engine on a line. Points beyond it are skipped."""
SKIPPED = Outcome(OutcomeKind.SKIPPED, "its engine takes long to prepare a run, so that it has fewer steps")


def list_settings(case: Case, grids: Iterable[Grid], tolerances: Iterable[float]) -> list[Case]:
    """Return the settings of a method: each of the grids, or each of the tolerances that it accepts.

    The result is the given case alone if the method does not support the scene, or if its steps are exact.
    """
    method = case.method
    if method.unsupported(case.scene) or takes_exact_steps(method):
        return [case]
    setting = tolerance_setting(method)
    if setting is None:
        return [replace(case, grid=grid) for grid in grids]
    cases = []
    for tolerance in tolerances:
        with suppress(BadInput):
            cases.append(replace(case, method=at_tolerance(method, setting, tolerance)))
    return cases


@dataclass(frozen=True, eq=False)
class LinePoint:
    """A setting of a line: its case, the result, and its errors by measure (NaN if it failed)."""

    case: Case
    done: Success | Outcome
    errors: Mapping[Measure, float]

    @property
    def outcome(self) -> Outcome:
        """Outcome of the run."""
        return self.done if isinstance(self.done, Outcome) else OK

    def rows(self) -> list[Measurement]:
        """Return a row for each error."""
        return self.case.rows((Value(measure, error) for measure, error in self.errors.items()), self.outcome)


def measure_line(study: Study, cases: Iterable[Case], truth: Trajectory, measures: Sequence[Measure]) -> Iterator[LinePoint]:
    """Yield a point for each case, coarse to fine, with its errors against the reference solution; see `attempt_each`."""
    for case, done in attempt_each(study, cases):
        values: dict[Measure, float] = {}
        if isinstance(done, Success):
            with np.errstate(over="ignore", invalid="ignore"):  # a diverging motion can be finite for some time
                values = {value.measure: value.value for value in errors.measure_errors(done.trajectory, truth)}
        yield LinePoint(case, done, {measure: values.get(measure, math.nan) for measure in measures})


def attempt_each(study: Study, cases: Iterable[Case]) -> Iterator[tuple[Case, Success | Outcome]]:
    """Yield the result of each case, coarse to fine. Cases beyond the time budget are skipped.

    A slow method gets fewer points: the coarsest `FEWEST_POINTS` if their total time allows it, and finer ones within the time
    budget of a run. After a run that was stopped, no finer one is made. An engine in an environment of its own that takes long
    to prepare a run gets fewer points, too; any other method compiles once.
    """
    times: list[float] = []
    prepared: list[float] = []
    per_step = 0.0
    for i, case in enumerate(cases):
        if sum(prepared) > PREPARATIONS or (i % 2 and sum(prepared[:1]) > SLOW_PREPARATION):
            yield case, SKIPPED
            continue
        expected = per_step * case.grid.n_steps or study.expected_cost(case)
        needed = len(times) < FEWEST_POINTS and sum(times) + expected <= LINE_LIMIT * study.longest_run
        if not needed and expected > study.longest_run:
            ended = Outcome(OutcomeKind.SKIPPED, "a coarser run was ended")
            yield case, too_long(expected, f"{study.longest_run:g} s") if expected < math.inf else ended
            continue
        done = study.attempt(case)
        yield case, done
        if isinstance(done, Success):
            times.append(cost_of_run(study, case, done, first=not (times or expected)))
            per_step = times[-1] / case.grid.n_steps
            prepared.append(done.cost.prepare if isinstance(case.method, EngineMethod) else 0.0)
        elif done.kind is OutcomeKind.TIMEOUT:
            per_step = math.inf


def cost_of_run(study: Study, case: Case, done: Success, first: bool) -> float:
    """Return the wall time, s, of a run: of a second call if the first may have included compilation."""
    if not first or done.cost.first_call < study.longest_run / 4:  # compilation in so short a call skips no point
        return done.cost.first_call
    again = study.attempt(case)
    return min(result.cost.first_call for result in (done, again) if isinstance(result, Success))
