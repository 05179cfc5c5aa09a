"""Genesis: its rigid solver on one free body. Source: its documentation, https://genesis-world.readthedocs.io."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.check import choice
from conservative.method import Method

from ..environments.catalogue import Distribution
from ..environments.engine_method import EngineMethod

ORDERS = {"Euler": 1, "implicitfast": 2, "approximate_implicitfast": 1}


@dataclass(frozen=True)
class Genesis(EngineMethod):
    """Genesis's rigid solver on the CPU, on the free joint of a body from an MJCF file, stepped from Python (`scene.step`).

    Switched off: collisions and constraints (`RigidOptions(enable_collision=False, disable_constraint=True)`,
    https://genesis-world.readthedocs.io/en/latest/api_reference/options/simulator_coupler_and_solver_options/rigid_options.html).

    Parameters
    ----------
    integrator
        "Euler", "implicitfast" or "approximate_implicitfast", which is Genesis's default.
    precision
        "f64" or "f32", which is Genesis's default (`gs.init(precision=...)`).

    Raises
    ------
    BadInput
        The integrator or the precision is unknown.
    MissingEngine
        It is not installed: no environment has it.
    """

    integrator: str = "implicitfast"
    precision: str = "f64"  # type: ignore[misc]  # a setting here, not a fact

    family: ClassVar[str] = "genesis"
    distribution: ClassVar[Distribution] = Distribution("genesis-world", "genesis", ("torch",), oldest="1.4")

    def __post_init__(self) -> None:
        choice("integrator", self.integrator, tuple(ORDERS))
        choice("precision", self.precision, ("f64", "f32"))
        super().__post_init__()

    @property
    def setting(self) -> str:
        return self.integrator

    @property
    def order(self) -> int:
        return ORDERS[self.integrator]
