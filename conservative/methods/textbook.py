"""Methods from textbooks and game engines, as baselines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple

import numpy as np

from ..check import choice, describe, finite_number
from ..deferred_imports import kernels
from ..errors import BadInput
from ..features import IN_TIME, ROTATION
from ..grid import Grid
from ..invariants import AXIAL_MOMENTUM, MOMENTA
from ..method import Method, Role, Run
from ..method_info import MethodInfo, Structure
from ..scene import Scene
from .bounds import within_round_off
from .coefficients.explicit import CROUCH_GROSSMAN_4, RUNGE_KUTTA_4, ExplicitTableau
from .principal_axes import principal_start
from .run_kernel import prepare_run
from .units import in_own_units

Scheme = Literal["rkmk", "crouch_grossman", "generalized_alpha", "buss", "gyroscopic", "spiers", "spiers_rates"]
_RADIUS = "a spectral radius from 0 to 1"
_IN_WORLD, _AXIAL = frozenset(MOMENTA), frozenset({AXIAL_MOMENTUM})


class Formula(NamedTuple):
    """The definition of a scheme: its title in tables, its order, and the tableau if it is a Runge-Kutta method.

    `kernel` is the name of its number in `conservative.kernels.textbook`, and `conserves` is as in `Method`.
    """

    title: str
    kernel: str
    order: int
    conserves: frozenset[str] = _AXIAL
    tableau: ExplicitTableau | None = None


def by_tableau(title: str, kernel: str, tableau: ExplicitTableau) -> Formula:
    """Return the scheme of a tableau, whose order it has, because its exponentials do not lower it."""
    return Formula(title, kernel, tableau.order, tableau=tableau)


SCHEMES = {
    "rkmk": by_tableau("RKMK 4", "MUNTHE_KAAS", RUNGE_KUTTA_4),
    "crouch_grossman": by_tableau("Crouch-Grossman 4", "CROUCH_GROSSMAN", CROUCH_GROSSMAN_4),
    "generalized_alpha": Formula("generalised-alpha", "GENERALIZED_ALPHA", 2),
    "buss": Formula("Buss 3", "BUSS", 3, _IN_WORLD),
    "gyroscopic": Formula("explicit gyroscopic step", "GYROSCOPIC", 1),
    "spiers": Formula("Spiers 1", "SPIERS", 1, _IN_WORLD | _AXIAL),
    "spiers_rates": Formula("Spiers 1, rates first", "SPIERS_RATES", 1),
}


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
        return SCHEMES[self.scheme].order

    @property
    def conserves(self) -> frozenset[str]:
        return SCHEMES[self.scheme].conserves

    @property
    def setting_parts(self) -> dict[str, str]:
        rho = {"rho": f"rho={self.rho}"} if self.scheme == "generalized_alpha" else {}
        return {"scheme": SCHEMES[self.scheme].title, **rho}

    bounds = within_round_off

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        kernel, start = kernels("textbook"), principal_start(scene)
        model = kernel.Model(start.J, start.J_inverse, start.field, start.q, start.L)
        formula = SCHEMES[self.scheme]
        tableau = formula.tableau or RUNGE_KUTTA_4  # other schemes do not use it
        weights = np.array([[*row, *[0.0] * (len(tableau.b) - len(row))] for row in (*tableau.A, tableau.b)])
        alpha_m, alpha_f = (2 * self.rho - 1) / (self.rho + 1), self.rho / (self.rho + 1)
        gamma = 0.5 + alpha_f - alpha_m
        alpha = alpha_m, alpha_f, (gamma + 0.5) ** 2 / 4, gamma
        coefficients = kernel.Coefficients(getattr(kernel, formula.kernel), weights, np.array(tableau.c), alpha, grid.dt)
        return prepare_run(scene, grid, self.label, start, kernel, model, coefficients)
