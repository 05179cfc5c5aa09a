"""Nimble on a free joint or a ball joint, stepped from Python (`World.step`), because it has no loop of its own.

Its method is DART's. It has no settings, and nothing was switched off. Its environment takes 5.6 GB, most of it PyTorch.

References
----------
World, joints: https://nimblephysics.org/docs/
"""

import numpy as np

from .shared import stepped

ENGINE = {
    "package": "nimblephysics",
    "module": "nimblephysics",
    "requirements": ("numpy<2",),  # the versions with which it was run
    "oldest": "0.10",
    "title": "semi-implicit Euler",
    "fields": ("UniformGravity",),
    "method_info": {
        "as_installed": ("",),
    },
}


def prepare(given):
    """Return a run of one body."""
    import nimblephysics as nimble

    world = nimble.simulation.World()
    world.setGravity([0, 0, -given.gravity])
    world.setTimeStep(given.dt)
    skeleton = nimble.dynamics.Skeleton()
    _, body = getattr(skeleton, f"create{'Free' if given.free else 'Ball'}JointAndBodyNodePair")()
    body.setMass(given.mass)
    body.setLocalCOM(given.com)
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = given.inertia_com.tolist()
    body.setMomentOfInertia(xx, yy, zz, xy, xz, yz)
    world.addSkeleton(skeleton)
    still = np.zeros(3 * given.free)
    place, rates = np.concatenate([_rotation_vector(given.q0), still]), np.concatenate([given.w0, still])

    def begin():
        skeleton.setPositions(place)
        skeleton.setVelocities(rates)  # nimble's rates are in body axes

    def read():
        return {"R": body.getWorldTransform().rotation(), "w_W": body.getAngularVelocity()}

    return stepped(given, begin, world.step, read)


def _rotation_vector(q):
    """Return the rotation vector (3,), rad, of a quaternion."""
    sine = float(np.linalg.norm(q[1:]))
    return q[1:] * (2 * np.arctan2(sine, q[0]) / sine if sine else 2.0)
