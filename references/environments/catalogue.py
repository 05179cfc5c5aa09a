"""The classes of engines, made from their files: `exudyn`, in an environment, from `exudyn.py`."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

from .. import engines
from ..engines import mujoco as _mujoco
from ..engines import pinocchio as _pinocchio
from .adapter import SCRIPTS, LocalEngine, method_class, read_script
from .engine_method import EngineMethod, engine_class

MuJoCo = method_class(_mujoco, LocalEngine)
Pinocchio = method_class(_pinocchio, LocalEngine)


def __getattr__(name: str) -> type[EngineMethod]:
    if name.startswith("_"):
        raise AttributeError(name)
    scripts = (Path(engines.__file__).with_name(name + suffix) for suffix in SCRIPTS)
    script = next((each for each in scripts if each.is_file()), None)
    return engine_class(read_script(script) if script else import_module(f"{engines.__name__}.{name}"))
