"""As installed, slow bodies and bodies with small moments fall asleep."""

import numpy as np
import sapien

config = sapien.physx.PhysxSceneConfig()
config.gravity = [0, 0, 0]
sapien.physx.set_scene_config(config)


def speed_left(moment, speed, awake):
    system = sapien.physx.PhysxCpuSystem()
    scene, body, entity = sapien.Scene([system]), sapien.physx.PhysxRigidDynamicComponent(), sapien.Entity()
    system.timestep = 0.01
    body.set_mass(1)
    body.set_inertia(np.float32([moment, moment, moment]))
    body.set_angular_damping(0)
    if awake:
        body.set_sleep_threshold(0)
    entity.add_component(body)
    scene.add_entity(entity)
    body.set_angular_velocity(np.float32([0, 0, speed]))
    for _ in range(600):
        system.step()
    return body.get_angular_velocity()[2] / speed


bodies = (1, 1), (1, 1e-3), (1e-5, 1)
found = {body: (speed_left(*body, awake=False), speed_left(*body, awake=True)) for body in bodies}
texts = [f"{rest:.3f} with {m:g} kg m^2 at {w:g} rad/s, {awake:.3f} without sleep" for (m, w), (rest, awake) in found.items()]
print(f"rate after 6 s over rate at the start: {'; '.join(texts)}:", end=" ")
print("wrong" if any(rest < 0.9 < awake for rest, awake in found.values()) else "right")
