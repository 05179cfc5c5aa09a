"""JaxSim: its integrators on one free body, in JAX. Source: its documentation, https://jaxsim.readthedocs.io."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from conservative.card import Card

from ..environments.engine_method import EngineMethod, Orders, jax_variables
from ..environments.environment import Distribution


@dataclass(frozen=True)
class JaxSim(EngineMethod):
    """JaxSim on a floating base, on the CPU, with the whole run compiled by JAX; compiling is no part of a call.

    Nothing is switched off: without shapes there is no contact, and damping belongs to joints, of which there are none.
    `RungeKutta4Fast` raises where there are no points of contact. One of the packages that it needs, pptree, has no wheel:
    `conservative engines install jaxsim --allow-build`.

    Parameters
    ----------
    integrator
        "SemiImplicitEuler", which is JaxSim's default, or "RungeKutta4".
    precision
        "f64", which is JaxSim's default, or "f32", which it calls experimental.

    References
    ----------
    Integrators: https://github.com/gbionics/jaxsim/blob/main/src/jaxsim/api/integrators.py
    Precision: https://github.com/gbionics/jaxsim/blob/main/src/jaxsim/__init__.py
    Models and their joints: https://jaxsim.readthedocs.io/en/latest/modules/api.html
    """

    integrator: str = "RungeKutta4"
    precision: str = "f64"  # type: ignore[misc]  # a setting here, not a fact

    family: ClassVar[str] = "jaxsim"
    distribution: ClassVar[Distribution] = Distribution("jaxsim", "jaxsim", oldest="0.9")
    free_only: ClassVar[str] = "JaxSim's joints are revolute, prismatic or fixed"
    orders: ClassVar[Orders] = {"SemiImplicitEuler": 1, "RungeKutta4": 4}
    card: ClassVar[Card] = Card(
        variants=("SemiImplicitEuler", "RungeKutta4", "RungeKutta4,precision=f32"), as_installed=("SemiImplicitEuler",)
    )

    @property
    def variables(self) -> Mapping[str, str]:
        return jax_variables(self.precision)
