"""Brax: its three pipelines on one free body, in JAX. Source: its README, https://github.com/google/brax, and its source."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from conservative.card import Card

from ..environments.engine_method import EngineMethod, Orders, jax_variables
from ..environments.environment import Distribution


@dataclass(frozen=True)
class Brax(EngineMethod):
    """Brax on a free joint, on the CPU, with the whole run compiled by JAX; compiling is no part of a call.

    Nothing had to be switched off: damping (`ang_damping`, `vel_damping`) and scaling of inertia (`spring_inertia_scale`) are 0
    by default. "spring" and "positional" have no gyroscopic term: a free body turns about the axis that it starts with.
    "positional" takes 2 sin(turn / 2) / dt for the rate after a step, so that fast bodies lose energy.

    Parameters
    ----------
    pipeline
        "generalized", "positional" or "spring".
    precision
        "f64" (JAX's `x64`) or "f32", which is JAX's default.

    References
    ----------
    Defaults: https://github.com/google/brax/blob/main/brax/io/mjcf.py
    Spring, how it integrates: https://github.com/google/brax/blob/main/brax/spring/integrator.py
    Positional, `project_xd`: https://github.com/google/brax/blob/main/brax/positional/integrator.py
    x64: https://docs.jax.dev/en/latest/notebooks/Common_Gotchas_in_JAX.html#double-64bit-precision
    """

    pipeline: str = "generalized"
    precision: str = "f64"  # type: ignore[misc]  # a setting here, not a fact

    family: ClassVar[str] = "brax"
    distribution: ClassVar[Distribution] = Distribution("brax", "brax", oldest="0.14")
    free_only: ClassVar[str] = "Brax reads no ball joint"
    orders: ClassVar[Orders] = {"generalized": 1, "positional": 1, "spring": 1}
    card: ClassVar[Card] = Card(
        variants=("generalized", "positional", "spring", "generalized,precision=f32"), as_installed=("precision=f32",)
    )

    @property
    def variables(self) -> Mapping[str, str]:
        return jax_variables(self.precision)
