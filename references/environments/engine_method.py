"""Methods whose engine runs in an environment, made from the data in the file of the engine."""

from __future__ import annotations

import math
import weakref
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, make_dataclass
from functools import cache, lru_cache, partial
from pathlib import Path
from time import perf_counter_ns
from types import ModuleType
from typing import Any, ClassVar, Generic, Protocol, TypeVar

import numpy as np

from conservative import registry
from conservative.batch import Batch
from conservative.card import Card, Maker
from conservative.check import choice, finite_number, positive_integer
from conservative.errors import BadInput, IntegrationFailed, Unsupported
from conservative.grid import Grid
from conservative.method import Method, Role, Run
from conservative.methods.many import RunMany
from conservative.scene import Scene

from ..engine import principal_axes, unsupported_reason
from ..worker.client import Worker
from .environment import Distribution, Environment, find_environment, worker_of
from .plain_numbers import EngineSamples, ManySamples, describe, describe_many, take_axes


@dataclass(frozen=True)
class EngineData:
    """The data in the file of an engine, `ENGINE`.

    The file is imported here for this data, and runs in the environment for its function `prepare` (see
    `conservative.references.worker.program`). It must therefore not import this package.

    Attributes
    ----------
    package, module, requirements, oldest
        As in `Distribution`: what to install, what to import.
    settings
        Settings and their defaults. "precision" and "as_installed" have the same meaning for all engines: number format
        ("f64" or "f32"), and whether everything that is usually switched off stays on.
    orders
        Values of the first setting and their orders of convergence, None for adaptive steps; empty if it is not a choice.
    order
        Order of convergence if `orders` is empty.
    choices
        Allowed values of other settings.
    tolerance
        Name of the setting that is a tolerance for adaptive steps. If its default is 0, that value stands for fixed steps.
    precision
        "f64" or "f32", for engines without such a setting.
    gravity
        Whether bodies about a fixed point in uniform gravity are supported, not only free bodies.
    free_only
        The reason why only free bodies are supported, if the reason is in the engine; by values of the first setting if it
        depends on that.
    rate_limit
        Largest angular velocity, rad/s, as installed.
    title
        First word of labels, for engines without a choice.
    card
        The engine's `conservative.card.Card`, as a dictionary.
    name
        Name of the engine, by default that of its file.
    """

    package: str
    module: str
    requirements: tuple[str, ...] = ()
    oldest: str = ""
    settings: Mapping[str, Any] = field(default_factory=dict)
    orders: Mapping[str, int | None] = field(default_factory=dict)
    order: int | None = 1
    choices: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    tolerance: str = ""
    precision: str = "f64"
    gravity: bool = False
    free_only: str | Mapping[str, str] = ""
    rate_limit: float = math.inf
    title: str = ""
    card: Mapping[str, Any] = field(default_factory=dict)
    name: str = ""


@cache
def engine_class(module: ModuleType) -> type[EngineMethod]:
    """Return the class of the engine in a module that contains `ENGINE` (see `EngineData`) and a function `prepare`."""
    data, path = EngineData(**module.ENGINE), Path(str(module.__file__)).resolve()
    described: dict[str, Any] = {
        "family": data.name or path.stem,
        "data": data,
        "distribution": Distribution(data.package, data.module, data.requirements, data.oldest),
        "adapter": path,
        "card": Card(**data.card),
        "__module__": module.__name__,
        "__doc__": module.__doc__,
    }
    if "precision" not in data.settings:
        described["precision"] = data.precision
    settings = [(name, type(default), field(default=default)) for name, default in data.settings.items()]
    made = make_dataclass(described["family"].capitalize(), settings, bases=(EngineMethod,), namespace=described, frozen=True)
    return made


@lru_cache(maxsize=256)
def _class_at(cls: type[EngineMethod], version: str) -> type[EngineMethod]:
    if cls.version:
        return _class_at(cls.__mro__[1], version)
    names = {"version": version, "family": f"{cls.family}@{version}", "__module__": cls.__module__, "__doc__": cls.__doc__}
    return type(cls.__name__, (cls,), names)


class EngineMethod(Method):
    """An engine in an environment of its own. `engine_class` creates the subclasses: frozen dataclasses of the settings.

    Attributes
    ----------
    data
        The data in the file of the engine.
    distribution
        The package to install.
    adapter
        The file of the engine, which also runs in the environment.
    version
        Version of the engine; empty for the newest installed one. `at_version` returns the class of another version.

    Raises
    ------
    BadInput
        A setting is unknown or out of range.
    MissingEngine
        The engine is not installed: no environment has it.
    """

    role: ClassVar[Role] = Role.ENGINE
    data: ClassVar[EngineData]
    distribution: ClassVar[Distribution]
    adapter: ClassVar[Path]
    version: ClassVar[str] = ""
    precision: str

    def __post_init__(self) -> None:
        """Check the settings, and that there is an environment."""
        choices = {"precision": ("f64", "f32"), **self.data.choices}
        for position, (name, value) in enumerate(self.settings.items()):
            default = self.data.settings[name]
            if name in choices or (position == 0 and self.data.orders):
                choice(name, value, choices.get(name) or tuple(self.data.orders))
            elif isinstance(default, bool) and not isinstance(value, bool):
                raise BadInput(name, repr(value), "True or False")
            elif type(default) is int:
                positive_integer(name, value)
            elif isinstance(default, float):
                allowed = "a number above 0 and below 1" if default else "a number from 0 (fixed steps) to 1"
                number = finite_number(name, value, allowed)
                if not (0 < number < 1 if default else 0 <= number <= 1):
                    raise BadInput(name, repr(value), allowed)
        self.environment  # noqa: B018 - for its exception

    @classmethod
    def at_version(cls, version: str) -> type[EngineMethod]:
        """Return the class of a version, whose family is `exudyn@1.13.6`."""
        return _class_at(cls, version)

    @property
    def settings(self) -> dict[str, Any]:
        """The settings and their values."""
        value: Any = self
        return {each.name: getattr(self, each.name) for each in fields(value)}

    @property
    def environment(self) -> Environment:
        """The environment. Raises `MissingEnvironment` if it is not installed."""
        return find_environment(self.engine, self.version)

    @property
    def engine(self) -> str:
        """Name of the engine, without a version."""
        return self.family.partition("@")[0]

    @property
    def maker(self) -> Maker:
        return Maker(self.engine, self.environment.version)

    @property
    def setting_parts(self) -> dict[str, str]:
        """The first setting, those that are not defaults, the tolerance of adaptive steps, and single precision."""
        parts = {"title": self.data.title} if self.data.title else {}
        for position, (name, value) in enumerate(self.settings.items()):
            text = f"{name}={value:g}" if isinstance(value, float) else f"{name}={value}"
            if name == "as_installed":
                parts |= {name: "as installed"} if value else {}
            elif position == 0:
                parts[name] = value if isinstance(value, str) else text
            elif name != "precision" and (
                value != self.data.settings[name] or (name == self.data.tolerance and value and self.order is None)
            ):
                parts[name] = text
        return parts if self.precision == "f64" else parts | {"precision": self.precision}

    @property
    def order(self) -> int | None:
        """Order of convergence in dt; None for adaptive steps."""
        settings, tolerance = self.settings, self.data.tolerance
        if tolerance and not self.data.settings[tolerance] and settings[tolerance]:
            return None
        return self.data.orders[next(iter(settings.values()))] if self.data.orders else self.data.order

    def unsupported(self, scene: Scene) -> str | None:
        reason = unsupported_reason(scene)
        if scene.potential is not None:
            only = self.data.free_only
            if not isinstance(only, str):
                only = only.get(next(iter(self.settings.values())), "")
            if not self.data.gravity:
                reason = only or f"its adapter has free bodies, not {type(scene.potential).__name__}"
            elif reason is None and only:
                reason = only
        if reason is None and self.settings.get("as_installed"):
            return rate_limit_reason(scene, self.data.rate_limit)
        return reason

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        """Prepare the run in the worker. Raise `Unsupported` if this version does not support it."""
        axes = principal_axes(scene)
        samples = EngineSamples(axes, grid, self.label)
        run = self._run(describe(axes, grid), samples)
        try:
            run.prepare()
        except NotImplementedError as error:
            raise Unsupported("method", self.name, f"what {self.label} supports ({error})") from None
        except IntegrationFailed as failure:
            return partial(samples.failure, failure)
        return run

    def prepare_many(self, bodies: Batch, grid: Grid) -> RunMany | None:
        """Prepare the run of many bodies in the worker; return None if the engine does not support it for these bodies."""
        axes = take_axes(bodies, grid, self.unsupported) if self in self.settings_for("many") else None
        if axes is None:
            return None
        run = self._run(describe_many(axes, grid), ManySamples(axes, grid))
        run.prepare()
        return run

    def _run(self, numbers: Mapping[str, Any], samples: Reads[Result]) -> WorkerRun[Result]:
        worker = worker_of(self.environment, self.precision)
        return WorkerRun(worker, {"adapter": str(self.adapter), "settings": self.settings, **numbers}, samples)

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[str]]:
        return registry.method, (self.name,)


def rate_limit_reason(scene: Scene, limit: float) -> str | None:
    """Return why an engine that limits rates, rad/s, does not support a scene. Name a slower scene if there is one."""
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


Result = TypeVar("Result", covariant=True)


class Reads(Protocol[Result]):
    """Converts the answer of an engine into the result of a run."""

    def trajectory(self, answer: Mapping[str, Any]) -> Result:
        """Return the samples."""

    def failure(self, failure: IntegrationFailed) -> Result:
        """Return the result of a run whose engine failed."""


class WorkerRun(Generic[Result]):
    """A run in a worker. `wall_time` excludes the communication with the worker."""

    def __init__(self, worker: Worker, given: Mapping[str, Any], samples: Reads[Result]) -> None:
        self._worker, self._given, self._samples = worker, given, samples
        self._number, self._start = 0, 0
        self._answer: Mapping[str, Any] = {}

    def __call__(self) -> Result:
        try:
            self._answer = self._ask("run")
            return self._samples.trajectory(self._answer)
        except IntegrationFailed as failure:
            return self._samples.failure(failure)

    def wall_time(self, calls: int) -> float:
        """Return the wall time of calls in seconds: in the engine, and for the conversion to trajectories here.

        Raises
        ------
        EngineCrashed, EngineTimeout
            The engine failed.
        """
        answer = self._answer or self._ask("run")
        inside = float(self._ask("time", calls=calls)["seconds"])
        start = perf_counter_ns()
        for _ in range(calls):
            self._samples.trajectory(answer)
        return inside + (perf_counter_ns() - start) * 1e-9

    def prepare(self) -> None:
        """Prepare the run in the worker, again if its process has ended.

        Raises
        ------
        EngineCrashed, EngineTimeout
            The engine failed.
        NotImplementedError
            The engine does not support the run.
        """
        if self._start == 0 or self._start != self._worker.starts or self._worker.pid is None:
            self._number = self._worker.ask("prepare", **self._given)["run"]
            self._start = self._worker.starts
            weakref.finalize(self, self._worker.forget, self._start, self._number).atexit = False

    def _ask(self, do: str, **values: Any) -> dict[str, Any]:
        self.prepare()
        return self._worker.ask(do, run=self._number, **values)
