"""Free flight: a free body in uniform gravity or none, whose frame B is off its centre of mass C.

    c(t) = c(0) + c'(0) t - g t^2/2 e_z     p_WB = c - R_WB com_B     v_WB = c' - R_WB (w x com_B)

Gravity exerts no torque about C, so the body rotates like a free body, and C moves on a parabola. Methods of this package
integrate the rotation only. Engines integrate both, in the coordinates of their free joint.

Source: any mechanics textbook, such as Goldstein, Classical Mechanics, sections 1.2 and 4.9.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from .attitude import Array
from .body import RigidBody
from .check import describe, finite_array
from .errors import BadInput
from .features import Feature, Features
from .invariants import MOMENTUM_UNIT, InvariantInTime
from .potentials.uniform_gravity import UniformGravity
from .shapes import MassDistribution


@dataclass(frozen=True, eq=False)
class Flight:
    """The translation of a scene in free flight, made by `Scene` from a `MassDistribution`, `p_WB0` and `v_WB0`.

    Attributes
    ----------
    mass, com_B
        Mass, kg, and centre of mass (3,) from the origin of the body frame, m, body axes.
    g
        Downward acceleration, m/s^2.
    p_WB0, v_WB0
        Position (3,), m, and velocity (3,), m/s, of the origin of the body frame at t = 0, world axes.
    """

    mass: float
    com_B: Array
    g: float
    p_WB0: Array
    v_WB0: Array
    features: ClassVar[Features] = frozenset({Feature.FLIGHT})

    def centre(self, R_WB: Array, w_WB_B: Array, p_WB: Array, v_WB: Array) -> tuple[Array, Array]:
        """Return position (n, 3), m, and velocity (n, 3), m/s, of the centre of mass, world axes.

        The state of the frame is R_WB (n, 3, 3), w_WB_B (n, 3), rad/s, body axes, p_WB (n, 3) and v_WB (n, 3), world axes.
        """
        arm, slope = self._arm(R_WB, w_WB_B)
        return p_WB + arm, v_WB + slope

    def _arm(self, R_WB: Array, w_WB_B: Array) -> tuple[Array, Array]:
        """Return the centre of mass from the frame's origin (n, 3), m, and its derivative, m/s, world axes."""
        return R_WB @ self.com_B, (R_WB @ np.cross(w_WB_B, self.com_B)[..., None])[..., 0]

    def fall(self, scene: Any, t: Array) -> tuple[Array, Array]:
        """Return the exact position (n, 3), m, and velocity (n, 3), m/s, of the centre of mass at times (n,), s, world axes."""
        start = scene.R_WB0[None], scene.w_WB_B0[None], self.p_WB0[None], self.v_WB0[None]
        return self.fall_from(*self.centre(*start), t)

    def fall_from(self, c: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """Return the result of `fall` for other initial positions c and velocities v of the centre, (1, 3) or (n, 3)."""
        gt = np.outer(t, (0.0, 0.0, -self.g))
        return c + t[:, None] * (v + gt / 2), v + gt

    def follow(self, centre: tuple[Array, Array], R_WB: Array, w_WB_B: Array) -> tuple[Array, Array]:
        """Return position (n, 3), m, and velocity (n, 3), m/s, of the frame from the result of `centre`, which it inverts."""
        arm, slope = self._arm(R_WB, w_WB_B)
        return centre[0] - arm, centre[1] - slope

    def invariants(self, scene: Any) -> tuple[InvariantInTime, ...]:
        """Return linear momentum, angular momentum about the world's origin, and total energy.

        Gravity changes the first two by an impulse that is known exactly: m g t downwards. Its moment is as if all of it acted
        at the position of the centre of mass at t/2. Both are subtracted, so that the rest is constant.
        """
        m, down = self.mass, np.array([0.0, 0.0, -self.g])
        # Reference scales follow from bounds: the speed of any point of the frame, and the distance of the centre of mass.
        (c0,), (v0,) = self.fall(scene, np.zeros(1))
        gained = abs(self.g) * scene.t_end
        speed = float(np.linalg.norm(v0) + gained + np.linalg.norm(scene.w_WB_B0) * np.linalg.norm(self.com_B))
        reach = float(np.linalg.norm(c0) + (np.linalg.norm(v0) + gained / 2) * scene.t_end)
        spin = float(np.linalg.norm(scene.body.momentum(scene.w_WB_B0)))

        def linear(R: Array, w: Array, p: Array, v: Array, t: Array) -> Array:
            return m * (self.centre(R, w, p, v)[1] - np.outer(t, down))

        def angular(R: Array, w: Array, p: Array, v: Array, t: Array) -> Array:
            c, velocity = self.centre(R, w, p, v)
            # The parabola is c0 + v0 t + down t^2 / 2. Its last part has no moment, because it is along the force.
            impulse = np.cross(np.outer(t, c0) + np.outer(t * t / 2, v0), m * down)
            return (R @ scene.body.momentum(w)[..., None])[..., 0] + m * np.cross(c, velocity) - impulse

        def energy(R: Array, w: Array, p: Array, v: Array, t: Array) -> Array:
            c, velocity = self.centre(R, w, p, v)
            rotation = np.sum(scene.body.momentum(w) * w, axis=-1) / 2
            return np.asarray(rotation + m * (np.sum(velocity * velocity, axis=-1) / 2 - c @ down))

        whole = scene.kinetic_energy0 + m * (speed * speed / 2 + abs(self.g) * reach)
        return (
            InvariantInTime("linear momentum", "kg m/s", m * speed or 1.0, linear),
            InvariantInTime("momentum about the origin", MOMENTUM_UNIT, spin + m * speed * reach or 1.0, angular),
            InvariantInTime("total energy", "J", whole or 1.0, energy),
        )


def read_flight(body: object, potential: object, p_WB0: ArrayLike | None, v_WB0: ArrayLike | None) -> tuple[RigidBody, Flight]:
    """Return the inertia about the centre of mass and the translation of a scene in free flight. Raise `BadInput`."""
    if not isinstance(body, MassDistribution):
        allowed = "with p_WB0 or v_WB0 a MassDistribution, such as shapes.box(size, mass=2).about(com_B)"
        raise BadInput("body", describe(body), allowed)
    g = 0.0
    if potential is not None:
        same = isinstance(potential, UniformGravity) and np.allclose(potential.com_B, body.com_B, rtol=1e-12, atol=0)
        if not isinstance(potential, UniformGravity) or not same:
            allowed = "with p_WB0 or v_WB0 None or the gravity of the body, such as body.gravity(9.81)"
            raise BadInput("potential", describe(potential), allowed)
        g = potential.weight / body.mass
    start = [
        finite_array(name, np.zeros(3) if value is None else value, ((3,),), f"three finite numbers (3,), {unit}, world axes")
        for name, value, unit in (("p_WB0", p_WB0, "m"), ("v_WB0", v_WB0, "m/s"))
    ]
    return RigidBody(body.inertia_com), Flight(body.mass, body.com_B, g, *start)
