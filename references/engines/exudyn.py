"""Exudyn: its explicit Lie group integrators and its implicit ones on one body. Source: its documentation, Solvers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.card import Card

from ..environments.engine_method import EngineMethod, Orders
from ..environments.environment import Distribution


@dataclass(frozen=True)
class Exudyn(EngineMethod):
    """Exudyn with one of its integrators, in its own loop (`mbs.SolveDynamic`), in fixed steps.

    The explicit ones integrate on the Lie group (`useLieGroupIntegration`), with a rotation vector as the node's coordinates;
    the implicit ones, too, with a full Newton iteration to 1e-12. Explicit ones take no joints, so that a body about a fixed
    point is one that has its moments about that point as central ones, with two loads: its weight at the centre of mass, and
    the opposite at the point. Switched off: files of solutions (`writeSolutionToFile`), accelerations at the end of a step
    (`computeEndOfStepAccelerations`), steps of its own choice (`automaticStepSize`). What Exudyn needs to start a solver is a
    part of each call.

    Parameters
    ----------
    integrator
        "ExplicitEuler", "ExplicitMidpoint", "RK33", "RK44", "RK67", "DOPRI5", "GeneralizedAlpha", "TrapezoidalIndex2" or
        "default": the solver, the node's coordinates and all settings that Exudyn takes where nobody chooses.

    References
    ----------
    Solvers: https://github.com/jgerstmayr/EXUDYN/blob/master/docs/RST/SolversInExudyn.rst
    The node: https://github.com/jgerstmayr/EXUDYN/blob/master/docs/RST/items/NodeRigidBodyRotVecLG.rst
    Settings: https://exudyn.readthedocs.io/en/latest/docs/RST/structures/StructuresAndSettings.html
    """

    integrator: str = "RK44"

    family: ClassVar[str] = "exudyn"
    takes_gravity: ClassVar[bool] = True
    distribution: ClassVar[Distribution] = Distribution("exudyn", "exudyn", oldest="1.9")
    orders: ClassVar[Orders] = {
        **{"ExplicitEuler": 1, "ExplicitMidpoint": 2, "RK33": 3, "RK44": 4, "RK67": 6, "DOPRI5": 5},
        **{"GeneralizedAlpha": 2, "TrapezoidalIndex2": 2, "default": 2},
    }
    card: ClassVar[Card] = Card(
        variants=("ExplicitMidpoint", "RK44", "RK67", "GeneralizedAlpha"), suite=("RK44", "RK67"), as_installed=("default",)
    )
