"""Scenes and methods of a study, by name or all registered ones."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar, NoReturn

from conservative import registry
from conservative.errors import MissingEngine, NotLoadable
from conservative.grid import Grid
from conservative.method import Method, Role
from conservative.scene import Scene

DEFAULT_SCENES = ("brick_flip", "lagrange_top")
TOLERANCES = ("tol", "rtol", "tolerance", "accuracy")
"""Settings that control the accuracy of adaptive methods instead of dt."""

Settings = Callable[[Method], tuple[Method, ...]]
"""Returns the settings of a method's family that its bare name stands for."""


def in_tables(method: Method) -> tuple[Method, ...]:
    """Return all settings that tables include."""
    return method.settings_in_tables()


@dataclass(frozen=True)
class StandIn(Method):
    """A method that is not in this process, under the name, label and order that it has elsewhere."""

    given_name: str
    given_label: str = ""
    given_order: int | None = None

    @property
    def name(self) -> str:
        return self.given_name

    @property
    def label(self) -> str:
        return self.given_label or self.given_name

    @property
    def order(self) -> int | None:
        return self.given_order


@dataclass(frozen=True)
class Missing(StandIn):
    """A method whose engine is not installed, under the name that the user wrote. Every run raises `error`."""

    error: MissingEngine = field(compare=False, kw_only=True)

    family: ClassVar[str] = "missing"
    role: ClassVar[Role] = Role.ENGINE

    def prepare(self, scene: Scene, grid: Grid) -> NoReturn:
        raise self.error


def scenes(names: Iterable[str] = DEFAULT_SCENES) -> tuple[Scene, ...]:
    """Return scenes by name, with parameters if a name has them. Raises as `registry.scene`."""
    return tuple(registry.scene(name) for name in names)


def methods(
    names: Iterable[str] | None = None, skip_missing: bool = False, settings: Settings = in_tables
) -> tuple[Method, ...]:
    """Return methods by name, ours first.

    Parameters
    ----------
    names
        Names, by default of every registered family.
    skip_missing
        Return a `Missing` method for each name whose engine is not installed, instead of an error.
    settings
        Returns the settings that a family's bare name, such as `mujoco`, stands for.

    Raises
    ------
    BadInput
        A name or a setting is unknown, or a value cannot be used.
    MissingEngine
        An engine is not installed, and `skip_missing` is False.
    """
    selected: dict[Method, None] = {}
    for text in registry.list_methods() if names is None else names:
        name = registry.read_name(text, "methods")
        try:
            method = registry.method(text)
            selected.update(dict.fromkeys(settings(method) if name.settings is None else (method,)))
        except (MissingEngine, NotLoadable) as error:  # the second is a broken entry point of another package
            if not skip_missing:
                raise
            missing = error if isinstance(error, MissingEngine) else MissingEngine(name.base, error.place)
            selected[Missing(str(name), error=missing)] = None
    return tuple(sorted(selected, key=lambda method: list(Role).index(Role(method.role))))


def main_methods(skip_missing: bool = False) -> tuple[Method, ...]:
    """Return the methods that a report includes by default: `MethodInfo.report` of all families. Raises as `methods`."""
    families = registry.list_families()
    names = []
    for name in registry.list_methods():
        settings = families[name].method_info.settings("report") if name in families else ("",)
        names += [f"{name}:{setting}" if setting else name for setting in settings]
    return methods(names, skip_missing, lambda method: (method,))


def bits_of(method: Method) -> int:
    """Return the bits of the numbers of a method: 64 for double precision, 32 for single."""
    return 32 if getattr(method, "precision", "f64") == "f32" else 64


def tolerance_setting(method: Method) -> str | None:
    """Return the name of the setting that determines the accuracy of an adaptive method, or None."""
    if method.order is not None:
        return None
    return next((field.name for field in fields(method) if field.name in TOLERANCES), None)


def takes_exact_steps(method: Method) -> bool:
    """Return whether steps have no truncation error, so that accuracy depends on neither a step nor a tolerance."""
    return method.order is None and tolerance_setting(method) is None


def at_tolerance(method: Method, setting: str, tolerance: float | None) -> Method:
    """Return the method with another tolerance."""
    return replace(method, **{setting: tolerance})


def series(method: Method) -> str:
    """Return the name of a line in a chart: the name of the method without its tolerance.

    Without a tolerance, `Taylor` and some engines make the steps of the grid, so the adaptive line is `taylor:tolerance`.
    """
    setting = tolerance_setting(method)
    if setting is None:
        return method.name
    without = at_tolerance(method, setting, _default(method, setting))
    return without.name if tolerance_setting(without) else f"{without.family}:{series_setting(method)}"


def series_setting(method: Method) -> str:
    """Return the setting of a line in tables: the setting of the method without its tolerance (see `series`)."""
    setting = tolerance_setting(method)
    text = method.setting(without=setting)
    if setting is None or tolerance_setting(at_tolerance(method, setting, _default(method, setting))):
        return text
    return ",".join(filter(None, (text, setting)))


def _default(method: Method, setting: str) -> Any:
    return next(field.default for field in fields(method) if field.name == setting)
