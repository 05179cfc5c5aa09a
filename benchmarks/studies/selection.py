"""Scenes and methods of a study, by name or all registered ones."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, NoReturn

from conservative import registry
from conservative.errors import MissingEngine, NotLoadable
from conservative.grid import Grid
from conservative.method import Method, Role
from conservative.scene import Scene

DEFAULT_SCENES = ("brick_flip", "lagrange_top")
TOLERANCES = ("tol", "rtol", "tolerance")
"""Settings that control the accuracy of adaptive methods instead of dt."""

Settings = Callable[[Method], tuple[Method, ...]]
"""Maps a method to settings of its family."""


def all_variants(method: Method) -> tuple[Method, ...]:
    """Return all variants of a method's family."""
    return method.settings_for("variants")


@dataclass(frozen=True)
class Missing(Method):
    """Placeholder for a method whose engine is not installed: every run raises `MissingEngine`.

    Attributes: `wanted` (the name as the user wrote it), and `engine` and `package` of the error.
    """

    wanted: str
    engine: str
    package: str

    family: ClassVar[str] = "missing"
    role: ClassVar[Role] = Role.ENGINE

    @property
    def name(self) -> str:
        return self.wanted

    @property
    def label(self) -> str:
        return self.wanted

    @property
    def order(self) -> None:
        return None

    def prepare(self, scene: Scene, grid: Grid) -> NoReturn:
        raise MissingEngine(self.engine, self.package)


def scenes(names: Iterable[str] = DEFAULT_SCENES) -> tuple[Scene, ...]:
    """Return scenes by name, which can include parameters.

    Raises
    ------
    BadInput
        A name or a parameter is unknown, or a value cannot be used.
    """
    return tuple(registry.scene(name) for name in names)


def methods(
    names: Iterable[str] | None = None, skip_missing: bool = False, settings: Settings = all_variants
) -> tuple[Method, ...]:
    """Return methods by name, ours first. The name of a family, such as `mujoco`, means all its variants.

    Parameters
    ----------
    names
        Default: every registered family.
    skip_missing
        A `Missing` method for each name whose engine is not installed, instead of an error.
    settings
        Settings that the name of a family means; by default all variants.

    Raises
    ------
    BadInput
        A name or a setting is unknown, or a value cannot be used.
    MissingEngine
        An engine is not installed, and `skip_missing` is False.
    """
    wanted = registry.list_methods() if names is None else names
    found: dict[Method, None] = {}
    for name in wanted:
        found.update(dict.fromkeys(_resolve(name, skip_missing, settings)))
    return tuple(sorted(found, key=lambda method: list(Role).index(Role(method.role))))


def main_methods(skip_missing: bool = False) -> tuple[Method, ...]:
    """Return the methods that a report includes by default: those of `Card.report` in all families. Raises as `methods`."""
    families = registry.list_families()
    names = []
    for name in registry.list_methods():
        settings = families[name].card.settings("report") if name in families else ("",)
        names += [f"{name}:{setting}" if setting else name for setting in settings]
    return methods(names, skip_missing, lambda method: (method,))


def _resolve(name: str, skip_missing: bool, settings: Settings) -> tuple[Method, ...]:
    try:
        method = registry.method(name)
        return (method,) if ":" in name else settings(method)
    except MissingEngine as error:
        if not skip_missing:
            raise
        return (Missing(name, error.engine, error.package),)
    except NotLoadable as error:  # a broken entry point of another package
        if not skip_missing:
            raise
        return (Missing(name, name, error.place),)


def tolerance_setting(method: Method) -> str | None:
    """Return the name of the setting that controls the accuracy of an adaptive method, or None."""
    if method.order is not None:
        return None
    return next((field.name for field in fields(_value(method)) if field.name in TOLERANCES), None)


def takes_exact_steps(method: Method) -> bool:
    """Return whether steps have no truncation error: neither a step size nor a tolerance controls the accuracy."""
    return method.order is None and tolerance_setting(method) is None


def at_tolerance(method: Method, setting: str, tolerance: float) -> Method:
    """Return the method with another tolerance."""
    changed: Method = replace(_value(method), **{setting: tolerance})
    return changed


def series(method: Method) -> str:
    """Return the name of a line in a chart: the method's name without its tolerance."""
    setting = tolerance_setting(method)
    if setting is None:
        return method.name
    default = next(field.default for field in fields(_value(method)) if field.name == setting)
    return at_tolerance(method, setting, default).name if isinstance(default, float) else method.name


def identifier(scene: Scene, method: Method, dt: float) -> str:
    """Return the id of a benchmark, such as `brick_flip-reduced_o4-dt0.01`: letters, digits, `_`, `.`, `+` and `-` only.

    The id contains the settings that differ from the default, and the first setting if it is a text, such as the name of an
    engine's integrator.
    """
    settings = [(field.name, getattr(method, field.name), field.default) for field in fields(_value(method))]
    shown = [
        _short(name, setting)
        for position, (name, setting, default) in enumerate(settings)
        if setting != default or (position == 0 and isinstance(setting, str))
    ]
    return f"{scene.name}-{'_'.join([method.family, *shown])}-dt{dt:g}"


def _short(name: str, setting: object) -> str:
    """Return a setting as part of an id: texts as they are, numbers with the name of the setting."""
    if isinstance(setting, str):
        return setting.lower()
    return {"order": "o", "stages": "s"}.get(name, name) + str(setting)


def _value(method: Method) -> Any:
    """Methods are frozen dataclasses, which the type of their abstract base cannot say."""
    return method
