"""The motion of a user's body as a motion of the verification, with tolerances that are measured for it."""

from __future__ import annotations

import math

import numpy as np

from conservative.attitude import to_quaternion
from conservative.errors import BadInput
from conservative.features import join
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene

from ..solution import truth
from .motion import Motion

TURN = 10.0
"""Longest rotation, rad. The tolerances of longer motions take too long to measure."""
STEP, SAMPLES = 0.1, 10
"""Rotation in the longest step, rad, and number of samples."""
ALLOWED = "a free body, a rotor, uniform gravity, a constant torque or a constant damping"


def motion_of(scene: Scene) -> Motion:
    """Return the motion of a scene, of its first `TURN` rad. Raise `BadInput` for a scene with other fields or loads."""
    scene = scene.rotation_only
    field, torque, damping = scene.potential, scene.torque, scene.damping
    varying = any(part is not None and not part.constant for part in (torque, scene.body.motor))
    if (field is not None and type(field) is not UniformGravity) or varying or (damping is not None and damping.of_time):
        raise BadInput("body", f"{scene.name!r} with {join(sorted(scene.features))}", ALLOWED)
    speed = float(np.linalg.norm(scene.w_WB_B0))
    if speed == 0 and field is None and torque is None:
        raise BadInput("body", f"{scene.name!r}, which is at rest", "a body that moves")
    fastest, end = _fastest(scene, scene.t_end)
    if fastest * end > TURN:
        fastest, end = _fastest(scene, TURN / fastest)
    steps = max(1, math.ceil(fastest * end / STEP / SAMPLES))
    J = scene.body.inertia
    return Motion(
        f"body {scene.name}",
        "the body of the user",
        [float(x) for x in (J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2])],
        to_quaternion(scene.R_WB0).tolist(),
        scene.w_WB_B0.tolist(),
        end / (steps * SAMPLES),
        steps,
        SAMPLES,
        rotor_momentum_B=None if scene.body.rotor_momentum is None else scene.body.rotor_momentum.tolist(),
        torque_B=np.asarray(torque.value).tolist() if torque is not None and torque.frame == "body" else None,
        torque_W=np.asarray(torque.value).tolist() if torque is not None and torque.frame == "world" else None,
        damping=None if damping is None else np.asarray(damping.matrix).tolist(),
        weight=field.weight if field is not None else None,
        com_B=field.com_B.tolist() if field is not None else None,
        own=True,
    )


def _fastest(scene: Scene, end: float) -> tuple[float, float]:
    """Return the largest rate, rad/s, until a time, s, and this time."""
    times = np.linspace(0.0, end, 201)
    return float(np.linalg.norm(truth(scene, 0.0, times)[1], axis=1).max()), end
