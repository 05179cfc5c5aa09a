"""Rapier: its impulse-based integration of one body, in single precision. Source: its user guide, Rigid-bodies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.check import positive_integer
from conservative.errors import BadInput
from conservative.method import Method

from ..environments.catalogue import Distribution
from ..environments.engine_method import EngineMethod


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

    Raises
    ------
    BadInput
        substeps is not an integer of 1 or more, or as_installed neither True nor False.
    MissingEngine
        It is not installed: no environment has it.

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

    def __post_init__(self) -> None:
        positive_integer("substeps", self.substeps)
        if not isinstance(self.as_installed, bool):
            raise BadInput("as_installed", repr(self.as_installed), "True or False")
        super().__post_init__()

    @property
    def setting(self) -> str:
        return f"substeps={self.substeps}" + ",as installed" * self.as_installed

    @property
    def order(self) -> int:
        return 1

    @classmethod
    def user_defaults(cls) -> Method:
        return cls(as_installed=True)

    @classmethod
    def variants(cls) -> tuple[Method, ...]:
        return cls(), cls(1), cls(as_installed=True)
