"""Methods made from the adapters of engines: their settings, which are data, and the engines that run in this process."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, make_dataclass
from functools import cache
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from conservative import registry
from conservative.batch import Batch
from conservative.check import choice, finite_number, positive_integer
from conservative.errors import BadInput, Unsupported
from conservative.features import Feature
from conservative.grid import Grid
from conservative.method import Method, Role, Run
from conservative.method_info import Maker, MethodInfo
from conservative.methods.many import RunMany
from conservative.methods.units import in_own_units
from conservative.potentials.turning import Turning, static_part
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene

from ..engine import EngineRun, load, principal_axes, unsupported_reason, version
from .environment import KINDS
from .kind import Distribution
from .plain_numbers import FEATURES, FIELDS, describe, read_many, read_one, take_axes


@dataclass(frozen=True)
class EngineData(Distribution):
    """The data in the file of an engine, `ENGINE`: its package (see `Distribution`) and its settings.

    The file is imported here for this data, and runs in the environment for its function `prepare` (see
    `conservative.references.worker.program`). It must therefore not import this package.

    Attributes
    ----------
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
    fields
        Names of the potentials that are supported, on bodies about a fixed point; `"Turning"` for the ones that turn.
    free_only
        The reason why only free bodies are supported, if the reason is in the engine; by values of the first setting if it
        depends on that.
    formats
        Formats of model files that its program loads: "urdf", "mjcf", "sdf" or "usd" (see `load` in PROTOCOL.md).
    descriptions
        Further descriptions of a body that `prepare` understands, beside the usual one: its number `description` is one of
        them. PROTOCOL.md lists them. Loops that are timed contain no code for them.
    rate_limit
        Largest angular velocity, rad/s, as installed.
    title
        First word of labels, for engines without a choice.
    prefix
        Text before the first setting in labels.
    method_info
        The engine's `conservative.MethodInfo`, as a dictionary; "flight" and "rotors" instead of `supports`: True if it
        integrates the translation in free flight, and bodies with a rotor.
    """

    settings: Mapping[str, Any] = field(default_factory=dict)
    orders: Mapping[str, int | None] = field(default_factory=dict)
    order: int | None = 1
    choices: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    tolerance: str = ""
    precision: str = "f64"
    fields: tuple[str, ...] = ()
    free_only: str | Mapping[str, str] = ""
    formats: tuple[str, ...] = ()
    descriptions: tuple[str, ...] = ()
    rate_limit: float = math.inf
    title: str = ""
    prefix: str = ""
    method_info: Mapping[str, Any] = field(default_factory=dict)


SCRIPTS = {kind.suffix: kind.name for kind in KINDS.values() if kind.suffix != ".py"}
"""Suffixes of adapters that are not in Python, and the kinds of their environments."""


@cache
def read_script(path: Path) -> ModuleType:
    """Return a module with the first comment and `ENGINE`, JSON, of an adapter in another language, and what most share."""
    comment, _, code = path.read_text(encoding="utf-8").partition("ENGINE = ")
    data, _ = json.JSONDecoder().raw_decode(code.replace("\n *", "\n"))
    common = {"kind": SCRIPTS[path.suffix], "module": data["package"], "settings": {"as_installed": False}, "precision": "f32"}
    method_info = {"variants": ("", "as_installed=true"), "as_installed": ("as_installed=true",)}
    module = ModuleType(f"{__package__}.{path.stem}", comment[3:].partition("*/")[0].replace("\n *", "\n"))
    vars(module).update(__file__=str(path), ENGINE=common | {"fields": ("UniformGravity",), "method_info": method_info} | data)
    return module


AnyAdapted = TypeVar("AnyAdapted", bound="AdapterMethod")


@cache
def method_class(module: ModuleType, base: type[AnyAdapted]) -> type[AnyAdapted]:
    """Return the class of the engine in a module that contains `ENGINE` (see `EngineData`) and a function `prepare`."""
    family = module.__name__.rpartition(".")[2]
    settings = [(name, type(default), default) for name, default in module.ENGINE.get("settings", {}).items()]
    described = {"adapter": module, "__module__": module.__name__, "__doc__": module.__doc__}
    return make_dataclass(family.capitalize(), settings, bases=(base,), namespace=described, frozen=True)


class AdapterMethod(Method):
    """An engine with an adapter. Subclasses are frozen dataclasses of the settings; the rest is read from `adapter`.

    Attributes
    ----------
    adapter
        The file of the engine, as a module. Its name is the family.
    data
        The data in that file.

    Raises
    ------
    BadInput
        A setting is unknown or out of range.
    MissingEngine
        The engine is not installed.
    """

    role: ClassVar[Role] = Role.ENGINE
    adapter: ClassVar[ModuleType]
    data: ClassVar[EngineData]
    precision: str
    if TYPE_CHECKING:
        # The constructor of the classes that `method_class` returns.
        def __init__(self, *settings: Any, **named: Any) -> None: ...

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "adapter" not in vars(cls):
            return
        if "card" in cls.adapter.ENGINE:
            raise TypeError(f"ENGINE of {cls.adapter.__file__} has the former name `card`. Write: method_info")
        cls.family, cls.data = cls.adapter.__name__.rpartition(".")[2], EngineData(**cls.adapter.ENGINE)
        method_info, flags = cls.data.method_info, {"flight": Feature.FLIGHT, "rotors": Feature.ROTOR}
        supports = {feature for kind in FIELDS if kind.__name__ in cls.data.fields for feature in FEATURES[kind]}
        supports |= {feature for word, feature in flags.items() if method_info.get(word)}
        cls.method_info = MethodInfo(
            **{name: value for name, value in method_info.items() if name not in flags}, supports=frozenset(supports)
        )
        if "precision" not in cls.data.settings:
            cls.precision = cls.data.precision

    def __post_init__(self) -> None:
        """Check the settings, and that the engine is installed."""
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
        self.maker  # noqa: B018 - for its exception

    @property
    def settings(self) -> dict[str, Any]:
        """The settings and their values."""
        value: Any = self
        return {field.name: getattr(self, field.name) for field in fields(value)}

    @property
    def setting_parts(self) -> dict[str, str]:
        """The first setting, those that are not defaults, the tolerance of adaptive steps, and single precision."""
        parts = {"title": self.data.title} if self.data.title else {}
        for position, (name, value) in enumerate(self.settings.items()):
            text = f"{name}={value:g}" if isinstance(value, float) else f"{name}={value}"
            if name == "as_installed":
                parts |= {name: "as installed"} if value else {}
            elif position == 0:
                parts[name] = self.data.prefix + value if isinstance(value, str) else text
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

    @property
    def lacks(self) -> str:
        only = self.data.free_only
        return only if isinstance(only, str) else only.get(next(iter(self.settings.values())), "")

    def unsupported(self, scene: Scene) -> str | None:
        reason, potential = unsupported_reason(scene), scene.potential
        if potential is not None:
            kinds = list(dict.fromkeys([type(potential), type(static_part(potential))]))
            if self.lacks:
                reason = self.lacks
            elif kinds == [Turning, UniformGravity] or not {*kinds} <= {*FIELDS}:
                reason = f"not supported by our adapter: {' of '.join(kind.__name__ for kind in kinds)}"
        if reason is None and self.settings.get("as_installed"):
            return rate_limit_reason(scene, self.data.rate_limit)
        return reason

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


class LocalEngine(AdapterMethod):
    """An engine in this process."""

    @property
    def maker(self) -> Maker:
        return Maker(self.data.package, version(self.data.package, self.family))

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        """Prepare the run. Raise `Unsupported` if this version does not support it."""
        axes = principal_axes(scene)
        try:
            run = self._load().prepare(SimpleNamespace(**self.settings, **describe(axes, grid)))
        except NotImplementedError as error:
            raise Unsupported("method", self.name, f"what {self.label} supports ({error})") from None
        return EngineRun(run, read_one(axes, grid, self.label), bind=lambda: getattr(run, "loop", run))

    def prepare_many(self, bodies: Batch, grid: Grid) -> RunMany | None:
        """Prepare the run of many bodies; return None if the engine does not support it for these bodies."""
        axes = take_axes(bodies, grid, self.unsupported)
        if axes is None:
            return None
        read = read_many(axes, grid)
        try:
            run = self._load().prepare_many([SimpleNamespace(**self.settings, **describe(axis, grid)) for axis in axes])
        except NotImplementedError:
            return None
        return lambda: read(run())

    def _load(self) -> Any:
        load(self.data.module, self.data.package, self.family)
        return self.adapter
