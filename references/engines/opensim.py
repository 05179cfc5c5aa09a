"""OpenSim: Simbody's integrators on one body. Source: its API documentation, Manager; Simbody's, SimTK::Integrator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.card import Card
from conservative.check import finite_number
from conservative.errors import BadInput

from ..environments.engine_method import EngineMethod, Orders
from ..environments.environment import Distribution


@dataclass(frozen=True)
class OpenSim(EngineMethod):
    """OpenSim, which is Simbody, with one of its integrators, in its own loop (`Manager.integrate`).

    A free body is on a `FreeJoint`, one about a fixed point on a `BallJoint`. OpenSim has Simbody use three angles as the
    coordinates of both, and its Python module has nothing to change that: errors grow where the second angle comes near a right
    one, and a top that spins about its third axis is easier than elsewhere. Switched off: storage and analyses of states
    (`setWriteToStorage`, `setPerformAnalyses`).

    Parameters
    ----------
    integrator
        "RungeKuttaMerson", OpenSim's default, "RungeKuttaFeldberg", "RungeKutta3", "RungeKutta2", "ExplicitEuler",
        "SemiExplicitEuler2" or "Verlet".
    accuracy
        Accuracy, above 0 to 1, to which it chooses its own steps; 1e-3 is OpenSim's default. 0 for fixed steps of dt.

    References
    ----------
    Manager, integrators and their settings: https://simtk.org/api_docs/opensim/api_docs/classOpenSim_1_1Manager.html
    """

    integrator: str = "RungeKuttaMerson"
    accuracy: float = 0.0

    family: ClassVar[str] = "opensim"
    takes_gravity: ClassVar[bool] = True
    distribution: ClassVar[Distribution] = Distribution("opensim", "opensim", oldest="4.5")
    orders: ClassVar[Orders] = {
        **{"RungeKuttaMerson": 4, "RungeKuttaFeldberg": 4, "RungeKutta3": 3, "RungeKutta2": 2},
        **{"ExplicitEuler": 1, "SemiExplicitEuler2": 1, "Verlet": 2},
    }
    card: ClassVar[Card] = Card(
        variants=("", "RungeKuttaFeldberg", "Verlet", "accuracy=1e-10"), as_installed=("RungeKuttaMerson,accuracy=1e-3",)
    )

    def __post_init__(self) -> None:
        allowed = "a number above 0 up to 1, or 0 for fixed steps"
        if not 0 <= finite_number("accuracy", self.accuracy, allowed) <= 1:
            raise BadInput("accuracy", repr(self.accuracy), allowed)
        super().__post_init__()

    @property
    def order(self) -> int | None:
        return None if self.accuracy else self.orders[self.integrator]
