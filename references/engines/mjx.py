"""MJX: MuJoCo's integrators in JAX, on one body. Source: MuJoCo's documentation, MJX."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from conservative.check import choice
from conservative.method import Method

from ..environments.catalogue import Distribution
from ..environments.engine_method import EngineMethod, jax_variables

INTEGRATORS = ("Euler", "RK4", "implicitfast")


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

    Raises
    ------
    BadInput
        The integrator or the precision is unknown.
    MissingEngine
        It is not installed: no environment has it.

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
    many = ({"integrator": "RK4"}, {"integrator": "RK4", "precision": "f32"})
    distribution: ClassVar[Distribution] = Distribution("mujoco-mjx", "mujoco.mjx", oldest="3.6")

    def __post_init__(self) -> None:
        choice("integrator", self.integrator, INTEGRATORS)
        choice("precision", self.precision, ("f64", "f32"))
        super().__post_init__()

    @property
    def variables(self) -> Mapping[str, str]:
        return jax_variables(self.precision)

    @property
    def order(self) -> int:
        return 4 if self.integrator == "RK4" else 1

    @classmethod
    def user_defaults(cls) -> Method:
        return cls("Euler", "f32")

    @classmethod
    def variants(cls) -> tuple[Method, ...]:
        return cls("Euler"), cls("implicitfast"), cls("RK4"), cls("RK4", "f32")
