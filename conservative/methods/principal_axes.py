"""Conversion of initial states to principal axes, for all compiled methods.

Kernels use a diagonal inertia, the attitude `R_WP` as a quaternion (scalar first) and the momentum `L_P`. The axes P can also
belong to the non-spinning frame (`conservative.methods.non_spinning`); the spin is then added to the samples.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..attitude import Array, Triple, axes_about, triple
from ..deferred_imports import kernels
from ..errors import BadInput
from ..invariants import jacobi_scale, largest_momentum
from ..potentials.load import load_field
from ..potentials.potential import depends_on_time
from ..potentials.turning import Orbit, Turning
from ..potentials.uniform_gravity import UniformField
from ..scene import Scene
from .non_spinning import Resolved

Quadruple = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class PrincipalStart:
    """The initial state of a scene for kernels: tuples of floats, principal axes.

    Attributes
    ----------
    J, J_inverse
        Moments of inertia that the kernel uses, kg m^2, and their inverses.
    q, L
        Initial attitude, scalar first, and initial momentum, kg m^2/s.
    R_BP
        Rotation (3, 3) from the kernel's axes to body axes; None if they are the same.
    field
        Parameters of the potential in the kernel's axes; None for a free body.
    rotor
        Momentum of the rotor, kg m^2/s; None without one, or if `field` has it with its motor. `L` does not contain it.
    spin
        In the non-spinning frame, the omitted rate about the third axis, rad/s, and 1/J3; otherwise None.
    orbit
        The `Orbit` to whose axes `q` and the samples are relative; None if they are relative to the world.
    """

    J: Triple
    J_inverse: Triple
    q: Quadruple
    L: Triple
    R_BP: Array | None
    field: Any
    rotor: Triple | None = None
    spin: tuple[float, float] | None = None
    orbit: Orbit | None = None

    def axes(self, dt: float) -> Array:
        """Return the numbers by which samples with steps dt, s, are converted to body axes (`kernels.samples.gather_axes`)."""
        axes: Array = kernels("samples").gather_axes(self.J_inverse, self.spin, self.R_BP, self.orbit, dt)
        return axes


def principal_start(scene: Scene, frame: Resolved = "body") -> PrincipalStart:
    """Return the initial state of a scene in principal axes, or in the non-spinning frame. Raise `BadInput` as `slow_axes`."""
    if frame == "body":
        return start_along(scene, scene.body.R_BP, scene.body.moments)
    axes, J1, J3 = slow_axes(scene)
    start = start_along(scene, axes, np.array((J1, J1, J3)))
    upright = start.field and start.field._replace(x=0.0, y=0.0)  # along the axis, up to round-off
    spin = (spin_rate(J1, J3, start.L[2]), 1 / J3)
    return replace(start, J=(J1, J1, J1), J_inverse=(1 / J1, 1 / J1, 1 / J1), field=upright, spin=spin)


def slow_axes(scene: Scene) -> tuple[Array, float, float]:
    """Return the axes (3, 3) of the non-spinning frame, body components, and the moments across and along the third, kg m^2.

    Raise `BadInput` if body and field are not symmetric about one axis.
    """
    axis_B = scene.symmetry_axis_B
    if axis_B is None:
        raise BadInput("frame", f"'non_spinning' for the scene {scene.name!r}", "a scene symmetric about one axis")
    J = np.roll(scene.body.moments, 2 - int(np.argmax(np.abs(axis_B @ scene.body.R_BP))))
    return axes_about(axis_B), float(J[0] + J[1]) / 2, float(J[2])


def spin_rate(J1: Any, J3: Any, L3: Any) -> Any:
    """Return the omitted rate about the axis, rad/s, from moments, kg m^2, and the momentum along the axis, kg m^2/s."""
    return (J1 - J3) / (J1 * J3) * L3


def start_along(scene: Scene, R_BP: Array, moments: Array) -> PrincipalStart:
    """Return the initial state in the axes R_BP (3, 3), in which the body has the moments (3,), kg m^2."""
    L = (scene.w_WB_B0 @ R_BP) * moments
    field = None if scene.potential is None else scene.potential.kernel_field(R_BP)
    if scene.loaded:
        field = load_field(field or UniformField(0.0, 0.0, 0.0), scene.torque, scene.damping, R_BP, scene.body.motor)
    turned = None if np.array_equal(R_BP, np.eye(3)) else np.ascontiguousarray(R_BP)
    rotor = None if scene.body.motor else scene.body.rotor_along(R_BP)
    q = quadruple(scene.R_WB0 @ R_BP)
    return PrincipalStart(triple(moments), triple(1 / moments), q, triple(L), turned, field, rotor)


def quadruple(R: Array) -> Quadruple:
    """Return `attitude.to_quaternion` of one rotation (3, 3) as the tuple of floats that kernels take.

    In floats of Python, bit for bit: the arrays of the general function take 20 us.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = R.tolist()
    squares = (1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz)
    wx, wy, wz, sxy, sxz, syz = zy - yz, xz - zx, yx - xy, xy + yx, xz + zx, yz + zy
    largest = squares.index(max(squares))
    w, x, y, z = (
        (squares[0], wx, wy, wz),
        (wx, squares[1], sxy, sxz),
        (wy, sxy, squares[2], syz),
        (wz, sxz, syz, squares[3]),
    )[largest]
    n = math.sqrt(w * w + x * x + y * y + z * z)
    n = -n if w < 0 else n
    return w / n, x / n, y / n, z / n


def field_axis(scene: Scene) -> Triple | None:
    """Return the axis about which the field is symmetric, three floats in world axes, or None."""
    axis = None if scene.potential is None else scene.potential.axis_W
    return None if axis is None else triple(axis / np.linalg.norm(axis))


def invariant_scales(scene: Scene) -> tuple[float, float]:
    """Return the reference scales of energy, J, and momentum, kg m^2/s: the largest momentum that the energy allows.

    The first is inf if neither energy nor Jacobi integral is conserved.
    """
    energy, potential = scene.energy_scale, scene.potential
    momentum = largest_momentum(scene.body, energy)
    if isinstance(potential, Turning) and not scene.body.motor:
        return jacobi_scale(scene.body, potential, energy), momentum
    return math.inf if depends_on_time(potential) or scene.body.motor else energy, momentum
