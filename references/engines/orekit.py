"""Orekit: the exact solution of the free body in Java. Source: its API reference, attitudes.TorqueFree."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ..environments.engine_method import EngineMethod
from ..environments.environment import Distribution


@dataclass(frozen=True)
class Orekit(EngineMethod):
    """Orekit's `TorqueFree`: Jacobi's elliptic functions, evaluated at each sample. It needs a Java runtime on the machine.

    Raises
    ------
    MissingEngine
        It is not installed: no environment has it.

    References
    ----------
    TorqueFree: https://www.orekit.org/site-orekit-development/apidocs/org/orekit/attitudes/TorqueFree.html
    """

    family: ClassVar[str] = "orekit"
    distribution: ClassVar[Distribution] = Distribution("orekit-jpype", "orekit_jpype", oldest="13")
    free_only: ClassVar[str] = "TorqueFree is the motion of a free body"

    @property
    def setting_parts(self) -> dict[str, str]:
        return {"motion": "TorqueFree"}

    @property
    def order(self) -> None:
        return None
