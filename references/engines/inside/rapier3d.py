"""Rapier in its environment. Source: its user guide, Rigid-bodies: gyroscopic forces, sleeping; Integration parameters."""

import numpy as np


def prepare(given):
    """Return a run of one free rigid body without colliders; Rapier has no loop of its own."""
    import rapier3d as rp

    place = rp.Rotation3(*map(float, given.q0)).scaled_axis
    spin = tuple(map(float, given.w0_W))
    mass = rp.MassProperties((0.0, 0.0, 0.0), float(given.mass), tuple(map(float, given.moments)), rp.Rotation3(1, 0, 0, 0))

    def build():
        world = rp.PhysicsWorld(gravity=(0.0, 0.0, 0.0))
        world.integration_parameters.dt = given.dt
        if given.substeps:
            world.integration_parameters.num_solver_iterations = given.substeps
        body = rp.RigidBody.dynamic(translation=(0, 0, 0), rotation=place).additional_mass_properties(mass).angvel(spin)
        body = body.gyroscopic_forces(True)
        if not given.as_installed:
            body = body.can_sleep(False).allow_fast_rotation(True)
        return world, world.rigid_bodies[world.add_body(body.build())]

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
