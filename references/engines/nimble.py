"""Nimble: its semi-implicit Euler method on one body, which is DART's. Source: its documentation, World."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from conservative.card import Card

from ..environments.engine_method import EngineMethod
from ..environments.environment import Distribution


@dataclass(frozen=True)
class Nimble(EngineMethod):
    """Nimble on a free joint or a ball joint, stepped from Python (`World.step`), as it has no loop of its own.

    It has nothing to set, and nothing was switched off. Its environment needs 5.6 GB, most of them for PyTorch.

    References
    ----------
    World, joints: https://nimblephysics.org/docs/
    """

    family: ClassVar[str] = "nimble"
    takes_gravity: ClassVar[bool] = True
    # With NumPy 2 it crashes.
    distribution: ClassVar[Distribution] = Distribution("nimblephysics", "nimblephysics", ("numpy<2",), oldest="0.10")
    card: ClassVar[Card] = Card(as_installed=("",))

    @property
    def setting_parts(self) -> dict[str, str]:
        return {"integrator": "semi-implicit Euler"}
