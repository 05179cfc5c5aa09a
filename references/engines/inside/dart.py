"""DART in its environment. Source: its documentation, dynamics::FreeJoint, simulation::World."""

import numpy as np


def prepare(given):
    """Return a run of one body on a free joint; DART's loop is one step a call."""
    import dartpy as dart

    world, joint, body = _build(dart, given)
    start = joint.getPositions().copy(), joint.getVelocities().copy()
    inertial = dart.dynamics.Frame.World()

    def run():
        world.reset()
        joint.setPositions(start[0])
        joint.setVelocities(start[1])
        R, w = np.empty((len(given.steps), 3, 3)), np.empty((len(given.steps), 3))
        for sample, n_steps in enumerate(np.diff(given.steps, prepend=0).tolist()):
            for _ in range(n_steps):
                world.step()
            R[sample] = body.getWorldTransform().rotation()
            w[sample] = body.getAngularVelocity(inertial, body)
        return {"R": R, "w": w}

    return run


def _build(dart, given):
    world = dart.simulation.World()
    world.setGravity([0, 0, 0])
    world.setTimeStep(given.dt)
    skeleton = dart.dynamics.Skeleton("skeleton")
    joint, body = skeleton.createFreeJointAndBodyNodePair()
    body.setInertia(dart.dynamics.Inertia(given.mass, np.zeros(3), np.diag(given.moments)))
    world.addSkeleton(skeleton)
    place = dart.math.Isometry3()
    place.set_rotation(given.R0)
    joint.setPositions(dart.dynamics.FreeJoint.convertToPositions(place))
    joint.setVelocities(np.concatenate([given.w0, np.zeros(3)]))  # spatial velocity in body axes
    return world, joint, body
