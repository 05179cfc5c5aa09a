"""One scene, one method, one grid: run it, whatever happens, and write rows about it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any

from conservative.attitude import Array
from conservative.errors import BadInput, IntegrationFailed, MissingEngine
from conservative.grid import Grid
from conservative.method import Method, Role, Run
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures.measure import Value
from ..measures.measurement import Measurement
from ..measures.samples import Samples
from ..measures.timing import Preparation, prepare_and_run
from .method_names import names_of


@dataclass(frozen=True)
class Case:
    """A scene and a method on a grid within a study."""

    study: str
    scene: Scene
    method: Method
    grid: Grid

    @cached_property
    def _names(self) -> dict[str, Any]:
        """The names of the method, looked up once: the version of an engine can be in a file."""
        return asdict(names_of(self.method))

    def row(self, value: Value, outcome: Outcome = OK, detail: str = "") -> Measurement:
        """Return one row."""
        return Measurement(
            study=self.study,
            scene=self.scene.name,
            **self._names,
            role=Role(self.method.role),
            dt=self.grid.dt,
            quantity=value.quantity,
            measure=value.measure,
            value=float(value.value),
            outcome=outcome,
            detail=detail,
        )

    def samples(self, quantity: str, t: Array, value: Array) -> Samples:
        """Return one line: values (n,) at times (n,), s."""
        return Samples(
            study=self.study,
            scene=self.scene.name,
            **self._names,
            role=Role(self.method.role),
            dt=self.grid.dt,
            quantity=quantity,
            t=t,
            value=value,
        )

    def blanks(self, values: Iterable[Value], outcome: Outcome) -> list[Measurement]:
        """Return a row without a value for each: what could not be measured is in the table, too."""
        return [self.row(value.blank, outcome) for value in values]


@dataclass(frozen=True)
class Success:
    """A case that reached its end: the run, which can be called again, its first trajectory and what both cost."""

    run: Run
    trajectory: Trajectory
    cost: Preparation


@dataclass(frozen=True)
class Failure:
    """A case that did not: the outcome that its rows carry."""

    outcome: Outcome


def drop_step(row: Measurement) -> Measurement:
    """Return a row that belongs to no single step."""
    return replace(row, dt=float("nan"))


def fail_unsupported(reason: str) -> Failure:
    """Return the failure of a case that the method cannot do."""
    return Failure(Outcome(OutcomeKind.UNSUPPORTED, reason))


def attempt(case: Case, skip_missing: bool = False) -> Success | Failure:
    """Prepare and run a case once, and check what it gave (`Method.check`); calls of the run afterwards are not checked.

    Failures of the integration, scenes and steps that the method cannot do and exceptions out of an engine become an outcome.
    Exceptions out of our own methods are bugs and are not caught.

    Raises
    ------
    MissingEngine
        The engine is not installed, and `skip_missing` is False.
    """
    try:
        reason = case.method.unsupported(case.scene)
        if reason:
            return fail_unsupported(reason)
        run, found, cost = prepare_and_run(lambda: case.method.prepare(case.scene, case.grid))
        done = Success(run, case.method.check(case.scene, case.grid, found), cost)
    except MissingEngine as error:
        if not skip_missing:
            raise
        return Failure(Outcome(OutcomeKind.MISSING, str(error)))
    except BadInput as error:  # a step that the method does not have
        return fail_unsupported(str(error))
    except IntegrationFailed as failure:
        return Failure(failure.outcome)
    except Exception as error:  # an engine may raise anything, and one engine must not end a run of twenty
        if case.method.role != Role.ENGINE:
            raise
        return Failure(Outcome(OutcomeKind.CRASHED, f"{type(error).__name__}: {error}"))
    return done if done.trajectory.ok else Failure(done.trajectory.outcome)
