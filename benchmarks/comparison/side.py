"""One side of a comparison: the process of a version, and its methods as `Method`, for studies and measures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from conservative.errors import IntegrationFailed
from conservative.grid import Grid
from conservative.method import Method, Role
from conservative.outcome import Outcome, OutcomeKind
from conservative.references.environments.engine_method import WorkerRun
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from . import inside
from .version import Version

_COUNTS = tuple(each.name for each in fields(Counters))
_ADAPTER = str(Path(inside.__file__).resolve())


class FailedThere(IntegrationFailed):
    """A run of a version failed. Attribute: `outcome`, as that version has it."""

    def __init__(self, outcome: Outcome) -> None:
        self.outcome = outcome
        super().__init__(f"The run of this version ended: {outcome}. Use a run that the version completes")


@dataclass(frozen=True)
class Setting:
    """A method with its settings in one version, as `Method` has them; `engine` is its label if it is somebody else's."""

    name: str
    label: str
    order: int | None
    engine: str


class Side:
    """A version and its process; each version has its own folder of compiled kernels."""

    def __init__(self, version: Version) -> None:
        self.version, kernels = version, version.environment.folder / "home" / "kernels"
        self._worker = version.environment.start_worker({"NUMBA_CACHE_DIR": str(kernels)})

    def close(self) -> None:
        """End the process; the next call starts another one."""
        self._worker.close()

    def ask(self, function: str, **values: Any) -> dict[str, Any]:
        """Return the result of a function of `inside`. Raise `IntegrationFailed` if the version cannot answer."""
        return self._worker.ask("call", adapter=_ADAPTER, function=function, **values)

    def settings(self, names: Sequence[str]) -> tuple[Setting, ...]:
        """Return the settings of the suite of some methods, by default of all that are under test."""
        return tuple(Setting(**each) for each in self.ask("list_methods", names=list(names))["methods"])

    def solver(self, states: States, **values: Any) -> WorkerRun[Trajectory]:
        """Return a run that gives a trajectory."""
        return WorkerRun(self._worker, {"adapter": _ADAPTER, "settings": {"task": "solve"}, **values}, states)

    def timed(self, scene: str, method: str, dt: float, n_steps: int) -> TimedRun:
        """Return a run of n_steps steps dt, s, to be timed, prepared."""
        values = {"scene": scene, "method": method, "dt": dt, "n_steps": n_steps}
        run = TimedRun(self._worker, {"adapter": _ADAPTER, "settings": {"task": "time"}, **values}, States())
        run.prepare()
        return run


class TimedRun(WorkerRun[Trajectory]):
    """A run that is only ever timed."""

    def __call__(self) -> Any:
        return self.wall_time(1)

    def wall_time(self, calls: int) -> float:
        return float(self._ask("time", calls=calls)["seconds"])


@dataclass(frozen=True)
class States:
    """Makes trajectories of a scene from the states of a version."""

    scene: Scene | None = None
    label: str = ""

    def trajectory(self, found: Mapping[str, Any]) -> Trajectory:
        """Return the samples, with the failure if there is one."""
        assert self.scene is not None
        counts = Counters(**{name: found["counts"].get(name) for name in _COUNTS})
        failure = found["failure"]
        ended = FailedThere(Outcome(OutcomeKind(failure[0]), *failure[1:])) if failure else None
        return Trajectory(self.scene, found["t"], found["R_WB"], found["w_WB_B"], self.label, counts, ended)

    def failure(self, failure: IntegrationFailed) -> Trajectory:
        """Return a trajectory without samples."""
        assert self.scene is not None
        return Trajectory(self.scene, np.empty(0), np.empty((0, 3, 3)), np.empty((0, 3)), self.label, Counters(0), failure)


@dataclass(frozen=True)
class Remote(Method):
    """A method of a version on a scene that both sides know by `scene_name`; `longest` is its longest step there, s."""

    side: Side = field(compare=False, repr=False)
    found: Setting
    scene_name: str
    longest: float

    family: ClassVar[str] = "remote"
    role: ClassVar[Role] = Role.OURS

    @property
    def name(self) -> str:
        return self.found.name

    @property
    def label(self) -> str:
        return self.found.label

    @property
    def order(self) -> int | None:
        return self.found.order

    def longest_step(self, scene: Scene) -> float:
        return self.longest

    def prepare(self, scene: Scene, grid: Grid) -> WorkerRun[Trajectory]:
        """Return the run. It is prepared at its first call, so that a failure to prepare is a failure of the run."""
        values = {"dt": grid.dt, "n_steps": grid.n_steps, "every": grid.every, "w_WB_B0": scene.w_WB_B0}
        return self.side.solver(States(scene, self.label), scene=self.scene_name, method=self.name, **values)
