"""Declaration of a family of methods: its settings for tables and benchmarks, its place in the automatic choice, its colour.

Settings are texts as in the name of a method, such as "RK4" or "order=4,tol=1e-9", and "" for the defaults.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from enum import StrEnum
from functools import lru_cache
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, TypeVar

from .check import describe, real_number, set_fields
from .errors import BadInput, nearest
from .features import FIELDS, Features, read_features
from .version import VERSION

T = TypeVar("T")
Purpose = Literal["variants", "report", "suite", "many", "pictures", "candidates", "as_installed", "fastest"]
"""Purpose of a selection of settings; see `MethodInfo`."""


class Role(StrEnum):
    """Role of a method in comparisons."""

    OURS = "ours"
    """Compared with the engines in verdicts; its time is gated."""
    BASELINE = "baseline"
    """A textbook method: in tables and pictures, without speed ratios, never chosen automatically."""
    ENGINE = "engine"
    """Other people's code."""
    TRUTH = "truth"
    """A reference solution, which does not compete."""


@dataclass(frozen=True)
class Cost:
    """Cost of a method's work, ns. The automatic choice uses only ratios of costs.

    Attributes
    ----------
    step
        Cost of a step without its corrections.
    correction
        Cost of one correction of the nonlinear solver.
    corrections
        Smallest number of corrections that a step takes.
    """

    step: float
    correction: float = 0.0
    corrections: float = 1.0

    @property
    def least(self) -> float:
        """Smallest cost of a step, ns."""
        return self.step + self.correction * self.corrections


class Structure(NamedTuple):
    """Geometric properties of a step in a field that does not depend on time. `test_structure.py` measures the first two."""

    symmetric: bool
    """True if a step of -dt from the end of a step returns to its start."""
    symplectic: bool
    """True if the map of (Q, L) is symplectic on T*SO(3). Its reduction to L, or to L and the field's axis, is then Poisson."""
    imposed: bool = False
    """True if a projection after each step restores the invariants in `Method.conserves`; False if its equations do."""


@dataclass(frozen=True)
class MethodInfo:
    """Declaration of a family of methods for reports, the benchmark suite and the automatic choice.

    Every field has a default. A selection of settings that is None is the same as `variants`.

    Attributes
    ----------
    variants
        Settings that tables and generic tests include.
    report
        Settings in a report by default.
    suite
        Settings timed by the benchmark suite.
    fastest
        Settings that may be the fastest at some error, for the study of random bodies.
    many
        Settings for which `Method.prepare_many` runs many bodies at once, the representative one first.
    pictures
        Settings whose motion a report draws; if there are none, it draws the first that it measured.
    as_installed
        The engine as installed, with nothing set but the step; () if its user has to choose a setting.
    usual_dt
        The engine's own default step, s, which its users take; None for an engine without a default.
    rank
        Rank in the automatic choice, `integrate(scene, error=...)`; the lowest comes first. None: the family is not considered.
    group
        Only the first family of a group that supports the scene is tried; "" for a family outside all groups.
    exact
        True if there is no truncation error. The first such family that supports the scene is chosen without comparison.
    candidates
        Settings that the automatic choice tries.
    longest
        Longest step that the automatic choice tries, in radians of the fastest possible rotation.
    cost
        Returns the cost of a setting's work. Default: an explicit step of order 8.
    colour
        A name in `conservative.reports.charts.style.PALETTE`, or a colour such as "#0072B2"; None for any free colour.
    kernel
        Module in `conservative.kernels` whose function `enter` makes all steps of a run; "" if there is none.
    structure
        Returns the `Structure` of a setting; None if it is unknown.
    supports
        The features of scenes that the method supports (`conservative.features`); default: fields that depend on the attitude
        only. If a scene has others, `Method.unsupported` says so. Methods of the rotation alone also take free flight.
    removed
        Names of settings of earlier versions, with the text of the error message: what to use instead.
    """

    variants: tuple[str, ...] = ("",)
    report: tuple[str, ...] | None = None
    suite: tuple[str, ...] | None = None
    fastest: tuple[str, ...] | None = None
    many: tuple[str, ...] = ()
    pictures: tuple[str, ...] = ()
    as_installed: tuple[str, ...] = ()
    usual_dt: float | None = None
    rank: int | None = None
    group: str = ""
    exact: bool = False
    candidates: tuple[str, ...] | None = None
    longest: float = math.inf
    cost: Callable[[Any], Cost] = lambda method: Cost(step=340.0)
    colour: str | None = None
    kernel: str = ""
    structure: Callable[[Any], Structure | None] = lambda method: None
    supports: Features = FIELDS
    removed: Mapping[str, str] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        set_fields(self, supports=read_features("supports", self.supports))

    def settings(self, purpose: Purpose) -> tuple[str, ...]:
        """Return the settings for a purpose, with the defaults filled in."""
        selected: tuple[str, ...] | None = getattr(self, purpose)
        return self.variants if selected is None else selected


class Maker(NamedTuple):
    """The package that does the computing, and its version; empty if the package is not installed."""

    package: str
    version: str = ""

    def __str__(self) -> str:
        return f"{self.package}=={self.version}" if self.version else self.package


@lru_cache(maxsize=256)
def maker_of(kind: type) -> Maker:
    """Return the package of a class."""
    package = kind.__module__.partition(".")[0]
    if package == __package__:
        return Maker(package, VERSION)
    from importlib import metadata

    try:
        return Maker(package, metadata.version(package))
    except metadata.PackageNotFoundError:
        return Maker(package)


def setting_texts(value: Any) -> dict[str, str]:
    """Return the texts of the settings of a frozen value that differ from their defaults, such as `tol=1e-09`, by name."""
    settings = (
        (field.name, getattr(value, field.name), field.default) for field in (fields(value) if is_dataclass(value) else ())
    )
    return {name: f"{name}={setting}" for name, setting, default in settings if setting != default}


@lru_cache(maxsize=1024)
def settings_text(value: Any) -> str:
    """Return the settings of a frozen value that differ from their defaults: `tol=1e-09,frame=body`."""
    return ",".join(setting_texts(value).values())


def call_with_settings(
    target: Callable[..., T], argument: str, text: str, removed: Mapping[str, str] = MappingProxyType({})
) -> T:
    """Return the result of a function or class for settings such as "RK4,threads=2".

    Items without a key are assigned to the parameters in their order. `argument` is the name of the target in messages, and
    `removed` has what to do instead of settings of earlier versions. Raise `BadInput` if a setting is unknown or has a wrong
    value.
    """
    settings = [item.strip() for item in text.split(",") if item.strip()]
    defaults, arguments = _defaults(target), {}
    names = list(defaults)
    for position, item in enumerate(settings):
        name, equals, setting = item.partition("=")
        if not equals:
            name, setting = names[position] if position < len(names) else item, item
        if name in removed:
            raise BadInput(argument, describe(item), removed[name])
        if name not in defaults:
            raise BadInput(argument, describe(item), f"settings {nearest(name, names)}" if names else "no settings")
        value, default = _read_value(setting), defaults[name]
        if isinstance(default, bool):
            if not isinstance(value, bool):
                raise BadInput(argument, describe(item), f"{name}=true or {name}=false")
        elif isinstance(default, int | float) and real_number(value) is None:
            raise BadInput(argument, describe(item), f"{name}=a number, such as {default!r}, its default")
        arguments[name] = value
    try:
        return target(**arguments)
    except BadInput:
        raise
    except (ArithmeticError, TypeError, ValueError) as error:
        raise BadInput(argument, describe(",".join(settings)), f"settings that it accepts ({error})") from error


@lru_cache(maxsize=256)
def _defaults(target: Callable[..., object]) -> dict[str, Any]:
    """Return the defaults of the parameters by name. Reading a signature takes longer than everything else here."""
    return {name: parameter.default for name, parameter in inspect.signature(target).parameters.items()}


def _read_value(text: str) -> object:
    for convert in (int, float):
        try:
            return convert(text)
        except ValueError:
            continue
    return {"true": True, "false": False, "none": None}.get(text.lower(), text)
