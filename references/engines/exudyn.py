"""Exudyn: its explicit Lie group integrators and its implicit ones on one free body. Source: its documentation, Solvers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.check import choice
from conservative.method import Method

from ..environments.catalogue import Distribution
from ..environments.engine_method import EngineMethod

ORDERS = {
    **{"ExplicitEuler": 1, "ExplicitMidpoint": 2, "RK33": 3, "RK44": 4, "RK67": 6, "DOPRI5": 5},
    **{"GeneralizedAlpha": 2, "TrapezoidalIndex2": 2},
}


@dataclass(frozen=True)
class Exudyn(EngineMethod):
    """Exudyn with one of its integrators, in its own loop (`mbs.SolveDynamic`), in fixed steps.

    The explicit ones integrate on the Lie group, with a rotation vector as the node's coordinates; the implicit ones, too, with
    a full Newton iteration to 1e-12. Switched off: files of solutions, accelerations at the end of a step. What Exudyn needs to
    start a solver is part of a call.

    Parameters
    ----------
    integrator
        "ExplicitEuler", "ExplicitMidpoint", "RK33", "RK44", "RK67", "DOPRI5", "GeneralizedAlpha" or "TrapezoidalIndex2".

    Raises
    ------
    BadInput
        The integrator is unknown.
    MissingEngine
        It is not installed: no environment has it.
    """

    integrator: str = "RK44"

    family: ClassVar[str] = "exudyn"
    takes_gravity: ClassVar[bool] = True
    distribution: ClassVar[Distribution] = Distribution("exudyn", "exudyn", oldest="1.9")

    def __post_init__(self) -> None:
        choice("integrator", self.integrator, tuple(ORDERS))
        super().__post_init__()

    @property
    def setting(self) -> str:
        return self.integrator

    @property
    def order(self) -> int:
        return ORDERS[self.integrator]

    @classmethod
    def variants(cls) -> tuple[Method, ...]:
        return tuple(cls(integrator) for integrator in ("ExplicitMidpoint", "RK44", "RK67", "GeneralizedAlpha"))

    @classmethod
    def suite_settings(cls) -> tuple[Method, ...]:
        return cls("RK44"), cls("RK67")
