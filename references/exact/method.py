"""Exact solutions of the free rigid body (Jacobi) and the Lagrange top (Klein & Sommerfeld) at any times.

The cost of a sample does not depend on its time. Constants of the motion are prepared in 500 bits, and samples are sums of a
few exponentials in double precision, accurate also near a separatrix or a pole: see `conservative.references.exact.theta`.
Arguments are taken as exact numbers, so the result is the rounded solution of exactly this problem.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from conservative.attitude import Array
from conservative.body import RigidBody
from conservative.check import describe, finite_array, real_array, rotation
from conservative.errors import BadInput, Unsupported
from conservative.features import Feature
from conservative.grid import Grid
from conservative.invariants import axial_direction
from conservative.method import Method, Role, Run
from conservative.method_info import MethodInfo
from conservative.methods.bounds import within_round_off
from conservative.potentials.potential import AnyPotential
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from .digits import MP_LOCK
from .free_body import free_motion
from .lagrange_top import top, top_motion
from .start import InitialState, Solution, in_blocks, steady_turn


def free_body(body: RigidBody, R_WB0: ArrayLike, w_WB_B0: ArrayLike, t: ArrayLike) -> tuple[Array, Array]:
    """Return the exact motion of a free rigid body.

    The body can be asymmetric, symmetric or spherical, in principal or other axes. The initial state can be on or near the
    separatrix.

    Parameters
    ----------
    body
        The body.
    R_WB0
        Attitude at t = 0: a rotation matrix (3, 3), body to world. The nearest unit quaternion is taken as exact.
    w_WB_B0
        Rates at t = 0 (3,), rad/s, body axes.
    t
        Times (n,), s, of either sign and in any order. Other shapes (...) give results (..., 3, 3) and (..., 3).

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
    Jacobi's solution as in van Zon & Schofield, J. Comput. Phys. 225 (2007) 145, with a theta function instead of the elliptic
    integral of the third kind; formulas in `conservative.references.exact.free_body`.
    """
    return _evaluate(body, None, R_WB0, w_WB_B0, t)


def lagrange_top(
    body: RigidBody, potential: UniformGravity, R_WB0: ArrayLike, w_WB_B0: ArrayLike, t: ArrayLike
) -> tuple[Array, Array]:
    """Return the exact motion of a symmetric body in uniform gravity, its centre of mass on the axis of symmetry.

    The top can nutate, precess steadily, sleep, hang, stand inverted, have no spin, and pass close to a pole or through it. A
    spherical body can have its centre of mass anywhere. Without weight or lever arm the body is free.

    Parameters
    ----------
    body
        The body. Its moments are equal, and its centre of mass is on the axis, to 1e-12.
    potential
        The field; weight and lever arm of either sign.
    R_WB0, w_WB_B0, t
        Attitude (3, 3) and rates (3,), rad/s, at t = 0, and times (n,), s, as in `free_body`, which also describes the results
        and the errors.

    Raises
    ------
    Unsupported
        The body is not symmetric about the line to its centre of mass.

    Notes
    -----
    Klein & Sommerfeld, Theorie des Kreisels, VI; formulas in `conservative.references.exact.lagrange_top`.
    """
    if not isinstance(potential, UniformGravity):
        raise BadInput("potential", describe(potential), "a UniformGravity")
    return _evaluate(body, potential, R_WB0, w_WB_B0, t)


def _evaluate(
    body: RigidBody, potential: UniformGravity | None, R_WB0: ArrayLike, w_WB_B0: ArrayLike, t: ArrayLike
) -> tuple[Array, Array]:
    if not isinstance(body, RigidBody):
        raise BadInput("body", describe(body), "a RigidBody")
    if reason := _reason(body, potential):
        raise Unsupported("potential", f"{potential!r} with {body!r}", f"a motion in closed form ({reason})")
    rates = finite_array("w_WB_B0", w_WB_B0, ((3,),), "three finite rates (3,), rad/s")
    start, array = InitialState(body, rotation("R_WB0", R_WB0), rates), real_array(t)
    # The array is None if t is not one of numbers, which the next line reports.
    times = finite_array("t", t, (() if array is None else array.shape,), "finite times (n,), s")
    with MP_LOCK:
        R_WB, w_WB_B = in_blocks(_motion(start, potential), times.ravel())
    return R_WB.reshape(*times.shape, 3, 3), w_WB_B.reshape(*times.shape, 3)


@dataclass(frozen=True)
class Exact(Method):
    """The closed form of a free body, a Lagrange top or a compound pendulum; dt is only the distance of samples.

    A compound pendulum swings about a principal axis that is exactly horizontal, with its centre of mass exactly in the plane.
    """

    family: ClassVar[str] = "exact"
    role: ClassVar[Role] = Role.TRUTH
    order = None
    conserves = frozenset({"energy", "momentum", "vertical momentum", "axial momentum"})
    method_info: ClassVar[MethodInfo] = MethodInfo(
        report=(), colour="black", supports=frozenset({Feature.GRAVITY, Feature.FLIGHT})
    )

    bounds = within_round_off

    def unsupported(self, scene: Scene) -> str | None:
        return _reason(_pendulum(scene) or scene.body, scene.potential)

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        start = InitialState(_pendulum(scene) or scene.body, scene.R_WB0, scene.w_WB_B0)
        with MP_LOCK:
            motion = _motion(start, scene.potential)

        def run() -> Trajectory:
            with MP_LOCK:
                R_WB, w_WB_B = in_blocks(motion, grid.t)
            return Trajectory(scene, grid.t, R_WB, w_WB_B, self.label, Counters(steps=0, evaluations=grid.n_samples))

        return run


def _pendulum(scene: Scene) -> RigidBody | None:
    """Return the spherical body that moves like a pendulum, with the moment about its axis; None for other scenes."""
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


def _motion(start: InitialState, potential: AnyPotential | None) -> Solution:
    axis = None if potential is None else axial_direction(start.body, potential)
    if not isinstance(potential, UniformGravity) or axis is None or not np.any(potential.moment_B):
        return steady_turn(start) if start.steady else free_motion(start)
    initial = top(start, potential.moment_B, axis)
    return steady_turn(start) if initial.upright else top_motion(initial)
