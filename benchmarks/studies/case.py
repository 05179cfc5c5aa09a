"""A case: one scene, one method, one grid. It runs, and its result or failure becomes rows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import conservative
from conservative.attitude import Array
from conservative.errors import BadInput, IntegrationFailed, MissingEngine, PotentialFailed, TorqueFailed
from conservative.grid import Grid
from conservative.method import Method, Role, Run
from conservative.method_info import Maker
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.registry import read_name
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures import errors
from ..measures.measure import Measure, Value
from ..measures.measurement import Measurement, Samples
from ..measures.timing import Preparation, Timing, prepare_and_run
from .selection import Missing, series, series_setting


class Drawn(NamedTuple):
    """A random body: its field or kind, the seed, and its index (None for an ensemble)."""

    field: str = ""
    seed: int | None = None
    body: int | None = None


NOT_DRAWN = Drawn()


@dataclass(frozen=True)
class Case:
    """A scene and a method on a grid.

    `study` is the name of the study, `drawn` the random body that the scene is. `bodies` and `way` are the number of bodies of
    a batch, and how they run, such as "one at a time".
    """

    study: str
    scene: Scene
    method: Method
    grid: Grid
    drawn: Drawn = NOT_DRAWN
    bodies: int | None = None
    way: str = ""

    @cached_property
    def _subject(self) -> dict[str, Any]:
        """Columns that all rows share. Cached, because the version of an engine can be in a file."""
        subject = {"study": self.study, "scene": self.scene.name, **self.drawn._asdict(), **names_of(self.method)}
        return subject | {"role": Role(self.method.role), "dt": self.grid.dt}

    def row(self, value: Value, outcome: Outcome = OK, detail: str = "", process: int | None = None) -> Measurement:
        """Return one row."""
        return Measurement(
            **self._subject,
            bodies=self.bodies,
            way=self.way,
            process=process,
            quantity=value.quantity,
            measure=value.measure,
            value=float(value.value),
            outcome=outcome,
            detail=detail,
        )

    def rows(self, values: Iterable[Value], outcome: Outcome = OK, detail: str = "") -> list[Measurement]:
        """Return a row for each value."""
        return [self.row(value, outcome, detail) for value in values]

    def accuracy_rows(self, trajectory: Trajectory, truth: Trajectory | Outcome) -> list[Measurement]:
        """Return a row for every error and drift of a run that reached its end.

        `truth` is the reference solution at the same times, or the reason why there is none. Then errors are rows with the
        reason; drifts need no reference solution.
        """
        if isinstance(truth, Trajectory):
            return self.rows(errors.measure_errors(trajectory, truth))
        drifts = errors.measure_drifts(trajectory)
        known = {value.key for value in drifts}
        return self.rows(drifts) + self.rows((value for value in errors.blanks(self.scene) if value.key not in known), truth)

    def time_row(self, measure: Measure, spent: float, timing: Timing, process: int | None = None) -> Measurement:
        """Return the row of a measured time, s; its detail is the number of rounds and calls."""
        return self.row(Value(measure, spent), timing.outcome, str(timing) if timing.outcome.ok else "", process)

    def time_rows(self, measure: Measure, timings: Sequence[Timing], unit: float) -> list[Measurement]:
        """Return the row of each process; `unit` is what a call does, such as simulated seconds, so that times are per unit."""
        numbers = range(len(timings)) if len(timings) > 1 else [None]
        return [self.time_row(measure, timing.minimum / unit, timing, n) for n, timing in zip(numbers, timings, strict=True)]

    def samples(self, quantity: str, t: Array, value: Array) -> Samples:
        """Return one line: values (n,) at times (n,), s."""
        return Samples(**self._subject, quantity=quantity, t=t, value=value)


def names_of(method: Method) -> dict[str, str]:
    """Return the columns with names of a method; see `Measurement`."""
    if isinstance(method, Missing):  # version and settings of a missing engine are unknown
        parts = read_name(method.name)
        family, setting = f"{parts.base}@{parts.version}" if parts.version else parts.base, parts.settings or ""
        texts = {"label": method.label, "family": family, "engine": parts.base, "version": "", "setting": setting}
        return {"method": method.name, **texts, "series": series(method), "series_setting": setting}
    try:
        label, maker = method.label, method.maker
    except MissingEngine:
        label, maker = method.name, Maker(conservative.__name__)
    return {
        "method": method.name,
        "label": label,
        "family": method.family,
        "engine": getattr(method, "engine", method.family) if method.role == Role.ENGINE else "",
        "version": "" if maker.package == conservative.__name__ else maker.version,
        "setting": method.setting(),
        "series": series(method),
        "series_setting": series_setting(method),
    }


@dataclass(frozen=True)
class Success:
    """The result of a case that reached its end: the run, which can be called again, its first trajectory, and their cost."""

    run: Run
    trajectory: Trajectory
    cost: Preparation


def drop_step(row: Measurement) -> Measurement:
    """Return the row without a step size."""
    return replace(row, dt=float("nan"))


def outcome_of_error(method: Method, error: Exception, skip_missing: bool = False) -> Outcome:
    """Return the outcome of a run that ended in an exception.

    Raises
    ------
    MissingEngine
        The engine is not installed, and `skip_missing` is False.
    Exception
        A method of ours raised it: that is a bug. An engine may raise anything, which must not end a study of twenty engines.
    """
    if isinstance(error, MissingEngine) and skip_missing:
        return Outcome(OutcomeKind.MISSING, str(error))
    if isinstance(error, IntegrationFailed):
        return error.outcome
    # The method does not have the step, or a function of the scene fails.
    if isinstance(error, BadInput | PotentialFailed | TorqueFailed):
        return Outcome(OutcomeKind.UNSUPPORTED, str(error))
    if isinstance(error, MissingEngine) or method.role != Role.ENGINE:
        raise error
    return Outcome(OutcomeKind.CRASHED, f"{type(error).__name__}: {error}")


def attempt(case: Case, skip_missing: bool = False) -> Success | Outcome:
    """Prepare and run a case once, and check the trajectory (`Method.check`). Later calls of the run are not checked.

    Failures of the integration, unsupported scenes and steps, functions of the scene that fail, and exceptions of an engine
    become an outcome; see `outcome_of_error`.
    """
    try:
        if reason := case.method.unsupported(case.scene):
            return Outcome(OutcomeKind.UNSUPPORTED, reason)
        run, result, cost = prepare_and_run(lambda: case.method.prepare(case.scene, case.grid))
        trajectory = case.method.check(case.scene, case.grid, result)
    except Exception as error:
        return outcome_of_error(case.method, error, skip_missing)
    return Success(run, trajectory, cost) if trajectory.ok else trajectory.outcome
