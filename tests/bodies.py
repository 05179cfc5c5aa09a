"""Bodies that no mass distribution has: the equations hold for them, so they are good examples."""

from conservative.body import RigidBody
from conservative.check import build_unchecked, read_inertia


def impossible_body(inertia):
    """The body with moments (3,) or a tensor (3, 3) that no mass distribution may have, without a warning."""
    return build_unchecked(RigidBody, inertia=read_inertia(inertia), rotor_momentum=None, motor=None)
