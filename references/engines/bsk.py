"""Basilisk: its integrators on one free spacecraft hub. Source: its documentation, spacecraft and svIntegrators."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.card import Card
from conservative.check import finite_number
from conservative.errors import BadInput

from ..environments.engine_method import EngineMethod, Orders
from ..environments.environment import Distribution


@dataclass(frozen=True)
class Basilisk(EngineMethod):
    """Basilisk with one of its integrators, in its own loop (`ExecuteSimulation`).

    A simulation cannot be started twice, so that each run has its own; making it is in no time. Attitudes are modified
    Rodrigues parameters.

    Parameters
    ----------
    integrator
        "Euler", "RK2", "RK4", which is Basilisk's default, "RKF45" or "RKF78"; the latter two choose their own steps.
    tol
        Their absolute and relative tolerance, above 0 and below 1.

    References
    ----------
    Spacecraft and its hub: https://avslab.github.io/basilisk/Documentation/simulation/dynamics/spacecraft/spacecraft.html
    Integrators: https://github.com/AVSLab/basilisk/tree/develop/src/simulation/dynamics/Integrators
    """

    integrator: str = "RK4"
    tol: float = 1e-12

    family: ClassVar[str] = "bsk"
    distribution: ClassVar[Distribution] = Distribution("bsk", "Basilisk.simulation.spacecraft", oldest="2.8")
    free_only: ClassVar[str] = "a spacecraft is free: nothing in Basilisk holds a point of its hub"
    orders: ClassVar[Orders] = {"Euler": 1, "RK2": 2, "RK4": 4, "RKF45": None, "RKF78": None}
    card: ClassVar[Card] = Card(variants=("Euler", "RK2", "RK4", "RKF78"), suite=("RK4", "RKF78"), as_installed=("RK4",))

    def __post_init__(self) -> None:
        if not 0 < finite_number("tol", self.tol, "a number above 0 and below 1") < 1:
            raise BadInput("tol", repr(self.tol), "a number above 0 and below 1")
        super().__post_init__()

    @property
    def setting_parts(self) -> dict[str, str]:
        return {"integrator": self.integrator} | ({"tol": f"tol={self.tol:g}"} if self.order is None else {})
