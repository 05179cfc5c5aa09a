"""SAPIEN: PhysX on one free body, in single precision. Source: its API reference."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.errors import BadInput
from conservative.method import Method

from ..environments.catalogue import Distribution
from ..environments.engine_method import EngineMethod


@dataclass(frozen=True)
class Sapien(EngineMethod):
    """PhysX on the CPU, as SAPIEN has it, in single precision and stepped from Python (`system.step`).

    Switched off: damping, sleeping, the limit of 100 rad/s.

    Parameters
    ----------
    as_installed
        Whether damping, sleeping and the limit stay on.

    Raises
    ------
    BadInput
        as_installed is neither True nor False.
    MissingEngine
        It is not installed: no environment has it.
    """

    as_installed: bool = False

    family: ClassVar[str] = "sapien"
    takes_gravity: ClassVar[bool] = True
    precision: ClassVar[str] = "f32"
    distribution: ClassVar[Distribution] = Distribution("sapien", "sapien", oldest="3.0")

    def __post_init__(self) -> None:
        if not isinstance(self.as_installed, bool):
            raise BadInput("as_installed", repr(self.as_installed), "True or False")
        super().__post_init__()

    @property
    def setting(self) -> str:
        return "PhysX" + ",as installed" * self.as_installed

    @property
    def order(self) -> int:
        return 1

    @classmethod
    def user_defaults(cls) -> Method:
        return cls(as_installed=True)

    @classmethod
    def variants(cls) -> tuple[Method, ...]:
        return cls(), cls(True)
