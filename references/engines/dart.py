"""DART on a free joint or a ball joint, stepped from Python (`World.step`), because it has no loop of its own.

It has no settings, and nothing was switched off.

References
----------
World, whose integrator is semi-implicit Euler; FreeJoint, BallJoint: https://dartsim.github.io/dart/v6.13.2/
"""

import numpy as np

from .shared import LATER, description_of, halves, stepped

ENGINE = {
    "package": "dartpy",
    "module": "dartpy",
    "oldest": "6.19",
    "title": "semi-implicit Euler",
    "fields": ("UniformGravity",),
    "descriptions": ("frame", "child", "world", "time"),
    "method_info": {
        "as_installed": ("",),
        "usual_dt": 0.001,
    },
}


def prepare(given):
    """Return a run of one body."""
    import dartpy as dart

    world = dart.simulation.World()
    world.setGravity([0, 0, -given.gravity])
    world.setTimeStep(given.dt)
    skeleton = dart.dynamics.Skeleton("skeleton")
    joint, body = getattr(skeleton, f"create{'Free' if given.free else 'Ball'}JointAndBodyNodePair")()
    parts = [body, *(skeleton.createWeldJointAndBodyNodePair(body)[1] for _ in halves(given)[1:])]
    for part, (mass, inertia) in zip(parts, halves(given), strict=True):
        part.setInertia(dart.dynamics.Inertia(mass, given.com, inertia))
    if description_of(given) == "world":  # with another body, which must not change the motion
        far = dart.dynamics.Skeleton("far")
        far.createFreeJointAndBodyNodePair()
        world.addSkeleton(far)
    world.addSkeleton(skeleton)
    if given.free:
        place = dart.math.Isometry3()
        place.set_rotation(given.R0)
        joint.setPositions(dart.dynamics.FreeJoint.convertToPositions(place))
    else:
        joint.setPositions(dart.dynamics.BallJoint.convertToPositions(given.R0))
    if given.free:  # rates of its coordinates are rates in body axes only at the identity
        joint.setRelativeSpatialVelocity(np.concatenate([given.w0, np.zeros(3)]), body)
    else:
        joint.setVelocities(given.w0)
    start = joint.getPositions().copy(), joint.getVelocities().copy()
    inertial = dart.dynamics.Frame.World()

    def begin():
        world.reset()
        joint.setPositions(start[0])
        joint.setVelocities(start[1])

    def begin_later():
        begin()
        world.setTime(LATER)

    def read():
        return {"R": body.getWorldTransform().rotation(), "w": body.getAngularVelocity(inertial, body)}

    return stepped(given, begin_later if description_of(given) == "time" else begin, world.step, read)
