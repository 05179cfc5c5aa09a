"""MJX: MuJoCo's integrators in JAX, on one body. Source: MuJoCo's documentation, MJX."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from conservative.card import Card

from ..environments.engine_method import EngineMethod, Orders, jax_variables
from ..environments.environment import Distribution


@dataclass(frozen=True)
class MJX(EngineMethod):
    """MJX on a free joint or a ball joint, on the CPU, with the whole run compiled by JAX; compiling is no part of a call.

    Many bodies at once are `jax.vmap` over models and states.

    Switched off: contacts and constraints (`<flag contact="disable" constraint="disable"/>`).

    Parameters
    ----------
    integrator
        "Euler", "RK4" or "implicitfast".
    precision
        "f64" (JAX's `x64`) or "f32", which is JAX's default.

    References
    ----------
    MJX: https://mujoco.readthedocs.io/en/stable/mjx.html
    Flags and integrators: https://mujoco.readthedocs.io/en/stable/XMLreference.html#option
    x64: https://docs.jax.dev/en/latest/notebooks/Common_Gotchas_in_JAX.html#double-64bit-precision
    """

    integrator: str = "RK4"
    precision: str = "f64"  # type: ignore[misc]  # a setting here, not a fact

    family: ClassVar[str] = "mjx"
    takes_gravity: ClassVar[bool] = True
    distribution: ClassVar[Distribution] = Distribution("mujoco-mjx", "mujoco.mjx", oldest="3.6")
    orders: ClassVar[Orders] = {"Euler": 1, "RK4": 4, "implicitfast": 1}
    card: ClassVar[Card] = Card(
        variants=("Euler", "implicitfast", "RK4", "RK4,precision=f32"),
        many=("RK4", "RK4,precision=f32"),
        as_installed=("Euler,precision=f32",),
    )

    @property
    def variables(self) -> Mapping[str, str]:
        return jax_variables(self.precision)
