"""Taylor series of any order, projected onto the invariants: a prototype for bodies in uniform gravity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from ..check import describe
from ..deferred_imports import kernels
from ..errors import BadInput
from ..method import Grid, Method, Role, Run
from ..potentials.uniform_gravity import UniformGravity
from ..scene import Scene
from ..trajectory import Bounds
from .bounds import bounds_of
from .principal_axes import PrincipalStart, principal_start
from .projected import invariant_scales
from .run_kernel import prepare_run
from .units import in_own_units

LOWEST, HIGHEST = 4, 20
"""Orders that the kernel has code for."""


@dataclass(frozen=True)
class Taylor(Method):
    """The series of the motion in powers of time, each step projected onto the invariants.

    Energy, vertical momentum and orthonormality are kept to round-off, since whatever a step loses of them is put back (Hairer,
    Lubich & Wanner, Geometric Numerical Integration, IV.4).

    Parameters
    ----------
    order
        Of the series, 4 to 20.

    Raises
    ------
    BadInput
        order is not an integer in that range.
    """

    order: int = 14  # type: ignore[assignment]

    family: ClassVar[str] = "taylor"
    role: ClassVar[Role] = Role.OURS
    kernel: ClassVar[str] = "taylor"

    def __post_init__(self) -> None:
        if not isinstance(self.order, int) or not LOWEST <= self.order <= HIGHEST:
            raise BadInput("order", describe(self.order), f"an integer from {LOWEST} to {HIGHEST}")

    @property
    def conserves(self) -> frozenset[str]:
        return frozenset({"energy", "vertical momentum", "momentum along the field's axis"})

    def bounds(self, scene: Scene, grid: Grid) -> Bounds:
        return bounds_of(scene, grid)

    def unsupported(self, scene: Scene) -> str | None:
        return None if isinstance(scene.potential, UniformGravity) else "it is for bodies in uniform gravity"

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        kernel, (label, start, model) = kernels("taylor"), scene.derive(convert, self)
        return prepare_run(scene, grid, label, start, kernel, model, kernel.Coefficients(self.order, grid.dt))


def convert(scene: Scene, method: Taylor) -> tuple[str, PrincipalStart, Any]:
    """Return the label of a run, its start in principal axes and the kernel's model of it."""
    start = principal_start(scene)
    moment = (start.field.x, start.field.y, start.field.z)
    model = kernels("taylor").Model(start.J, start.J_inverse, moment, invariant_scales(scene), start.q, start.L)
    return method.label, start, model
