"""PhysX on the CPU, as in SAPIEN, in single precision and stepped from Python (`system.step`).

A body about a fixed point is on a D6 joint (`PhysxDriveComponent`) with its translations locked. Switched off: damping, which
is 0.05 1/s (`angular_damping`), sleeping (`sleep_threshold`), the limit of 100 rad/s (`max_angular_velocity`).

Parameters
----------
as_installed
    True if damping, sleeping and the limit stay on.

References
----------
PhysX, damping, limit of rates, sleeping: https://nvidia-omniverse.github.io/PhysX/physx/5.4.1/docs/RigidBodyDynamics.html
D6 joint: https://nvidia-omniverse.github.io/PhysX/physx/5.4.1/docs/Joints.html
SAPIEN: https://sapien-sim.github.io/docs/
"""

import numpy as np

from .shared import FAR_PLACE, description_of, stepped

ENGINE = {
    "package": "sapien",
    "module": "sapien",
    "oldest": "3.0",
    "settings": {"as_installed": False},
    "title": "PhysX",
    "precision": "f32",
    "fields": ("UniformGravity",),
    "descriptions": ("frame", "world"),
    "rate_limit": 100.0,  # max_angular_velocity
    "method_info": {
        "variants": ("", "as_installed=true"),
        "as_installed": ("as_installed=true",),
        "usual_dt": 0.01,
    },
}


def prepare(given):
    """Return a run of one body."""
    import sapien

    config = sapien.physx.PhysxSceneConfig()
    config.gravity = [0, 0, -given.gravity]
    sapien.physx.set_scene_config(config)
    system = sapien.physx.PhysxCpuSystem()
    scene = sapien.Scene([system])
    system.timestep = given.dt
    body = sapien.physx.PhysxRigidDynamicComponent()
    body.set_mass(given.mass)
    body.set_cmass_local_pose(sapien.Pose(given.com.astype(np.float32), given.q_com.astype(np.float32)))
    body.set_inertia(given.moments_com.astype(np.float32))
    if not given.as_installed:
        body.set_angular_damping(0)
        body.set_linear_damping(0)
        body.set_max_angular_velocity(1e6)
        body.set_sleep_threshold(0)
    entity = sapien.Entity()
    entity.add_component(body)
    if not given.free:
        joint = sapien.physx.PhysxDriveComponent(body)  # a drive without a second body holds it to the world
        for lock in (joint.set_limit_x, joint.set_limit_y, joint.set_limit_z):
            lock(0, 0)
        entity.add_component(joint)
    scene.add_entity(entity)
    if description_of(given) == "world":
        far = sapien.Entity()
        far.add_component(sapien.physx.PhysxRigidDynamicComponent())
        far.set_pose(sapien.Pose(list(FAR_PLACE)))
        scene.add_entity(far)
    start, spin = sapien.Pose(q=given.q0.astype(np.float32)), given.w0_W.astype(np.float32)
    drift = given.v0.astype(np.float32)

    def begin():
        entity.set_pose(start)
        body.set_linear_velocity(drift)
        body.set_angular_velocity(spin)
        body.wake_up()

    run = stepped(given, begin, system.step, lambda: {"q": body.get_pose().q, "w_W": body.get_angular_velocity()})
    run.owner = scene  # the body lives as long as its scene
    return run
