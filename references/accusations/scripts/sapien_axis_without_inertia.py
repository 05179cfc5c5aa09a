"""A body with a moment of 0 does not turn about this axis; its angular velocity becomes 0."""

import numpy as np
import sapien


def speed(moment):
    config = sapien.physx.PhysxSceneConfig()
    config.gravity = [0, 0, 0]
    sapien.physx.set_scene_config(config)
    system = sapien.physx.PhysxCpuSystem()
    scene, body, entity = sapien.Scene([system]), sapien.physx.PhysxRigidDynamicComponent(), sapien.Entity()
    system.timestep = 0.01
    body.set_mass(1)
    body.set_inertia(np.float32([1, 1, moment]))
    body.set_angular_damping(0)
    body.set_sleep_threshold(0)
    entity.add_component(body)
    scene.add_entity(entity)
    body.set_angular_velocity(np.float32([0, 0, 4]))
    system.step()
    return np.linalg.norm(body.get_angular_velocity())


rod, needle = speed(0), speed(1e-6)
print(f"after one step 4 rad/s about an axis without inertia are {rod:.3f}, with a moment of 1e-6 {needle:.3f}:", end=" ")
print("wrong" if abs(rod - 4) > 1e-3 else "right")
