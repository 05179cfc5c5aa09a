"""Known motions told in a turned body frame: inertia with off-diagonal terms, and the same motion.

With F the rotation that takes the old body components to the new ones,

    J' = F J F'     R_WB' = R_WB F'     w' = F w     com' = F com

Engines have dropped this rotation, or applied it twice; a method that has not gives R_WB' F, the motion in the old frame.
"""

from __future__ import annotations

from ..attitude import Array, rotation_about
from ..body import RigidBody
from ..check import finite_number, rotation
from ..errors import BadInput
from ..potentials.uniform_gravity import UniformGravity
from ..scene import Scene
from .asymmetric_top import asymmetric_top
from .brick_flip import brick_flip

DEFAULT_AXIS = (1.0, 2.0, 3.0)
DEFAULT_ANGLE = 0.7


def in_body_frame(scene: Scene, F: Array, name: str) -> Scene:
    """Return the same motion in the body frame that F (3, 3), old to new components, leads to.

    Raises
    ------
    BadInput
        F is not a rotation, or the scene's potential is of a kind that cannot be turned here (only uniform gravity can).
    """
    F = rotation("F", F)
    field = scene.potential
    if isinstance(field, UniformGravity):
        field = UniformGravity(field.weight, F @ field.com_B)
    elif field is not None:
        raise BadInput("scene", f"a scene with {field!r}", "a free body or one in uniform gravity")
    return scene.rename(
        name, body=RigidBody(F @ scene.body.inertia @ F.T), R_WB0=scene.R_WB0 @ F.T, w_WB_B0=F @ scene.w_WB_B0, potential=field
    )


def turned_brick(angle: float = DEFAULT_ANGLE, t_end: float | None = None) -> Scene:
    """Return the paper's brick in a body frame turned by `angle`, rad, about (1, 2, 3).

    Raises
    ------
    BadInput
        An argument is not finite, or t_end, s, is not above 0.
    """
    return _turn("turned_brick", brick_flip(), angle, t_end)


def turned_top(angle: float = DEFAULT_ANGLE, t_end: float | None = None) -> Scene:
    """Return the asymmetric heavy top in a body frame turned by `angle`, rad, about (1, 2, 3).

    Raises
    ------
    BadInput
        An argument is not finite, or t_end, s, is not above 0.
    """
    return _turn("turned_top", asymmetric_top(), angle, t_end)


def _turn(name: str, scene: Scene, angle: float, t_end: float | None) -> Scene:
    F = rotation_about(DEFAULT_AXIS, finite_number("angle", angle, "a finite angle, rad"))
    turned = in_body_frame(scene, F, name)
    return turned if t_end is None else turned.rename(name, t_end=t_end)
