"""MuJoCo Warp: MuJoCo's integrators in Warp, in single precision. Source: MuJoCo's documentation, MuJoCo Warp."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.card import Card

from ..environments.engine_method import EngineMethod, Orders
from ..environments.environment import Distribution


@dataclass(frozen=True)
class MJWarp(EngineMethod):
    """MuJoCo Warp on the CPU, in single precision, on a free joint or a ball joint at the fixed point.

    Switched off: contacts and constraints (`<flag contact="disable" constraint="disable"/>`). A step is recorded by Warp once
    and then replayed; launched from Python, its kernels take a hundred times as long. They are compiled when a run is prepared,
    once in the life of an environment, which takes a minute. It is made for thousands of worlds at once on a GPU: many bodies
    are as many worlds.

    Parameters
    ----------
    integrator
        "Euler", "RK4" or "implicitfast".

    References
    ----------
    MuJoCo Warp, graph capture: https://mujoco.readthedocs.io/en/stable/mjwarp/index.html
    Flags and integrators: https://mujoco.readthedocs.io/en/stable/XMLreference.html#option
    Warp, `ScopedCapture`: https://nvidia.github.io/warp/
    """

    integrator: str = "RK4"

    family: ClassVar[str] = "mjwarp"
    precision: ClassVar[str] = "f32"
    distribution: ClassVar[Distribution] = Distribution("mujoco-warp", "mujoco_warp", oldest="3.10")
    takes_gravity: ClassVar[bool] = True
    orders: ClassVar[Orders] = {"Euler": 1, "RK4": 4, "implicitfast": 1}
    card: ClassVar[Card] = Card(variants=("Euler", "RK4", "implicitfast"), many=("RK4",), as_installed=("Euler",))
