"""JSBSim: its integrators on one aircraft that no force turns. Source: its API documentation, JSBSim::FGPropagate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.card import Card
from conservative.check import choice

from ..environments.engine_method import EngineMethod, Orders
from ..environments.environment import Distribution

RATES = {"RectEuler": 1, "Trapezoidal": 1, "AB2": 2, "AB3": 2, "AB4": 2, "AB5": 2}
"""Order of each, about: what comes before the start is taken for constant, which leaves an error of second order."""
ATTITUDES = (*RATES, "Buss1", "Buss2", "LocalLinearization")


@dataclass(frozen=True)
class JSBSim(EngineMethod):
    """JSBSim on an aircraft without forces but weight, stepped from Python (`FGFDMExec.run`), as it has no loop of its own.

    Changed: the planet does not turn (`load_planet`), so that the Earth's rate is not in the attitudes; no model of
    aerodynamics (`simulation/models/FGAerodynamics/enabled`). The translation is JSBSim's own, and its time in each step.

    Parameters
    ----------
    rate
        Integrator of the rates (`simulation/integrator/rate/rotational`): "RectEuler", JSBSim's default, "Trapezoidal", "AB2",
        "AB3", "AB4" or "AB5" (Adams-Bashforth).
    attitude
        Integrator of the attitude (`simulation/integrator/position/rotational`): one of these, "Buss1", "Buss2" or
        "LocalLinearization"; empty for that of the rates.

    References
    ----------
    FGPropagate, the integrators: https://jsbsim-team.github.io/jsbsim/classJSBSim_1_1FGPropagate.html
    """

    rate: str = "AB2"
    attitude: str = ""

    family: ClassVar[str] = "jsbsim"
    distribution: ClassVar[Distribution] = Distribution("jsbsim", "jsbsim", oldest="1.3")
    free_only: ClassVar[str] = "an aircraft flies: nothing in JSBSim holds one of its points"
    orders: ClassVar[Orders] = RATES
    card: ClassVar[Card] = Card(variants=("RectEuler", "Trapezoidal", "AB2", "AB5"), as_installed=("RectEuler",))

    def __post_init__(self) -> None:
        choice("attitude", self.attitude, ("", *ATTITUDES))
        super().__post_init__()
