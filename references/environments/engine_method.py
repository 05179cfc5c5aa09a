"""A method whose engine runs in an environment: what every adapter shares, and how scenes and samples travel."""

from __future__ import annotations

import inspect
import weakref
from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import lru_cache, partial
from pathlib import Path
from time import perf_counter_ns
from types import MappingProxyType
from typing import Any, ClassVar, Generic, Protocol, TypeVar

import numpy as np

from conservative import registry
from conservative.batch import Batch
from conservative.card import Maker
from conservative.check import choice
from conservative.errors import BadInput, IntegrationFailed, Unsupported
from conservative.grid import Grid
from conservative.method import Method, Role, Run
from conservative.methods.many import RunMany
from conservative.scene import Scene

from ..engine import gravity_or_free, mass_model_reason, principal_axes
from .client import Worker, worker_of
from .environment import Distribution, Environment, find_environment
from .plain_numbers import ManySamples, Samples, describe, describe_many, take_axes

Orders = Mapping[str, int | None]


class EngineMethod(Method):
    """An engine in an environment of its own.

    A subclass is a frozen dataclass of the engine's settings, which are plain values, with the attributes below. The file
    `inside/FAMILY.py` beside its own runs in the environment. It has a function `prepare(given)`, where `given` has the fields
    that `plain_numbers.describe` lists.

    Attributes
    ----------
    distribution
        What is installed for the engine.
    version
        Version of the engine; empty for the newest that is installed. `at_version` makes the class of another one.
    precision
        Of its numbers: "f64" or "f32". An engine that has both has it as a setting.
    takes_gravity
        Whether its adapter has bodies about a fixed point in uniform gravity, beside free ones.
    free_only
        Why it has free bodies only, where it is the engine that has no others.
    orders
        The values of its first setting, with their orders; empty if that is not a choice. An order is None if the engine
        chooses its own steps.

    Raises
    ------
    BadInput
        A setting is unknown or out of range.
    MissingEngine
        It is not installed: no environment has it.
    """

    role: ClassVar[Role] = Role.ENGINE
    distribution: ClassVar[Distribution]
    version: ClassVar[str] = ""
    precision: ClassVar[str] = "f64"
    takes_gravity: ClassVar[bool] = False
    free_only: ClassVar[str] = ""
    orders: ClassVar[Orders] = MappingProxyType({})

    def __post_init__(self) -> None:
        """Check the settings, and that there is an environment."""
        settings = self._settings()
        if self.orders:
            first = next(iter(settings))
            choice(first, settings[first], tuple(self.orders))
        if "precision" in settings:
            choice("precision", self.precision, ("f64", "f32"))
        as_installed = settings.get("as_installed", False)
        if not isinstance(as_installed, bool):
            raise BadInput("as_installed", repr(as_installed), "True or False")
        self.environment  # noqa: B018 - for its exception

    @classmethod
    def at_version(cls, version: str) -> type[EngineMethod]:
        """Return the class of a version, whose family is `exudyn@1.13.6`."""
        return _class_at(cls, version)

    @property
    def environment(self) -> Environment:
        """Where it runs. Raises `MissingEnvironment` where that is not installed."""
        return find_environment(self.engine, self.version)

    @property
    def engine(self) -> str:
        """The engine's name, without a version."""
        return self.family.partition("@")[0]

    @property
    def maker(self) -> Maker:
        return Maker(self.engine, self.environment.version)

    @property
    def setting_parts(self) -> dict[str, str]:
        """The first setting, those that are not defaults, and last a precision other than double."""
        settings, parts = self._settings(), dict[str, str]()
        for number, field in enumerate(fields(self)):  # type: ignore[arg-type]  # subclasses are dataclasses
            name, value = field.name, settings[field.name]
            if name == "as_installed":
                parts |= {name: "as installed"} if value else {}
            elif number == 0:
                parts[name] = str(value)
            elif name != "precision" and value != field.default:
                parts[name] = f"{name}={value:g}" if isinstance(value, float) else f"{name}={value}"
        return parts if self.precision == "f64" else parts | {"precision": self.precision}

    @property
    def variables(self) -> Mapping[str, str]:
        """Variables of the process that it runs in; runs with other ones have another process."""
        return {}

    @property
    def order(self) -> int | None:
        """Order of convergence in dt: that of the first setting, or 1."""
        return self.orders[next(iter(self._settings().values()))] if self.orders else 1

    def unsupported(self, scene: Scene) -> str | None:
        if self.takes_gravity:
            return gravity_or_free(scene) or mass_model_reason(scene)
        if scene.potential is not None:
            return self.free_only or f"its adapter has free bodies, not {type(scene.potential).__name__}"
        return mass_model_reason(scene)

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        """Have the worker prepare the run. Raises `Unsupported` where this version does not have what is asked for."""
        axes = principal_axes(scene)
        samples = Samples(axes, grid, self.label)
        run = WorkerRun(worker_of(self.environment, self.variables), self._given(describe(axes, grid)), samples)
        try:
            run.prepare()
        except NotImplementedError as error:
            raise Unsupported("method", self.name, f"what {self.label} supports ({error})") from None
        except IntegrationFailed as failure:
            return partial(samples.failure, failure)
        return run

    def prepare_many(self, bodies: Batch, grid: Grid) -> RunMany | None:
        """Have the worker prepare the run of many bodies; None where the adapter has none, or not for these bodies."""
        axes = take_axes(bodies, grid, self.unsupported) if self in self.settings_for("many") else None
        if axes is None:
            return None
        given = self._given(describe_many(axes, grid))
        run = WorkerRun(worker_of(self.environment, self.variables), given, ManySamples(axes, grid))
        run.prepare()
        return run

    def _given(self, numbers: Mapping[str, Any]) -> dict[str, Any]:
        return {"adapter": str(_inside(type(self))), "settings": self._settings(), **numbers}

    def _settings(self) -> dict[str, Any]:
        value: Any = self
        return {field.name: getattr(self, field.name) for field in fields(value)}

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[str]]:
        return registry.method, (self.name,)


@lru_cache(maxsize=256)
def _class_at(cls: type[EngineMethod], version: str) -> type[EngineMethod]:
    if cls.version:
        return _class_at(cls.__mro__[1], version)
    names = {"version": version, "family": f"{cls.family}@{version}", "__module__": cls.__module__, "__doc__": cls.__doc__}
    return type(cls.__name__, (cls,), names)


@lru_cache(maxsize=64)
def _inside(cls: type[EngineMethod]) -> Path:
    return Path(inspect.getfile(cls)).resolve().parent / "inside" / f"{cls.family.partition('@')[0]}.py"


def jax_variables(precision: str) -> dict[str, str]:
    """Return the variables of a process in which JAX computes on the CPU, with numbers of a precision, "f64" or "f32"."""
    return {"JAX_PLATFORMS": "cpu", "JAX_ENABLE_X64": str(int(precision == "f64"))}


def rate_limit_reason(scene: Scene, limit: float) -> str | None:
    """Return why an engine that limits rates, rad/s, cannot do a scene, None if it can; it names a slower one, where one is."""
    rate = float(np.linalg.norm(scene.w_WB_B0))
    if rate <= limit:
        return None
    slower = f"{scene.name}:slow=4"
    try:
        registry.scene(slower)
    except BadInput:  # not a registered scene, or one without that parameter
        advice = ""
    else:
        advice = f"; {slower} is a slower one"
    return f"as installed it limits rates to {limit:g} rad/s, and the scene starts with {rate:.3g} rad/s{advice}"


Found = TypeVar("Found", covariant=True)


class Reads(Protocol[Found]):
    """Makes of what an engine hands over what a run gives."""

    def trajectory(self, found: Mapping[str, Any]) -> Found:
        """Return the samples."""

    def failure(self, failure: IntegrationFailed) -> Found:
        """Return what there is of a run whose engine did not answer."""


class WorkerRun(Generic[Found]):
    """A run in a worker. Calling it gives the samples; `wall_time` times calls without the way to the worker."""

    def __init__(self, worker: Worker, given: Mapping[str, Any], samples: Reads[Found]) -> None:
        self._worker, self._given, self._samples = worker, given, samples
        self._number, self._start = 0, 0
        self._found: Mapping[str, Any] = {}

    def __call__(self) -> Found:
        try:
            self._found = self._ask("run")
            return self._samples.trajectory(self._found)
        except IntegrationFailed as failure:
            return self._samples.failure(failure)

    def wall_time(self, calls: int) -> float:
        """Return the wall time of so many calls, s: of the engine, in a loop in its process, and of making trajectories here.

        Raises
        ------
        EngineCrashed, EngineTimeout
            The engine did not survive, or did not answer in time.
        """
        found = self._found or self._ask("run")
        inside = float(self._ask("time", calls=calls)["seconds"])
        start = perf_counter_ns()
        for _ in range(calls):
            self._samples.trajectory(found)
        return inside + (perf_counter_ns() - start) * 1e-9

    def prepare(self) -> None:
        """Have the worker prepare the run, once in its life.

        Raises
        ------
        EngineCrashed, EngineTimeout
            The engine did not survive, or did not answer in time.
        NotImplementedError
            The engine does not have what is asked for.
        """
        if self._start == 0 or self._start != self._worker.starts or self._worker.pid is None:
            self._number = self._worker.ask("prepare", **self._given)["run"]
            self._start = self._worker.starts
            weakref.finalize(self, self._worker.forget, self._start, self._number).atexit = False

    def _ask(self, do: str, **values: Any) -> dict[str, Any]:
        self.prepare()
        return self._worker.ask(do, run=self._number, **values)
