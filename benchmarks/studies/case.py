"""One scene, one method, one grid: run it, whatever happens, and write rows about it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from conservative.errors import BadInput, IntegrationFailed, MissingEngine
from conservative.method import Grid, Method, Role, Run
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures.measurement import Measurement
from ..measures.timing import Preparation, prepared

OK = "ok"
MISSING, UNSUPPORTED, ENGINE_ERROR = "missing", "unsupported", "engine error"
SKIPPED, NO_ORDER = "skipped", "no order"


@dataclass(frozen=True)
class Case:
    """A scene and a method on a grid within a study."""

    study: str
    scene: Scene
    method: Method
    grid: Grid

    def row(self, measure: str, value: float, unit: str, status: str = OK, detail: str = "") -> Measurement:
        """Return one row."""
        method, who = self.method, label_of(self.method)
        return Measurement(
            self.study,
            self.scene.name,
            method.name,
            who,
            method.role,
            self.grid.dt,
            measure,
            float(value),
            unit,
            status,
            detail,
        )

    def blanks(self, measures: Iterable[tuple[str, str]], status: str, detail: str = "") -> list[Measurement]:
        """Return a row without a value for each (measure, unit): what could not be measured is in the table, too."""
        return [self.row(measure, float("nan"), unit, status, detail) for measure, unit in measures]


@dataclass(frozen=True)
class Done:
    """A case that reached its end: the run, which can be called again, its first trajectory and what both cost."""

    run: Run
    trajectory: Trajectory
    cost: Preparation


@dataclass(frozen=True)
class Failed:
    """A case that did not: the status that its rows carry, and more words about it."""

    status: str
    detail: str = ""


def at_no_step(row: Measurement) -> Measurement:
    """Return a row that belongs to no single step."""
    return replace(row, dt=float("nan"))


def label_of(method: Method) -> str:
    """Return the method's label; its name where the engine that knows the version is missing."""
    try:
        return method.label
    except MissingEngine:
        return method.name


def attempt(case: Case, skip_missing: bool = False) -> Done | Failed:
    """Prepare and run a case once.

    Failures of the integration, scenes and steps that the method cannot do and exceptions out of an engine become a status.
    Exceptions out of our own methods are bugs and are not caught.

    Raises
    ------
    MissingEngine
        The engine is not installed, and `skip_missing` is False.
    """
    try:
        reason = case.method.unsupported(case.scene)
        if reason:
            return Failed(UNSUPPORTED, reason)
        done = Done(*prepared(lambda: case.method.prepare(case.scene, case.grid)))
    except MissingEngine as error:
        if not skip_missing:
            raise
        return Failed(MISSING, str(error))
    except BadInput as error:  # a step that the method does not have
        return Failed(UNSUPPORTED, str(error))
    except IntegrationFailed as failure:
        return Failed(str(failure.outcome))
    except Exception as error:  # an engine may raise anything, and one engine must not end a run of twenty
        if case.method.role != Role.ENGINE:
            raise
        return Failed(ENGINE_ERROR, f"{type(error).__name__}: {error}")
    return done if done.trajectory.ok else Failed(str(done.trajectory.outcome))
