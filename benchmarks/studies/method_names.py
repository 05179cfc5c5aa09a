"""What a method is called in tables and pictures, in parts: taken where the method itself is known."""

from __future__ import annotations

from dataclasses import dataclass

import conservative
from conservative.errors import MissingEngine
from conservative.method import Method

from .selection import series, tolerance_setting


@dataclass(frozen=True)
class MethodNames:
    """The names of a method.

    Attributes
    ----------
    method, label, family
        As it has them itself; its name in place of the label where the engine that knows the version is missing.
    version
        That of the package that it is from; empty for ours, and where the engine is missing.
    setting
        Its setting as the label has it, such as `tol=1e-06,body`.
    series
        What one line of a picture is: the method without its tolerance.
    series_setting
        The setting that all of the series have: without the tolerance.
    """

    method: str
    label: str
    family: str
    version: str
    setting: str
    series: str
    series_setting: str


def names_of(method: Method) -> MethodNames:
    """Return the names of a method."""
    family, version, setting = _parts(method)
    return MethodNames(
        method=method.name,
        label=label_of(method),
        family=family,
        version=version,
        setting=setting,
        series=series(method),
        series_setting=drop_tolerance(method, setting),
    )


def label_of(method: Method) -> str:
    """Return the method's label; its name where the engine that knows the version is missing."""
    try:
        return method.label
    except MissingEngine:
        return method.name


def _parts(method: Method) -> tuple[str, str, str]:
    """Return family, version and setting, which a label has as `package==version/setting`, and a name as `family:setting`."""
    maker, slash, setting = label_of(method).partition("/")
    package, _, version = maker.partition("==")
    if not slash:
        family, _, setting = method.name.partition(":")
        return family, "", setting
    own = setting.removeprefix(method.family)  # the label of what has none of its own ends with its name
    setting = own.removeprefix(":") if own[:1] in ("", ":") else setting
    return method.family, "" if package == conservative.__name__ else version, setting


def drop_tolerance(method: Method, setting: str) -> str:
    """Return a setting's text without the tolerance that the method trades accuracy with."""
    tolerance = tolerance_setting(method)
    return ",".join(part for part in setting.split(",") if tolerance is None or part.partition("=")[0] != tolerance)
