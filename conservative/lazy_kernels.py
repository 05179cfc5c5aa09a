"""Kernels, imported when they are first asked for: importing numba takes a second, and nobody should wait for it in vain."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import Any


@cache
def kernels(name: str) -> Any:
    """Return the module `conservative.kernels.<name>`. Asking again costs a twentieth of an import statement in a function."""
    return import_module(f"{__package__}.kernels.{name}")
