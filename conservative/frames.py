"""The frame that does not spin: a symmetric body is integrated without its spin, which is added in closed form.

For J1 = J2 and a torque without component along the axis, L3 is constant and the frame R_WS with

    R_WB = R_WS Rot(axis, rate t)        rate = (1/J3 - 1/J1) L3

turns with L/J1: it moves like a SPHERICAL body of inertia J1 in the same field, started with the same momentum. So the slow
motion is a scene of its own, which any method can run, and `SpinFreeScene.trajectory` puts the spin back. Steps are then
limited by nutation and no longer by spin.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .attitude import Array, hat
from .body import RigidBody
from .errors import BadInput
from .invariants import axial_direction
from .scene import Scene
from .trajectory import Trajectory

Frame = Literal["auto", "body", "non_spinning"]
FRAMES: tuple[Frame, ...] = ("auto", "body", "non_spinning")


@lru_cache(maxsize=256)
def resolved(frame: Frame, scene: Scene) -> Literal["body", "non_spinning"]:
    """Return the frame that "auto" stands for: "non_spinning" where body and field share an axis of symmetry and it saves work.

    The label of the run is then that of `replace(method, frame=resolved(method.frame, scene))`, so that the choice is seen.
    """
    if frame != "auto":
        return frame
    moments = scene.body.moments
    spherical = np.ptp(moments) <= 1e-14 * moments.max()
    return "body" if spherical or axial_direction(scene.body, scene.potential) is None else "non_spinning"


@lru_cache(maxsize=256)
def frame_unsupported(frame: Frame, scene: Scene) -> str | None:
    """Return why the scene cannot be integrated in `frame`, None if it can."""
    if frame == "non_spinning" and axial_direction(scene.body, scene.potential) is None:
        return "frame non_spinning needs body and field symmetric about one axis"
    return None


@dataclass(frozen=True, eq=False)
class SpinFreeScene:
    """A scene without its spin.

    Attributes
    ----------
    spinning
        The scene itself.
    scene
        The slow motion: a spherical body of inertia J1 in the same field with the same attitude and momentum at t = 0.
    axis_B
        Unit vector (3,) of the axis of symmetry, body axes, to the side of the centre of mass.
    J1, J3
        Moments about a transverse axis and about the axis, kg m^2.
    rate
        What the body turns by about its axis against the slow frame, rad/s.
    """

    spinning: Scene
    scene: Scene
    axis_B: Array
    J1: float
    J3: float
    rate: float

    def spin(self, t: ArrayLike) -> Array:
        """Return Rot(axis, rate t), (..., 3, 3), at times t (...), s."""
        angle = self.rate * np.asarray(t, dtype=float)[..., None, None]
        n = hat(self.axis_B)
        # 1 - cos as 2 sin^2 of the half angle, which keeps small angles.
        return np.eye(3) + np.sin(angle) * n + 2 * np.sin(angle / 2) ** 2 * (n @ n)

    def state(self, t: Array, R_WS: Array, w_WS_S: Array) -> tuple[Array, Array]:
        """Return attitudes (n, 3, 3) and rates (n, 3), body axes, from those of the slow frame at times t (n,)."""
        spin = self.spin(t)
        w_SB = np.einsum("nji,nj->ni", spin, w_WS_S)
        axial = (w_SB @ self.axis_B)[:, None] * self.axis_B
        return R_WS @ spin, w_SB + (self.J1 / self.J3 - 1) * axial

    def trajectory(self, slow: Trajectory, label: str) -> Trajectory:
        """Return the trajectory of the body from that of `scene`."""
        R_WB, w_WB_B = self.state(slow.t, slow.R_WB, slow.w_WB_B)
        return replace(slow, scene=self.spinning, R_WB=R_WB, w_WB_B=w_WB_B, label=label)


@lru_cache(maxsize=256)
def without_spin(scene: Scene) -> SpinFreeScene:
    """Return the slow motion of a symmetric body, free or in a field along its axis.

    Raises
    ------
    BadInput
        Body and field are not symmetric about one axis.
    """
    axis_B = axial_direction(scene.body, scene.potential)
    if axis_B is None:
        raise BadInput("frame", f"'non_spinning' for the scene {scene.name!r}", "a scene symmetric about one axis")
    J3 = float(axis_B @ scene.body.inertia @ axis_B)
    J1 = (float(np.trace(scene.body.inertia)) - J3) / 2
    L3 = float(axis_B @ scene.body.momentum(scene.w_WB_B0))
    w_WS_S = scene.body.momentum(scene.w_WB_B0) / J1
    slow = replace(scene, body=RigidBody((J1, J1, J1)), w_WB_B0=w_WS_S, extra_invariants=())
    return SpinFreeScene(scene, slow, axis_B, J1, J3, (J1 - J3) / (J1 * J3) * L3)
