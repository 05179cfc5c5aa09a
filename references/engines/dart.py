"""DART: its semi-implicit Euler method on one body. Source: its documentation, simulation::World."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.method import Method

from ..environments.catalogue import Distribution
from ..environments.engine_method import EngineMethod


@dataclass(frozen=True)
class Dart(EngineMethod):
    """DART on a free joint or a ball joint, stepped from Python (`World.step`), as it has no loop of its own.

    It has nothing to set, and nothing was switched off.

    Raises
    ------
    MissingEngine
        It is not installed: no environment has it.

    References
    ----------
    World, whose integrator is semi-implicit Euler: https://dartsim.github.io/dart/v6.13.2/
    """

    family: ClassVar[str] = "dart"
    takes_gravity: ClassVar[bool] = True
    distribution: ClassVar[Distribution] = Distribution("dartpy", "dartpy", oldest="6.19")

    @classmethod
    def user_defaults(cls) -> Method:
        return cls()

    @property
    def setting(self) -> str:
        return "semi-implicit Euler"

    @property
    def order(self) -> int:
        return 1
