"""The engines that run in environments, as classes: the attribute `exudyn` is the class made from the file `exudyn.py`."""

from __future__ import annotations

from importlib import import_module

from ..environments.engine_method import EngineMethod, engine_class

FILES = {"mujoco": "mujoco_versions"}  # `mujoco.py` has the method for this process


def __getattr__(name: str) -> type[EngineMethod]:
    if name.startswith("_"):
        raise AttributeError(name)
    return engine_class(import_module(f"{__package__}.{FILES.get(name, name)}"))
