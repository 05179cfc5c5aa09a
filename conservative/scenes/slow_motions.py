"""Fast motions told slower, for engines that limit rates: game engines stop at 100 rad/s, and the paper's top turns at 141.

With time stretched by a factor f a motion stays one, of the same body through the same attitudes:

    R'(f t) = R(t)     w' = w / f     weight' = weight / f^2

With f a power of two, both are computed with the same digits.
"""

from __future__ import annotations

from collections.abc import Callable

from ..check import positive_number
from ..errors import BadInput
from ..potentials.uniform_gravity import UniformGravity
from ..scene import Scene
from .lagrange_top import lagrange_top
from .lie_group_top import lie_group_top
from .needle import needle
from .nutating_tops import cusped_top, looping_top, nutating_top, unduloid_top
from .sleeping_tops import falling_top, sleeping_top

DEFAULT_FACTOR = 4.0
SLOW = "slow motion"
"""Group of these scenes, whose motions are in other groups, too."""


def slow_motion(scene: Scene, factor: float = DEFAULT_FACTOR) -> Scene:
    """Return the scene `slow_NAME`, the same motion in a time that is stretched by a dimensionless factor.

    Raises
    ------
    BadInput
        The factor is not a finite number above 0, or the scene has a field other than uniform gravity, or invariants of its
        own, whose units are not known here.
    """
    factor, field = positive_number("factor", factor), scene.potential
    if isinstance(field, UniformGravity):
        field = UniformGravity(field.weight / factor**2, field.com_B)
    elif field is not None:
        raise BadInput("scene", f"a scene with {field!r}", "a free body or one in uniform gravity")
    if scene.extra_invariants:
        raise BadInput("scene", "a scene with extra_invariants", "one without")
    source = f"{scene.source}; {factor:g} times slower"
    times = {"t_end": scene.t_end * factor, "dt": scene.dt * factor}
    changes = {"w_WB_B0": scene.w_WB_B0 / factor, "potential": field, "group": SLOW, "source": source}
    return scene.rename(f"slow_{scene.name}", **times, **changes)


def _slow(fast: Callable[[], Scene]) -> Callable[..., Scene]:
    """Return the function that makes the slow motion of a scene."""

    def slow(factor: float = DEFAULT_FACTOR) -> Scene:
        return slow_motion(fast(), factor)

    slow.__name__ = slow.__qualname__ = f"slow_{fast.__name__}"
    slow.__doc__ = f"Return `{fast.__name__}`, slower by a dimensionless factor; see `slow_motion`."
    return slow


slow_cusped_top = _slow(cusped_top)
slow_falling_top = _slow(falling_top)
slow_lagrange_top = _slow(lagrange_top)
slow_lie_group_top = _slow(lie_group_top)
slow_looping_top = _slow(looping_top)
slow_needle = _slow(needle)
slow_nutating_top = _slow(nutating_top)
slow_sleeping_top = _slow(sleeping_top)
slow_unduloid_top = _slow(unduloid_top)
