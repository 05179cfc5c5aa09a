"""SAPIEN: PhysX on one body, in single precision. Source: its API reference."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.card import Card
from conservative.scene import Scene

from ..environments.engine_method import EngineMethod, rate_limit_reason
from ..environments.environment import Distribution

RATE_LIMIT = 100.0
"""Rate, rad/s, that PhysX keeps a body below as installed (`max_angular_velocity`)."""


@dataclass(frozen=True)
class Sapien(EngineMethod):
    """PhysX on the CPU, as SAPIEN has it, in single precision and stepped from Python (`system.step`).

    A body about a fixed point is on a D6 joint (`PhysxDriveComponent`) with its translations locked. Switched off: damping,
    which is 0.05 1/s (`angular_damping`), sleeping (`sleep_threshold`), the limit of 100 rad/s (`max_angular_velocity`).

    Parameters
    ----------
    as_installed
        Whether damping, sleeping and the limit stay on.

    References
    ----------
    PhysX, damping, limit of rates, sleeping: https://nvidia-omniverse.github.io/PhysX/physx/5.4.1/docs/RigidBodyDynamics.html
    D6 joint: https://nvidia-omniverse.github.io/PhysX/physx/5.4.1/docs/Joints.html
    SAPIEN: https://sapien-sim.github.io/docs/
    """

    as_installed: bool = False

    family: ClassVar[str] = "sapien"
    takes_gravity: ClassVar[bool] = True
    precision: ClassVar[str] = "f32"
    distribution: ClassVar[Distribution] = Distribution("sapien", "sapien", oldest="3.0")
    card: ClassVar[Card] = Card(variants=("", "as_installed=true"), as_installed=("as_installed=true",))

    def unsupported(self, scene: Scene) -> str | None:
        return super().unsupported(scene) or (rate_limit_reason(scene, RATE_LIMIT) if self.as_installed else None)

    @property
    def setting_parts(self) -> dict[str, str]:
        return {"engine": "PhysX", **super().setting_parts}
