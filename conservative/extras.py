"""What is installed on top of numpy, scipy, numba and mpmath: the extras, and the error that names the one to install."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec
from types import MappingProxyType

from .errors import MissingExtra

EXTRAS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "engines": ("mujoco", "pinocchio", "heyoka"),
        "report": ("click", "rich", "jinja2", "pandas", "altair", "vl_convert"),
        "gate": ("click", "pytest", "pytest_benchmark", "heyoka"),
    }
)
"""Packages, under the names they are imported by, of each extra in pyproject.toml."""


def require_extra(what: str, extra: str, *packages: str) -> None:
    """Check that packages are there; none is imported.

    Parameters
    ----------
    what
        What needs them, such as `conservative report`.
    extra
        The extra that brings them, a key of `EXTRAS`.
    packages
        Their names as they are imported; by default all of the extra.

    Raises
    ------
    MissingExtra
        One of them is not installed.
    """
    missing = [package for package in packages or EXTRAS[extra] if find_spec(package) is None]
    if missing:
        raise MissingExtra(what, ", ".join(missing), extra)
