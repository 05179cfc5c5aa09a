"""SAPIEN (PhysX) in its environment. Source: its API reference, PhysxRigidDynamicComponent, PhysxCpuSystem."""

import numpy as np


def prepare(given):
    """Return a run of one rigid body without shapes; PhysX's loop is one step a call."""
    import sapien

    config = sapien.physx.PhysxSceneConfig()
    config.gravity = [0, 0, 0]
    sapien.physx.set_scene_config(config)
    system = sapien.physx.PhysxCpuSystem()
    scene = sapien.Scene([system])
    system.timestep = given.dt
    body = sapien.physx.PhysxRigidDynamicComponent()
    body.set_mass(given.mass)
    body.set_cmass_local_pose(sapien.Pose())
    body.set_inertia(given.moments.astype(np.float32))
    if not given.as_installed:
        _switch_off(body)
    entity = sapien.Entity()
    entity.add_component(body)
    scene.add_entity(entity)
    start, spin = sapien.Pose(q=given.q0.astype(np.float32)), given.w0_W.astype(np.float32)

    def run():
        entity.set_pose(start)
        body.set_linear_velocity(np.zeros(3, np.float32))
        body.set_angular_velocity(spin)
        body.wake_up()
        q, w = np.empty((len(given.steps), 4)), np.empty((len(given.steps), 3))
        for sample, n_steps in enumerate(np.diff(given.steps, prepend=0).tolist()):
            for _ in range(n_steps):
                system.step()
            q[sample], w[sample] = body.get_pose().q, body.get_angular_velocity()
        return {"q": q, "w_W": w}

    run.scene = scene  # what owns the body
    return run


def _switch_off(body):
    """Switch off damping, the limit of rates, which is 100 rad/s by default, and sleeping."""
    body.set_angular_damping(0)
    body.set_linear_damping(0)
    body.set_max_angular_velocity(1e6)
    body.set_sleep_threshold(0)
