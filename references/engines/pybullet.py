"""PyBullet: one free body, in Bullet's reduced or maximal coordinates. Source: its quickstart guide."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.check import choice
from conservative.errors import BadInput
from conservative.method import Method

from ..environments.catalogue import Distribution
from ..environments.engine_method import EngineMethod


@dataclass(frozen=True)
class PyBullet(EngineMethod):
    """PyBullet in double precision, stepped from Python (`stepSimulation`), as it has no loop of its own.

    Switched off: damping, sleeping, the limit of rates.

    Parameters
    ----------
    body
        "multibody" (btMultiBody, Bullet's default) or "maximal" (btRigidBody, in maximal coordinates).
    as_installed
        Whether damping, sleeping and the limit of rates stay on.

    Raises
    ------
    BadInput
        The body is unknown, or as_installed neither True nor False.
    MissingEngine
        It is not installed: no environment has it.
    """

    body: str = "multibody"
    as_installed: bool = False

    family: ClassVar[str] = "pybullet"
    takes_gravity: ClassVar[bool] = True
    distribution: ClassVar[Distribution] = Distribution("pybullet", "pybullet", oldest="3.2.5")

    def __post_init__(self) -> None:
        choice("body", self.body, ("multibody", "maximal"))
        if not isinstance(self.as_installed, bool):
            raise BadInput("as_installed", repr(self.as_installed), "True or False")
        super().__post_init__()

    @property
    def setting(self) -> str:
        return self.body + ",as installed" * self.as_installed

    @property
    def order(self) -> int:
        return 1

    @classmethod
    def user_defaults(cls) -> Method:
        return cls(as_installed=True)

    @classmethod
    def variants(cls) -> tuple[Method, ...]:
        return cls(), cls("maximal"), cls(as_installed=True)
