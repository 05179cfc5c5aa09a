"""Nimble: its integrators on one aircraft without forces, far above the Earth. Source: its manual, FGPropagate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ..environments.catalogue import Distribution
from ..environments.engine_method import EngineMethod


@dataclass(frozen=True)
class Nimble(EngineMethod):
    """Nimble."""

    family: ClassVar[str] = "nimble"
    distribution: ClassVar[Distribution] = Distribution("nimblephysics", "nimblephysics", ("numpy<2",), oldest="0.10")

    @property
    def setting(self) -> str:
        return ""
