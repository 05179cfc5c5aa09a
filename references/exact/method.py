"""Exact solutions: the free rigid body and the Lagrange top, at any times at once.

Each time costs the same, however late. What belongs to the motion as a whole is prepared in 500 bits, and the samples are sums
of a few exponentials in double precision; `conservative.references.exact.theta` says why neither a separatrix nor a pole harms
them. The inputs are taken as exact numbers: what the functions return is the solution of the problem as handed in, rounded.
Sources: Jacobi for the free body, Klein & Sommerfeld for the top; see the functions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from conservative.attitude import Array
from conservative.body import RigidBody
from conservative.card import Card
from conservative.check import describe, finite_array, real_array, rotation
from conservative.errors import BadInput, Unsupported
from conservative.grid import Grid
from conservative.invariants import axial_direction
from conservative.method import Method, Role, Run
from conservative.methods.bounds import bounds_of
from conservative.potentials.potential import AnyPotential
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene
from conservative.trajectory import Bounds, Counters, Trajectory

from .digits import MP_LOCK
from .free_body import free_motion
from .lagrange_top import top, top_motion
from .motion import ClosedForm, in_blocks, steady_turn
from .start import Start


def free_body(body: RigidBody, R_WB0: ArrayLike, w_WB_B0: ArrayLike, t: ArrayLike) -> tuple[Array, Array]:
    """Return the exact motion of a free rigid body.

    Any body: asymmetric, symmetric or spherical, in principal or other axes. Any start: the separatrix and its neighbourhood
    too.

    Parameters
    ----------
    body
        The body.
    R_WB0
        Attitude at t = 0: a rotation matrix (3, 3), body to world. Taken as the unit quaternion next to it.
    w_WB_B0
        Rates at t = 0 (3,), rad/s, body axes.
    t
        Times (n,), s, of either sign and in any order; other shapes come back in front of (3, 3) and (3,).

    Returns
    -------
    R_WB
        Attitudes (n, 3, 3), body to world.
    w_WB_B
        Rates (n, 3), rad/s, body axes.

    Raises
    ------
    BadInput
        An argument is not finite, has another shape, or is not a rotation.

    Notes
    -----
    Jacobi's solution, split as by van Zon & Schofield, J. Comput. Phys. 225 (2007) 145, with a theta function in place of the
    elliptic integral of the third kind; formulas in `conservative.references.exact.free_body`.
    """
    start, times = _start(body, R_WB0, w_WB_B0), _times(t)
    with MP_LOCK:
        return _evaluate(_free_motion(start), times)


def lagrange_top(
    body: RigidBody, potential: UniformGravity, R_WB0: ArrayLike, w_WB_B0: ArrayLike, t: ArrayLike
) -> tuple[Array, Array]:
    """Return the exact motion of a symmetric body in uniform gravity, its centre of mass on the axis of symmetry.

    Any start: nutating, steady, sleeping, without spin, hanging, inverted, next to a pole or through it. A spherical body may
    have its centre of mass anywhere; without weight or lever any body is a free one.

    Parameters
    ----------
    body
        The body. Two moments are taken as equal, and the centre of mass as on the axis, where they are so to 1e-12.
    potential
        The field; weight and lever of either sign.
    R_WB0, w_WB_B0, t
        Attitude (3, 3) and rates (3,), rad/s, at t = 0, and times (n,), s, as in `free_body`.

    Returns
    -------
    R_WB
        Attitudes (n, 3, 3), body to world.
    w_WB_B
        Rates (n, 3), rad/s, body axes.

    Raises
    ------
    BadInput
        An argument is not finite, has another shape, or is not a rotation.
    Unsupported
        The body is not symmetric about the line to its centre of mass.

    Notes
    -----
    Klein & Sommerfeld, Theorie des Kreisels, VI; formulas in `conservative.references.exact.lagrange_top`.
    """
    start, times = _start(body, R_WB0, w_WB_B0), _times(t)
    if not isinstance(potential, UniformGravity):
        raise BadInput("potential", describe(potential), "a UniformGravity")
    reason = _reason(body, potential)
    if reason:
        raise Unsupported("potential", f"{potential!r} with {body!r}", f"a motion in closed form ({reason})")
    with MP_LOCK:
        return _evaluate(_motion(start, potential), times)


@dataclass(frozen=True)
class Exact(Method):
    """The closed form of a free body, a Lagrange top or a compound pendulum; dt is only the distance of samples.

    A pendulum is any body that swings about a principal axis, exactly horizontal, with its centre of mass exactly in the plane.
    """

    family: ClassVar[str] = "exact"
    role: ClassVar[Role] = Role.TRUTH
    card: ClassVar[Card] = Card(report=(), colour="black")

    @property
    def order(self) -> None:
        return None

    @property
    def conserves(self) -> frozenset[str]:
        return frozenset({"energy", "momentum", "vertical momentum", "axial momentum"})

    def bounds(self, scene: Scene, grid: Grid) -> Bounds:
        return bounds_of(scene, grid)

    def unsupported(self, scene: Scene) -> str | None:
        return _reason(_pendulum(scene) or scene.body, scene.potential)

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        start = Start(_pendulum(scene) or scene.body, scene.R_WB0, scene.w_WB_B0)
        with MP_LOCK:
            motion = _motion(start, scene.potential)

        def run() -> Trajectory:
            with MP_LOCK:
                R_WB, w_WB_B = in_blocks(motion, grid.t)
            return Trajectory(scene, grid.t, R_WB, w_WB_B, self.label, Counters(steps=0, evaluations=grid.n_samples))

        return run


def _pendulum(scene: Scene) -> RigidBody | None:
    """Return the spherical body that moves as a pendulum does: with the moment about its axis all round; None for others."""
    field, body = scene.potential, scene.body
    if not isinstance(field, UniformGravity):
        return None
    w_P, moment_P, heights = scene.w_WB_B0 @ body.R_BP, field.moment_B @ body.R_BP, scene.R_WB0[2] @ body.R_BP
    for axis in range(3):
        if moment_P[axis] == heights[axis] == 0 and not np.any(np.delete(w_P, axis)):
            return RigidBody(np.full(3, body.moments[axis]))
    return None


def _reason(body: RigidBody, potential: AnyPotential | None) -> str | None:
    """Return why there is no closed form, None if there is one."""
    if potential is None:
        return None
    if not isinstance(potential, UniformGravity):
        return f"closed forms are for no field and for uniform gravity, not for {type(potential).__name__}"
    if np.any(potential.moment_B) and axial_direction(body, potential) is None:
        return "in gravity the body must be symmetric about the line from the fixed point to its centre of mass"
    return None


def _start(body: RigidBody, R_WB0: ArrayLike, w_WB_B0: ArrayLike) -> Start:
    if not isinstance(body, RigidBody):
        raise BadInput("body", describe(body), "a RigidBody")
    return Start(body, rotation("R_WB0", R_WB0), finite_array("w_WB_B0", w_WB_B0, ((3,),), "three finite rates (3,), rad/s"))


def _free_motion(start: Start) -> ClosedForm:
    return steady_turn(start) if start.steady else free_motion(start)


def _motion(start: Start, potential: AnyPotential | None) -> ClosedForm:
    axis = None if potential is None else axial_direction(start.body, potential)
    if not isinstance(potential, UniformGravity) or axis is None or not np.any(potential.moment_B):
        return _free_motion(start)
    begun = top(start, potential.moment_B, axis)
    return steady_turn(start) if begun.upright else top_motion(begun)


def _times(t: ArrayLike) -> Array:
    found = real_array(t)  # what is no array of numbers is refused below
    shape = () if found is None else found.shape
    return finite_array("t", t, (shape,), "finite times (n,), s")


def _evaluate(motion: ClosedForm, times: Array) -> tuple[Array, Array]:
    R_WB, w_WB_B = in_blocks(motion, times.ravel())
    return R_WB.reshape(*times.shape, 3, 3), w_WB_B.reshape(*times.shape, 3)
