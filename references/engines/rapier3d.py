"""Rapier in single precision, stepped from Python, because it has no loop of its own.

A body about a fixed point is on a spherical impulse joint. Gyroscopic forces are on (`gyroscopic_forces`), as by default, and
there is no damping. Switched off: sleeping (`can_sleep`), and the limit of fast rotation (`allow_fast_rotation`), which is an
eighth of a turn per substep.

Parameters
----------
substeps
    Substeps of a step, 1 or more (`num_solver_iterations`); 4 by default, as in Rapier.
as_installed
    True if sleeping and the limit of fast rotation stay on.

References
----------
Limit of fast rotation, substeps: https://rapier.rs/docs/user_guides/python/rigid_body_solver_settings
Sleeping, gyroscopic forces: https://rapier.rs/docs/user_guides/python/rigid_bodies
Joints: https://rapier.rs/docs/user_guides/python/joints
"""

from .shared import description_of, sample

ENGINE = {
    "package": "rapier3d",
    "module": "rapier3d",
    "oldest": "0.36",
    "settings": {"substeps": 4, "as_installed": False},
    "precision": "f32",
    "fields": ("UniformGravity",),
    "descriptions": ("frame", "world", "damping"),
    "method_info": {
        "variants": ("", "substeps=1", "as_installed=true"),
        "as_installed": ("as_installed=true",),
        "usual_dt": 1 / 60,
    },
}


def prepare(given):
    """Return a run of one body."""
    import rapier3d as rp

    place = rp.Rotation3(*map(float, given.q0)).scaled_axis
    spin = tuple(map(float, given.w0_W))
    drift = tuple(map(float, given.v0))
    com, moments, axes = ([float(number) for number in numbers] for numbers in (given.com, given.moments_com, given.q_com))
    mass = rp.MassProperties(tuple(com), float(given.mass), tuple(moments), rp.Rotation3(*axes))

    ready = []

    def build():
        world = rp.PhysicsWorld(gravity=(0.0, 0.0, -float(given.gravity)))
        world.integration_parameters.dt = given.dt
        world.integration_parameters.num_solver_iterations = given.substeps
        body = rp.RigidBody.dynamic(translation=(0, 0, 0), rotation=place).additional_mass_properties(mass).angvel(spin)
        body = body.gyroscopic_forces(True).linvel(drift)
        if not given.as_installed:
            body = body.can_sleep(False).allow_fast_rotation(True)
        if description_of(given) == "damping":
            body = body.linear_damping(0.0).angular_damping(0.0)
        if description_of(given) == "world":  # with another body, which must not change the motion
            world.add_body(rp.RigidBody.dynamic(translation=(1000, 200, 30)).additional_mass(3.0).build())
        handle = world.add_body(body.build())
        if not given.free:
            support = world.add_body(rp.RigidBody.fixed().build())
            world.impulse_joints.insert(support, handle, rp.SphericalJoint.builder().build(), True)
        ready.append((world, world.rigid_bodies[handle]))

    def run():
        if not ready:
            build()
        world, body = ready.pop()

        def read():
            turn, rate = body.rotation, body.angvel
            return {"q": (turn.w, turn.i, turn.j, turn.k), "w_W": (rate.x, rate.y, rate.z)}

        samples = sample(given, world.step, read)
        samples["q"][0], samples["w_W"][0] = given.q0, given.w0_W  # the start in double precision
        return samples

    run.renew = build
    return run
