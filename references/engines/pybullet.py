"""PyBullet: one body, in Bullet's reduced or maximal coordinates. Source: its quickstart guide."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.card import Card
from conservative.scene import Scene

from ..environments.engine_method import EngineMethod, Orders, rate_limit_reason
from ..environments.environment import Distribution

RATE_LIMIT = 100.0
"""Rate, rad/s, that Bullet keeps a body below as installed (`maxJointVelocity`)."""


@dataclass(frozen=True)
class PyBullet(EngineMethod):
    """PyBullet in double precision, stepped from Python (`stepSimulation`), as it has no loop of its own.

    A body about a fixed point is the only link of a base that does not move, on a spherical joint, whose motor is off
    (`setJointMotorControlMultiDof`, force 0). Switched off: damping (`linearDamping`, `angularDamping`, `jointDamping`),
    sleeping (`ACTIVATION_STATE_DISABLE_SLEEPING`), the limit of rates (`maxJointVelocity`).

    Parameters
    ----------
    body
        "multibody" (btMultiBody, Bullet's default) or "maximal" (btRigidBody, in maximal coordinates).
    as_installed
        Whether damping, sleeping and the limit of rates stay on.

    References
    ----------
    PyBullet Quickstart Guide, changeDynamics, createMultiBody, setJointMotorControlMultiDof:
    https://github.com/bulletphysics/bullet3/blob/master/docs/pybullet_quickstartguide.pdf
    """

    body: str = "multibody"
    as_installed: bool = False

    family: ClassVar[str] = "pybullet"
    takes_gravity: ClassVar[bool] = True
    distribution: ClassVar[Distribution] = Distribution("pybullet", "pybullet", oldest="3.2.5")
    orders: ClassVar[Orders] = {"multibody": 1, "maximal": 1}
    card: ClassVar[Card] = Card(variants=("", "maximal", "as_installed=true"), as_installed=("as_installed=true",))

    def unsupported(self, scene: Scene) -> str | None:
        if self.body == "maximal" and scene.potential is not None:
            return "PyBullet has no joint to the world for a body in maximal coordinates"
        return super().unsupported(scene) or (rate_limit_reason(scene, RATE_LIMIT) if self.as_installed else None)
