"""Methods from textbooks and game engines, as baselines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from ..check import choice, describe, finite_number
from ..deferred_imports import kernels
from ..errors import BadInput
from ..features import IN_TIME, ROTATION
from ..grid import Grid
from ..method import Method, Role, Run
from ..method_info import MethodInfo, Structure
from ..scene import Scene
from .bounds import within_round_off
from .coefficients.explicit import CROUCH_GROSSMAN_4, RUNGE_KUTTA_4
from .principal_axes import principal_start
from .run_kernel import prepare_run
from .units import in_own_units

Scheme = Literal["rkmk", "crouch_grossman", "generalized_alpha", "buss", "gyroscopic", "spiers", "spiers_rates"]
_RADIUS = "a spectral radius from 0 to 1"
SCHEMES = {
    "rkmk": ("RKMK 4", 4),
    "crouch_grossman": ("Crouch-Grossman 4", 4),
    "generalized_alpha": ("generalised-alpha", 2),
    "buss": ("Buss 3", 3),
    "gyroscopic": ("explicit gyroscopic step", 1),
    "spiers": ("Spiers 1", 1),
    "spiers_rates": ("Spiers 1, rates first", 1),
}
"""Titles in tables, and orders. In the order of the numbers in `conservative.kernels.textbook`."""


@dataclass(frozen=True)
class Textbook(Method):
    """A textbook method, compiled like ours, as a baseline: shown in tables, without speed ratios, never chosen automatically.

    All of them support every field, also time-dependent ones. None conserves energy, except "spiers" for a free symmetric body,
    whose motion it solves. "buss" and "spiers" conserve the momentum in the world, or its component along the field's axis. All
    but "buss" conserve the axial momentum of a symmetric body.

    Parameters
    ----------
    scheme
        "rkmk": Munthe-Kaas with the classical tableau, order 4 (Hairer, Lubich & Wanner, *Geometric Numerical Integration*,
        IV.8.2). "crouch_grossman": order 4 with five stages (IV.8.1; Jackiewicz, Marthinsen & Owren 2000).
        "generalized_alpha": order 2, implicit (Brüls & Cardona 2010). "buss": order 3, one rotation a step (Buss 2000, for a
        free body; the torque is integrated by Radau's rule of order 3). "gyroscopic": order 1, the explicit gyroscopic torque
        (an option of Bullet, and ODE before it became implicit) in a semi-implicit Euler step. "spiers": order 1, a rotation
        about the momentum after one about a part of the rate (B. Spiers, *A better way to spin*, 2026, "Momentum-first method";
        Avian's pull request 993 proposes the method of this text). "spiers_rates": the same rates at the end, with which the
        body turns ("Modified Jolt Method" there).
    rho
        Spectral radius of generalised-alpha at infinite frequency, 0 to 1: 1 has no numerical damping.

    Raises
    ------
    BadInput
        There is no such scheme, or rho is outside its range.
    """

    scheme: Scheme = "rkmk"
    rho: float = 0.9

    family: ClassVar[str] = "textbook"
    role: ClassVar[Role] = Role.BASELINE
    method_info: ClassVar[MethodInfo] = MethodInfo(
        variants=tuple(f"scheme={scheme}" for scheme in SCHEMES),
        report=(),
        suite=(),
        kernel="textbook",
        structure=lambda method: Structure(method.scheme == "generalized_alpha" and method.rho == 1, symplectic=False),
        supports=ROTATION | IN_TIME,
    )

    def __post_init__(self) -> None:
        choice("scheme", self.scheme, tuple(SCHEMES))
        if not 0 <= finite_number("rho", self.rho, _RADIUS) <= 1:
            raise BadInput("rho", describe(self.rho), _RADIUS)

    @property
    def order(self) -> int:
        return SCHEMES[self.scheme][1]

    @property
    def conserves(self) -> frozenset[str]:
        in_world = {"momentum", "vertical momentum", "momentum along the field's axis"}
        kept = {"buss": in_world, "spiers": {*in_world, "axial momentum"}}
        return frozenset(kept.get(self.scheme, {"axial momentum"}))

    @property
    def setting_parts(self) -> dict[str, str]:
        rho = {"rho": f"rho={self.rho}"} if self.scheme == "generalized_alpha" else {}
        return {"scheme": SCHEMES[self.scheme][0], **rho}

    bounds = within_round_off

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        kernel, start = kernels("textbook"), principal_start(scene)
        model = kernel.Model(start.J, start.J_inverse, start.field, start.q, start.L)
        tableau = CROUCH_GROSSMAN_4 if self.scheme == "crouch_grossman" else RUNGE_KUTTA_4
        weights = np.array([[*row, *[0.0] * (len(tableau.b) - len(row))] for row in (*tableau.A, tableau.b)])
        alpha_m, alpha_f = (2 * self.rho - 1) / (self.rho + 1), self.rho / (self.rho + 1)
        gamma = 0.5 + alpha_f - alpha_m
        alpha = alpha_m, alpha_f, (gamma + 0.5) ** 2 / 4, gamma
        coefficients = kernel.Coefficients(list(SCHEMES).index(self.scheme), weights, np.array(tableau.c), alpha, grid.dt)
        return prepare_run(scene, grid, self.label, start, kernel, model, coefficients)
