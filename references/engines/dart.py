"""DART: its semi-implicit Euler method on one body. Source: its documentation, simulation::World."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.card import Card

from ..environments.engine_method import EngineMethod
from ..environments.environment import Distribution


@dataclass(frozen=True)
class Dart(EngineMethod):
    """DART on a free joint or a ball joint, stepped from Python (`World.step`), as it has no loop of its own.

    It has nothing to set, and nothing was switched off.

    References
    ----------
    World, whose integrator is semi-implicit Euler: https://dartsim.github.io/dart/v6.13.2/
    """

    family: ClassVar[str] = "dart"
    takes_gravity: ClassVar[bool] = True
    distribution: ClassVar[Distribution] = Distribution("dartpy", "dartpy", oldest="6.19")
    card: ClassVar[Card] = Card(as_installed=("",))

    @property
    def setting_parts(self) -> dict[str, str]:
        return {"integrator": "semi-implicit Euler"}
