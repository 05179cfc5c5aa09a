"""To principal axes and back: the one conversion that all compiled methods share.

Kernels see a diagonal inertia, the attitude `R_WP` as a quaternion (scalar first) and the momentum `L_P`. Their axes P can be
those of the frame that does not spin (`conservative.methods.non_spinning`); the spin is then added to the samples. Source:
definitions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..attitude import Array, axes_about, to_quaternion, triple
from ..attitude import Triple as Triple
from ..errors import BadInput
from ..invariants import jacobi_scale
from ..potentials.potential import depends_on_time
from ..potentials.turning import Turning
from ..scene import Scene
from .non_spinning import Resolved

Quadruple = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class PrincipalStart:
    """A scene's start as kernels take it: floats in tuples, principal axes.

    Attributes
    ----------
    J, J_inverse
        Moments of what the kernel moves, kg m^2, and their inverses.
    q, L
        Attitude, scalar first, and momentum, kg m^2/s, at the start.
    R_BP
        Rotation (3, 3) from the kernel's axes to those of the body; None where they are the same.
    field
        Parameters of the potential in the kernel's axes, None without one.
    spin
        Where the third axis is one of symmetry and its spin is left out: the rate of that, rad/s, and 1/J3. Else None.
    """

    J: Triple
    J_inverse: Triple
    q: Quadruple
    L: Triple
    R_BP: Array | None
    field: Any
    spin: tuple[float, float] | None = None


def principal_start(scene: Scene, frame: Resolved = "body") -> PrincipalStart:
    """Return the scene's start in principal axes, or in the frame that does not spin.

    Raises
    ------
    BadInput
        frame is "non_spinning", and body and field are not symmetric about one axis.
    """
    if frame == "body":
        return start_along(scene, scene.body.R_BP, scene.body.moments)
    axis_B = scene.symmetry_axis_B
    if axis_B is None:
        raise BadInput("frame", f"'non_spinning' for the scene {scene.name!r}", "a scene symmetric about one axis")
    J = np.roll(scene.body.moments, 2 - int(np.argmax(np.abs(axis_B @ scene.body.R_BP))))
    J1, J3 = float(J[0] + J[1]) / 2, float(J[2])
    start = start_along(scene, axes_about(axis_B), np.array((J1, J1, J3)))
    upright = start.field and start.field._replace(x=0.0, y=0.0)  # along the axis but for round-off
    spin = ((J1 - J3) / (J1 * J3) * start.L[2], 1 / J3)
    return replace(start, J=(J1, J1, J1), J_inverse=(1 / J1, 1 / J1, 1 / J1), field=upright, spin=spin)


def start_along(scene: Scene, R_BP: Array, moments: Array) -> PrincipalStart:
    """Return the start in axes (3, 3) along which the scene's body has these moments (3,), kg m^2."""
    L = (scene.w_WB_B0 @ R_BP) * moments
    field = None if scene.potential is None else scene.potential.kernel_field(R_BP)
    turned = None if np.array_equal(R_BP, np.eye(3)) else np.ascontiguousarray(R_BP)
    return PrincipalStart(triple(moments), triple(1 / moments), quadruple(scene.R_WB0 @ R_BP), triple(L), turned, field)


def quadruple(R: Array) -> Quadruple:
    """Return the quaternion of a rotation (3, 3) as the tuple of floats that kernels take."""
    w, x, y, z = to_quaternion(R).tolist()
    return w, x, y, z


def field_axis(scene: Scene) -> Triple | None:
    """Return the axis about which the field is symmetric, three floats in world axes, or None."""
    axis = None if scene.potential is None else scene.potential.axis_W
    return None if axis is None else triple(axis / np.linalg.norm(axis))


def invariant_scales(scene: Scene) -> tuple[float, float]:
    """Return what errors of energy, J, and momentum, kg m^2/s, are relative to: the latter is what all that energy makes.

    The first is inf where neither energy nor Jacobi integral is conserved.
    """
    energy, potential = scene.energy_scale, scene.potential
    momentum = math.sqrt(2 * energy * float(scene.body.moments.max()))
    if isinstance(potential, Turning):
        return jacobi_scale(scene.body, potential, energy), momentum
    return math.inf if depends_on_time(potential) else energy, momentum
