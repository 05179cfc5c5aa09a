"""The classes of engines, made from their files: `exudyn`, in an environment, from `exudyn.py`."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

from ..environments.adapter import LocalEngine, method_class, read_script
from ..environments.engine_method import EngineMethod, engine_class
from . import mujoco as _mujoco
from . import pinocchio as _pinocchio

MuJoCo = method_class(_mujoco, LocalEngine)
Pinocchio = method_class(_pinocchio, LocalEngine)


def __getattr__(name: str) -> type[EngineMethod]:
    if name.startswith("_"):
        raise AttributeError(name)
    script = Path(__file__).with_name(f"{name}.mjs")
    return engine_class(read_script(script) if script.is_file() else import_module(f"{__package__}.{name}"))
