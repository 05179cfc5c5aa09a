"""Drake: its discrete plant and its integrators on one body. Source: its documentation, Simulator and IntegratorBase."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.card import Card
from conservative.check import finite_number
from conservative.errors import BadInput

from ..environments.engine_method import EngineMethod, Orders
from ..environments.environment import Distribution


@dataclass(frozen=True)
class Drake(EngineMethod):
    """Drake with its discrete plant, or with one of its integrators, in its own loop (`Simulator.AdvanceTo`).

    A free body is on Drake's quaternion floating joint. A body about a fixed point is on `BallRpyJoint`, Drake's only ball
    joint, whose coordinates are roll, pitch and yaw: errors grow where the first principal axis comes near the vertical, and a
    run in which it stands upright ends there. Switched off: error control (`set_fixed_step_mode`), unless an accuracy is given
    or the integrator is "default".

    Parameters
    ----------
    integrator
        "discrete" (the plant's own update), one that Drake has for a continuous plant, such as "runge_kutta5", or "default":
        what `Simulator` takes where nobody chooses, with error control and with steps of dt at most.
    accuracy
        Relative accuracy, above 0 to 1, to which it chooses its own steps of at most dt; 0 for fixed steps of dt.

    References
    ----------
    Simulator: https://drake.mit.edu/doxygen_cxx/classdrake_1_1systems_1_1_simulator.html
    Its defaults: https://github.com/RobotLocomotion/drake/blob/master/systems/analysis/simulator_config.h
    Fixed steps: https://drake.mit.edu/doxygen_cxx/classdrake_1_1systems_1_1_integrator_base.html
    BallRpyJoint: https://drake.mit.edu/doxygen_cxx/classdrake_1_1multibody_1_1_ball_rpy_joint.html
    No ball joint of quaternions: https://github.com/RobotLocomotion/drake/issues/12404
    """

    integrator: str = "runge_kutta5"
    accuracy: float = 0.0

    family: ClassVar[str] = "drake"
    takes_gravity: ClassVar[bool] = True
    distribution: ClassVar[Distribution] = Distribution("drake", "pydrake.all", oldest="1.40")
    orders: ClassVar[Orders] = {
        **{"default": None, "discrete": 1, "explicit_euler": 1, "semi_explicit_euler": 1, "implicit_euler": 1},
        **{"velocity_implicit_euler": 1, "runge_kutta2": 2, "runge_kutta3": 3, "runge_kutta5": 5, "bogacki_shampine3": 3},
        **{"radau1": 1, "radau3": 3},
    }
    card: ClassVar[Card] = Card(
        variants=("discrete", "runge_kutta3", "runge_kutta5", "runge_kutta3,accuracy=1e-10"),
        suite=("discrete", "runge_kutta5"),
        as_installed=("default",),
    )

    def __post_init__(self) -> None:
        allowed = "a number above 0 up to 1, or 0 for fixed steps"
        if not 0 <= finite_number("accuracy", self.accuracy, allowed) <= 1:
            raise BadInput("accuracy", repr(self.accuracy), allowed)
        if self.accuracy and self.integrator in ("default", "discrete"):
            raise BadInput("accuracy", repr(self.accuracy), f"0 with the integrator {self.integrator!r}")
        super().__post_init__()

    @property
    def order(self) -> int | None:
        return None if self.accuracy else self.orders[self.integrator]
