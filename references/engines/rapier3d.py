"""Rapier: its impulse-based integration of one body, in single precision. Source: its user guide, Rigid-bodies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.card import Card
from conservative.check import positive_integer

from ..environments.engine_method import EngineMethod
from ..environments.environment import Distribution


@dataclass(frozen=True)
class Rapier(EngineMethod):
    """Rapier in single precision, stepped from Python, as it has no loop of its own.

    A body about a fixed point is on a spherical impulse joint. Gyroscopic forces are on (`gyroscopic_forces`), which they are
    by default, and there is no damping. Switched off: sleeping (`can_sleep`), and the limit of fast rotation
    (`allow_fast_rotation`), which is an eighth of a turn in a substep.

    Parameters
    ----------
    substeps
        Parts of a step, 1 or more (`num_solver_iterations`); 4 by default, as in Rapier.
    as_installed
        Whether sleeping and the limit of fast rotation stay on.

    References
    ----------
    Limit of fast rotation, substeps: https://rapier.rs/docs/user_guides/python/rigid_body_solver_settings
    Sleeping, gyroscopic forces: https://rapier.rs/docs/user_guides/python/rigid_bodies
    Joints: https://rapier.rs/docs/user_guides/python/joints
    """

    substeps: int = 4
    as_installed: bool = False

    family: ClassVar[str] = "rapier3d"
    takes_gravity: ClassVar[bool] = True
    precision: ClassVar[str] = "f32"
    distribution: ClassVar[Distribution] = Distribution("rapier3d", "rapier3d", oldest="0.36")
    card: ClassVar[Card] = Card(variants=("", "substeps=1", "as_installed=true"), as_installed=("as_installed=true",))

    def __post_init__(self) -> None:
        positive_integer("substeps", self.substeps)
        super().__post_init__()

    @property
    def setting_parts(self) -> dict[str, str]:
        return {**super().setting_parts, "substeps": f"substeps={self.substeps}"}
