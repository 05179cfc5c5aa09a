"""MuJoCo in any version, in an environment: `mujoco@3.6.0:RK4`. Source: its documentation, Computation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.check import choice
from conservative.method import Method
from conservative.scene import Scene

from ..engine import gravity_or_free, mass_model_reason
from ..environments.catalogue import Distribution
from ..environments.engine_method import EngineMethod
from .mujoco import INTEGRATORS


@dataclass(frozen=True)
class MuJoCoVersion(EngineMethod):
    """MuJoCo with one of its integrators, in its own loop, with the code that runs it in this process.

    Parameters
    ----------
    integrator
        "Euler", "RK4", "implicit", "implicitfast" or "discrete", which versions before 3.13 do not have.

    Raises
    ------
    BadInput
        The integrator is unknown.
    MissingEngine
        It is not installed: no environment has it.
    """

    integrator: str = "RK4"

    family: ClassVar[str] = "mujoco"
    distribution: ClassVar[Distribution] = Distribution("mujoco", "mujoco", oldest="3.6")
    colour: ClassVar[str] = "vermilion"

    def __post_init__(self) -> None:
        choice("integrator", self.integrator, INTEGRATORS)
        super().__post_init__()

    @property
    def setting(self) -> str:
        return self.integrator

    @property
    def order(self) -> int:
        return 4 if self.integrator == "RK4" else 1

    def unsupported(self, scene: Scene) -> str | None:
        return gravity_or_free(scene) or mass_model_reason(scene)

    @classmethod
    def variants(cls) -> tuple[Method, ...]:
        return tuple(cls(integrator) for integrator in INTEGRATORS)

    @classmethod
    def suite_settings(cls) -> tuple[Method, ...]:
        return cls("Euler"), cls("RK4")
