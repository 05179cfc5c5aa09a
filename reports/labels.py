"""What tables and pictures call a method: its family first, then the version of the engine, then the setting."""

from __future__ import annotations

import re

_OURS = "conservative"
_TOLERANCE = re.compile(r"\w*tol=")


def family(name: str) -> str:
    """Return the family of a method's registered name or of what it is called here: `mujoco` of both."""
    return re.split("[: ]", name, maxsplit=1)[0]


def display_name(method: str, label: str) -> str:
    """Return what to call a method: `mujoco 4.0.0 RK4`; ours without the version, which the end of the report has."""
    package, equals, rest = label.partition("==")
    version, _, setting = rest.partition("/")
    if not equals:
        return method.replace(":", " ")  # its engine is missing, so there is no version to tell
    if package == _OURS:
        return setting.replace(":", " ")
    return " ".join(filter(None, (family(method), version, setting)))


def without_tolerance(name: str) -> str:
    """Return what to call a line of points that differ in tolerance alone."""
    *words, settings = name.split(" ")
    others = ",".join(part for part in settings.split(",") if not _TOLERANCE.match(part))
    return " ".join(filter(None, (*words, others)))
