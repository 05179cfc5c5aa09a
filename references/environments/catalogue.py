"""The classes of engines: those that run in this process, and, by name, those in an environment, such as `exudyn`."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import ClassVar

from .. import engines
from ..engines import mujoco as _mujoco  # the name without an underscore belongs to the class in an environment
from ..engines import pinocchio as _pinocchio
from .adapter import SCRIPTS, LocalEngine, read_script
from .engine_method import EngineMethod, engine_class


@dataclass(frozen=True)
class MuJoCo(LocalEngine):
    """MuJoCo in this process. `conservative.references.engines.mujoco` describes its loop and its settings."""

    integrator: str = "RK4"
    threads: int = 1

    adapter: ClassVar[ModuleType] = _mujoco


@dataclass(frozen=True)
class Pinocchio(LocalEngine):
    """Pinocchio in this process. `conservative.references.engines.pinocchio` describes its loop and its settings."""

    scheme: str = "RK4"

    adapter: ClassVar[ModuleType] = _pinocchio


def __getattr__(name: str) -> type[EngineMethod]:
    """Return the class of an engine that runs in an environment, such as `exudyn`."""
    files = (Path(engines.__file__).with_name(name + suffix) for suffix in (*SCRIPTS, ".py"))
    file = next((candidate for candidate in files if candidate.is_file()), None)
    if file is None or name.startswith("_"):
        raise AttributeError(f"{__name__} has no class {name!r}, and there is no adapter of this name in references/engines")
    # Adapters in other languages are read as text.
    return engine_class(read_script(file) if file.suffix in SCRIPTS else import_module(f"{engines.__name__}.{name}"))
