"""Fast motions told slower, for engines that limit rates: game engines stop at 100 rad/s, and the paper's top turns at 141.

With time stretched by a factor f a motion stays one, of the same body through the same attitudes:

    R'(f t) = R(t)     w' = w / f     weight' = weight / f^2

With f a power of two, both are computed with the same digits.
"""

from __future__ import annotations

from ..check import positive_number
from ..errors import BadInput
from ..potentials.uniform_gravity import UniformGravity
from ..scene import Scene


def slow_motion(scene: Scene, slow: float = 4.0) -> Scene:
    """Return the scene `NAME:slow=4`, the same motion in a time that is stretched by a factor; the scene itself for 1.

    Raises
    ------
    BadInput
        The factor is not a finite number above 0, or the scene has a field other than uniform gravity, or invariants of its
        own, whose units are not known here.
    """
    factor, field = positive_number("slow", slow), scene.potential
    if factor == 1:
        return scene
    if isinstance(field, UniformGravity):
        field = UniformGravity(field.weight / factor**2, field.com_B)
    elif field is not None:
        raise BadInput("scene", f"a scene with {field!r}", "a free body or one in uniform gravity")
    if scene.extra_invariants:
        raise BadInput("scene", "a scene with extra_invariants", "one without")
    return scene.rename(
        f"{scene.name}:slow={factor:g}",
        w_WB_B0=scene.w_WB_B0 / factor,
        t_end=scene.t_end * factor,
        potential=field,
        dt=scene.dt * factor,
        source=f"{scene.source}; {factor:g} times slower",
    )
