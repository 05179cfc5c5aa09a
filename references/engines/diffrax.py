"""Diffrax: solvers in JAX on quaternion and body rates. Source: its documentation, ODE solvers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from conservative.check import choice, finite_number
from conservative.errors import BadInput
from conservative.method import Method

from ..environments.catalogue import Distribution
from ..environments.engine_method import EngineMethod, jax_variables

ORDERS = {"Euler": 1, "Heun": 2, "Midpoint": 2, "Bosh3": 3, "Tsit5": 5, "Dopri5": 5, "Dopri8": 8}


@dataclass(frozen=True)
class Diffrax(EngineMethod):
    """Diffrax in double precision on the CPU, with the whole run compiled by JAX; compiling is no part of a call.

    Parameters
    ----------
    solver
        "Euler", "Heun", "Midpoint", "Bosh3", "Tsit5", "Dopri5" or "Dopri8".
    rtol
        Relative and absolute tolerance, above 0 and below 1, to which it chooses its own steps; 0 for fixed steps of dt.

    Raises
    ------
    BadInput
        The solver is unknown, or the tolerance out of range.
    MissingEngine
        It is not installed: no environment has it.

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

    def __post_init__(self) -> None:
        choice("solver", self.solver, tuple(ORDERS))
        if not 0 <= finite_number("rtol", self.rtol, "a number from 0 to below 1") < 1:
            raise BadInput("rtol", repr(self.rtol), "a number from 0 to below 1")
        super().__post_init__()

    @property
    def variables(self) -> Mapping[str, str]:
        return jax_variables(self.precision)

    @property
    def setting(self) -> str:
        return self.solver + (f",rtol={self.rtol:g}" if self.rtol else "")

    @property
    def order(self) -> int | None:
        return None if self.rtol else ORDERS[self.solver]

    @classmethod
    def variants(cls) -> tuple[Method, ...]:
        return cls(), cls("Dopri8"), cls("Dopri8", 1e-9)

    @classmethod
    def suite_settings(cls) -> tuple[Method, ...]:
        return cls(), cls("Dopri8", 1e-9)
