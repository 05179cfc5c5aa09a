"""Rapier in its environment. Source: its user guide, Rigid-bodies: gyroscopic forces, sleeping; Integration parameters."""

import numpy as np


def prepare(given):
    """Return a run of one rigid body without colliders, held at the fixed point by a joint; Rapier has no loop of its own."""
    import rapier3d as rp

    place = rp.Rotation3(*map(float, given.q0)).scaled_axis
    spin = tuple(map(float, given.w0_W))
    drift = tuple(map(float, np.cross(given.w0_W, given.R0 @ given.com)))  # velocity of the centre of mass
    com, moments, axes = ([float(number) for number in numbers] for numbers in (given.com, given.moments_com, given.q_com))
    mass = rp.MassProperties(tuple(com), float(given.mass), tuple(moments), rp.Rotation3(*axes))

    def build():
        world = rp.PhysicsWorld(gravity=(0.0, 0.0, -float(given.gravity)))
        world.integration_parameters.dt = given.dt
        if given.substeps:
            world.integration_parameters.num_solver_iterations = given.substeps
        body = rp.RigidBody.dynamic(translation=(0, 0, 0), rotation=place).additional_mass_properties(mass).angvel(spin)
        body = body.gyroscopic_forces(True).linvel(drift)
        if not given.as_installed:
            body = body.can_sleep(False).allow_fast_rotation(True)
        handle = world.add_body(body.build())
        if not given.free:
            support = world.add_body(rp.RigidBody.fixed().build())
            world.impulse_joints.insert(support, handle, rp.SphericalJoint.builder().build(), True)
        return world, world.rigid_bodies[handle]

    def run():
        world, body = build()
        q, w = np.empty((len(given.steps), 4)), np.empty((len(given.steps), 3))
        q[0], w[0] = given.q0, given.w0_W
        for sample, n_steps in enumerate(np.diff(given.steps).tolist(), start=1):
            for _ in range(n_steps):
                world.step()
            turn, rate = body.rotation, body.angvel
            q[sample] = turn.w, turn.i, turn.j, turn.k
            w[sample] = rate.x, rate.y, rate.z
        return {"q": q, "w_W": w}

    return run
