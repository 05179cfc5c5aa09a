"""The classes of engines, made from their files: `exudyn`, in an environment, from `exudyn.py`."""

from __future__ import annotations

from importlib import import_module

from ..environments.adapter import LocalEngine, method_class
from ..environments.engine_method import EngineMethod, engine_class
from . import mujoco as _mujoco
from . import pinocchio as _pinocchio

MuJoCo = method_class(_mujoco, LocalEngine)
Pinocchio = method_class(_pinocchio, LocalEngine)


def __getattr__(name: str) -> type[EngineMethod]:
    if name.startswith("_"):
        raise AttributeError(name)
    return engine_class(import_module(f"{__package__}.{name}"))
