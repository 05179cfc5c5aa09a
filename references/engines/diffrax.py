"""Diffrax: solvers in JAX on quaternion and body rates. Source: its documentation, ODE solvers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from conservative.card import Card
from conservative.check import finite_number
from conservative.errors import BadInput

from ..environments.engine_method import EngineMethod, Orders, jax_variables
from ..environments.environment import Distribution


@dataclass(frozen=True)
class Diffrax(EngineMethod):
    """Diffrax in double precision on the CPU, with the whole run compiled by JAX; compiling is no part of a call.

    Parameters
    ----------
    solver
        "Euler", "Heun", "Midpoint", "Bosh3", "Tsit5", "Dopri5" or "Dopri8".
    rtol
        Relative and absolute tolerance, above 0 and below 1, to which it chooses its own steps; 0 for fixed steps of dt.

    References
    ----------
    Solvers: https://docs.kidger.site/diffrax/api/solvers/ode_solvers/
    Choice of steps: https://docs.kidger.site/diffrax/api/stepsize_controller/
    """

    solver: str = "Tsit5"
    rtol: float = 0.0

    family: ClassVar[str] = "diffrax"
    takes_gravity: ClassVar[bool] = True
    distribution: ClassVar[Distribution] = Distribution("diffrax", "diffrax", oldest="0.7")
    orders: ClassVar[Orders] = {"Euler": 1, "Heun": 2, "Midpoint": 2, "Bosh3": 3, "Tsit5": 5, "Dopri5": 5, "Dopri8": 8}
    card: ClassVar[Card] = Card(variants=("", "Dopri8", "Dopri8,rtol=1e-9"), suite=("", "Dopri8,rtol=1e-9"))

    def __post_init__(self) -> None:
        if not 0 <= finite_number("rtol", self.rtol, "a number from 0 to below 1") < 1:
            raise BadInput("rtol", repr(self.rtol), "a number from 0 to below 1")
        super().__post_init__()

    @property
    def variables(self) -> Mapping[str, str]:
        return jax_variables(self.precision)

    @property
    def order(self) -> int | None:
        return None if self.rtol else self.orders[self.solver]
