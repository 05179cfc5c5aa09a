"""Genesis: its rigid solver on one free body. Source: its documentation, https://genesis-world.readthedocs.io."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from conservative.card import Card

from ..environments.engine_method import EngineMethod, Orders
from ..environments.environment import Distribution


@dataclass(frozen=True)
class Genesis(EngineMethod):
    """Genesis's rigid solver on the CPU, on the free joint of a body from an MJCF file, stepped from Python (`scene.step`).

    Its kernels are compiled when a run is prepared, once in the life of an environment: with importing it, that takes one to
    four minutes. One of the packages that it needs, pygltflib, has no wheel: `conservative engines install genesis
    --allow-build`; the environment takes 8 GB, nearly all of it PyTorch for GPUs. Switched off: collisions and constraints
    (`enable_collision`, `disable_constraint`).

    Parameters
    ----------
    integrator
        "Euler", "implicitfast" or "approximate_implicitfast", which is Genesis's default.
    precision
        "f64" or "f32", which is Genesis's default (`gs.init(precision="32")`).
    as_installed
        Whether collisions and constraints stay on.

    References
    ----------
    RigidOptions: https://github.com/Genesis-Embodied-AI/genesis-world/blob/main/genesis/options/solvers.py
    Precision, `gs.init`: https://genesis-world.readthedocs.io
    """

    integrator: str = "implicitfast"
    precision: str = "f64"  # type: ignore[misc]  # a setting here, not a fact
    as_installed: bool = False

    family: ClassVar[str] = "genesis"
    distribution: ClassVar[Distribution] = Distribution("genesis-world", "genesis", ("torch",), oldest="1.4")
    orders: ClassVar[Orders] = {"Euler": 1, "implicitfast": 2, "approximate_implicitfast": 2}
    card: ClassVar[Card] = Card(
        variants=(
            *("Euler", "implicitfast", "approximate_implicitfast", "implicitfast,precision=f32"),
            "approximate_implicitfast,precision=f32,as_installed=true",
        ),
        as_installed=("approximate_implicitfast,precision=f32,as_installed=true",),
    )

    @property
    def variables(self) -> Mapping[str, str]:
        """Variables that no one reads: Genesis has one precision in a process, so that each precision has a process."""
        return {"CONSERVATIVE_PRECISION": self.precision}
