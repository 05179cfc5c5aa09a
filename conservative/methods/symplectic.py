"""Symplectic methods for a body in any field: splittings, and variational integrators on the rotation group."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from ..deferred_imports import kernels
from ..errors import BadInput
from ..features import FIELDS, IN_TIME, ROTATION, Feature
from ..grid import Grid
from ..invariants import AXIAL_MOMENTUM, MOMENTA
from ..method import Method, Role, Run
from ..method_info import MethodInfo, Structure
from ..scene import Scene
from .bounds import within_round_off
from .coefficients.compositions import COMPOSED, COMPOSITIONS
from .coefficients.splittings import Lengths, lengths_of
from .principal_axes import PrincipalStart, start_along
from .run_kernel import prepare_run
from .units import in_own_units


@dataclass(frozen=True)
class Splitting(Method):
    """Exact free rotations and kicks: explicit, symmetric and symplectic, of order 2 to 10, for a body in any field.

    A kick changes the momentum by the torque at a fixed attitude, L += b dt T. Between kicks the body rotates freely, without
    truncation error (Celledoni, Fassò, Säfström & Zanna, SIAM J. Sci. Comput. 30, 2008). The momentum about the field's axis
    and the axial momentum of a top are conserved to round-off. The energy is not, but at short steps its
    error is bounded and does not drift.

    Use it where the map has to be symplectic: at errors of 1e-3 to 1e-9 rad it takes 1.8 to 3.7 times as long as `Projected`,
    because each free rotation costs about 120 ns. Fields may depend on time: the torque is that at the time of the kick.

    Parameters
    ----------
    order
        2, 4, 6, 8 or 10.

    Raises
    ------
    BadInput
        An argument has another value.
    """

    order: int = 6

    family: ClassVar[str] = "splitting"
    role: ClassVar[Role] = Role.OURS
    method_info: ClassVar[MethodInfo] = MethodInfo(
        variants=tuple(f"order={order}" for order in COMPOSITIONS),
        report=("",),
        suite=(),
        kernel="symplectic",
        structure=lambda method: Structure(symmetric=True, symplectic=True),
        supports=FIELDS | IN_TIME | {Feature.ROTOR},
        removed={"composition": COMPOSED},
    )
    kind: ClassVar[str] = "EXACT"

    def __post_init__(self) -> None:
        _ = self.lengths  # checks the arguments

    @property
    def lengths(self) -> Lengths:
        """Rotations and kicks relative to the step."""
        return lengths_of(self.order, self.kind == "EXACT")

    @property
    def conserves(self) -> frozenset[str]:
        return frozenset(MOMENTA if self.kind == "AXES" else (*MOMENTA, AXIAL_MOMENTUM))

    bounds = within_round_off

    def unsupported(self, scene: Scene) -> str | None:
        if scene.body.rotor_momentum is None:
            return "it is for bodies in a field; MoserVeselov is exact" if scene.free and self.kind == "EXACT" else None
        return None

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        label, start, model = scene.derive(convert, self)
        return prepare_run(
            scene, grid, label, start, kernels("symplectic"), model, find_coefficients(self, grid.dt, start.rotor is None)
        )


@dataclass(frozen=True)
class NoSquish(Splitting):
    """Rotations about the principal axes in turn, and kicks: the integrator of molecular dynamics, explicit and symplectic.

    The free rotation of `Splitting` is replaced by rotations about the axes 3, 2, 1, 2, 3, ordered by their moments, as if
    the body had no other rate (Dullweber, Leimkuhler & McLachlan, J. Chem. Phys. 107, 1997; with quaternions Miller et al., J.
    Chem. Phys. 116, 2002). This step has order 2; symmetric compositions of it have order 4 to 10. The axial momentum of a top
    is not conserved. Rods need short steps, free ones, too: if the smallest moment is a fraction r of the others, the error is
    proportional to dt^2/r (see `Reduced`). Parameters and the rest are as for `Splitting`.
    """

    order: int = 2

    family: ClassVar[str] = "no_squish"
    method_info: ClassVar[MethodInfo] = replace(
        Splitting.method_info, supports=Splitting.method_info.supports | {Feature.FLIGHT}
    )
    kind: ClassVar[str] = "AXES"

    def follows_fastest(self, scene: Scene) -> bool:
        return True  # a rotation about one principal axis moves momentum to the axis of a rod, also of a free one


@dataclass(frozen=True)
class Rattle(Splitting):
    """RATTLE on SO(3): a discrete Moser-Veselov step between two half kicks; implicit in one 3-vector, symplectic, order 2.

    McLachlan & Scovel, J. Nonlinear Sci. 5 (1995); Hairer, Lubich & Wanner, Geometric Numerical Integration, VII.5. With body
    momentum L, torque T and the Cayley vector c of the step:

        l = L0 + (dt/2) T(Q0)        J c + c x J c = (dt/2) (1 + |c|^2) l
        Q1 = Q0 Cay(2 c)             L1 = Cay(2 c)' l + (dt/2) T(Q1)

    The Lie-group variational integrator of Lee, Leok & McClamroch (Comput. Methods Appl. Mech. Engrg. 196, 2007) with the
    trapezoidal rule for the potential is the same map. Without a field both are `MoserVeselov(order=2)`. Steps need |w| dt well
    below 1 rad. Compositions have order 4 to 10; parameters and the rest are as for `Splitting`.
    """

    order: int = 2

    method_info: ClassVar[MethodInfo] = replace(Splitting.method_info, supports=ROTATION | IN_TIME)
    family: ClassVar[str] = "rattle"
    kind: ClassVar[str] = "ENDS"

    def longest_step(self, scene: Scene) -> float:
        speed = float(np.linalg.norm(scene.w_WB_B0))
        return 0.99 / speed if speed > 0 else math.inf  # c of a steady spin has no solution beyond 1 rad

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        if grid.dt > (longest := self.longest_step(scene)):
            raise BadInput("dt", f"{grid.dt:g}", f"a step of less than 1 rad at the initial rate: at most {longest:.6g} s")
        return super().prepare(scene, grid)


@dataclass(frozen=True)
class LieVariational(Rattle):
    """The Lie-group variational integrator with the potential in the middle of the step; implicit, symplectic, order 2.

    The discrete Lagrangian has the kinetic energy of Moser & Veselov (1991), as in Lee, Leok & McClamroch (2007), whose
    trapezoidal rule gives `Rattle`. Here the potential is evaluated at the attitude after half the rotation of the step, and
    its torque T acts on both ends. With a of the length tan(angle/4) along the axis of the step's rotation:

        l = L0 + (dt/2) (T + a x T)                  J c + c x J c = (dt/2) (1 + |c|^2) l,  c = 2 a / (1 - |a|^2)
        L1 = Cay(2 c)' l + (dt/2) (T - a x T)        Q1 = Q0 Cay(2 c)

    The torque depends on the unknown, so a step needs several evaluations. Everything else is as for `Rattle`.
    """

    family: ClassVar[str] = "lie_variational"
    kind: ClassVar[str] = "MIDDLE"

    def follows_fastest(self, scene: Scene) -> bool:
        return not scene.free  # its torque in the middle acts on both ends, which only at short steps leaves the axis alone


def convert(scene: Scene, method: Splitting) -> tuple[str, PrincipalStart, Any]:
    """Return the label of a run, its initial state in principal axes, the second intermediate, and the kernel's model."""
    order, kernel = np.argsort(scene.body.moments, kind="stable"), kernels("symplectic")
    R_PS = np.eye(3)[:, order]
    R_PS[:, 2] *= np.linalg.det(R_PS)
    start = start_along(scene, scene.body.R_BP @ R_PS, scene.body.moments[order])
    kind = getattr(kernel, method.kind)
    return method.label, start, kernel.Model(start.J, start.J_inverse, start.field, start.q, start.L, kind, start.rotor)


@lru_cache(maxsize=256)
def find_coefficients(method: Splitting, dt: float, exact: bool) -> Any:
    """Return the kernel's coefficients of a step dt, s. Without `exact` free rotations it is a composition of order 2."""
    rotations, kicks = method.lengths if exact else lengths_of(method.order, exact=False)
    if method.kind == "MIDDLE":
        kicks = (0 * kicks[0],) * len(kicks)
    nodes = itertools.accumulate(rotations)
    return kernels("symplectic").Coefficients(
        *(np.array([float(x) * dt for x in parts]) for parts in (rotations, kicks, nodes)), dt
    )
