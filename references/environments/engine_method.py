"""Methods whose engine runs in an environment, made from the data in the file of the engine."""

from __future__ import annotations

import os
import weakref
from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from time import perf_counter_ns
from types import ModuleType, SimpleNamespace
from typing import Any, ClassVar, Generic, TypeVar

from conservative.batch import Batch
from conservative.errors import IntegrationFailed, MissingEngine, Unsupported
from conservative.grid import Grid
from conservative.method import Run
from conservative.method_info import Maker
from conservative.methods.many import RunMany
from conservative.registry import read_name
from conservative.scene import Scene

from ..engine import principal_axes
from ..worker.client import Worker
from .adapter import AdapterMethod, method_class
from .environment import Environment, find_environment, worker_of
from .plain_numbers import Answer, describe, describe_many, read_many, read_one, take_axes


def engine_class(module: ModuleType) -> type[EngineMethod]:
    """Return the class of the engine in a module that contains `ENGINE` (see `EngineData`) and a function `prepare`."""
    return method_class(module, EngineMethod)


class OtherVersion(MissingEngine):
    """A program has another version than the name of an engine, such as `my_engine@2.0`."""

    def __init__(self, name: str, own: Environment) -> None:
        self.engine = self.package = own.engine
        remedy = f"Write {own.engine} or {own.engine}@{own.version}"
        ImportError.__init__(self, f"{name} is not installed: the program {own.engine} has version {own.version}. {remedy}")


class EngineMethod(AdapterMethod):
    """An engine in its own environment.

    Attributes
    ----------
    version
        Version of the engine; empty for the newest installed one. `at_version` returns the class of another version.
    """

    version: ClassVar[str] = ""

    @classmethod
    @lru_cache(maxsize=256)
    def at_version(cls, version: str) -> type[EngineMethod]:
        """Return the class of a version, whose family is `exudyn@1.13.6`; of the newest one if it is empty."""
        if not version:
            return cls.__mro__[1] if cls.version else cls
        if cls.version:
            return cls.__mro__[1].at_version(version)  # type: ignore[attr-defined]
        names = {"version": version, "family": f"{cls.family}@{version}", "__module__": cls.__module__, "__doc__": cls.__doc__}
        return type(cls.__name__, (cls,), names)

    @property
    def environment(self) -> Environment:
        """The environment. Raises `MissingEnvironment`, or `OtherVersion` of a program."""
        own: Environment | None = getattr(self.adapter, "environment", None)  # only programs have one
        if own is None:
            return find_environment(read_name(self.family).base, self.version)
        if self.version not in ("", own.version):
            raise OtherVersion(self.family, own)
        return own

    @property
    def maker(self) -> Maker:
        return Maker(self.environment.engine, self.environment.version)

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        """Prepare the run in the worker. Raise `Unsupported` if this version does not support it."""
        axes = principal_axes(scene)
        read = read_one(axes, grid, self.label)
        run = self._run(describe(axes, grid), read)
        try:
            run.prepare()
        except NotImplementedError as error:
            raise Unsupported("method", self.name, f"what {self.label} supports ({error})") from None
        except IntegrationFailed as failure:
            return partial(read, failure)
        return run

    def prepare_many(self, bodies: Batch, grid: Grid) -> RunMany | None:
        """Prepare the run of many bodies in the worker; return None if the engine does not support it for these bodies."""
        axes = take_axes(bodies, grid, self.unsupported) if self in self.settings_for("many") else None
        if axes is None:
            return None
        run = self._run(describe_many(axes, grid), read_many(axes, grid))
        try:
            run.prepare()
        except NotImplementedError:
            return None
        return run

    def _run(self, numbers: Mapping[str, Any], read: Callable[[Answer], Result]) -> WorkerRun[Result]:
        worker = worker_of(self.environment, self.precision)
        adapter = os.path.realpath(str(self.adapter.__file__))
        return WorkerRun(worker, {"adapter": adapter, "settings": self.settings, **numbers}, read)


Result = TypeVar("Result")


class WorkerRun(Generic[Result]):
    """A run in a worker. `wall_time` excludes the communication with the worker, and raises as `Worker.ask`."""

    def __init__(self, worker: Worker, given: Mapping[str, Any], read: Callable[[Answer], Result]) -> None:
        self._worker, self._given, self._read = worker, given, read
        self._number, self._start = 0, 0
        self._answer: Mapping[str, Any] = {}

    def __call__(self) -> Result:
        try:
            self._answer = self._ask("run")
            return self._read(self._answer)
        except IntegrationFailed as failure:
            return self._read(failure)

    @property
    def own_loop(self) -> SimpleNamespace:
        """The run without the conversion, for timing only."""
        return SimpleNamespace(wall_time=lambda calls: float(self._ask("time", calls=calls)["seconds"]))

    def wall_time(self, calls: int) -> float:
        """Return the wall time of calls in seconds: in the engine, and for the conversion to trajectories here."""
        answer = self._answer or self._ask("run")
        inside = self.own_loop.wall_time(calls)
        start = perf_counter_ns()
        for _ in range(calls):
            self._read(answer)
        return inside + (perf_counter_ns() - start) * 1e-9

    def prepare(self) -> None:
        """Prepare the run in the worker, again if its process has ended. Raise as `Worker.ask`."""
        if self._start == 0 or self._start != self._worker.starts or self._worker.pid is None:
            self._number = self._worker.ask("prepare", **self._given)["run"]
            self._start = self._worker.starts
            weakref.finalize(self, self._worker.forget, self._start, self._number).atexit = False

    def _ask(self, do: str, **values: Any) -> dict[str, Any]:
        self.prepare()
        return self._worker.ask(do, run=self._number, **values)
