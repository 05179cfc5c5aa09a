"""DART: its semi-implicit Euler method on one free body. Source: its documentation, simulation::World."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ..environments.catalogue import Distribution
from ..environments.engine_method import EngineMethod


@dataclass(frozen=True)
class Dart(EngineMethod):
    """DART on a free joint, stepped from Python (`World.step`), as it has no loop of its own. It has nothing to set.

    Raises
    ------
    MissingEngine
        It is not installed: no environment has it.
    """

    family: ClassVar[str] = "dart"
    takes_gravity: ClassVar[bool] = True
    distribution: ClassVar[Distribution] = Distribution("dartpy", "dartpy", oldest="6.19")

    @property
    def setting(self) -> str:
        return "semi-implicit Euler"

    @property
    def order(self) -> int:
        return 1
