"""As installed, damping takes energy from a free brick."""

import numpy as np
import sapien

config = sapien.physx.PhysxSceneConfig()
config.gravity = [0, 0, 0]
sapien.physx.set_scene_config(config)
J = np.array([13.0, 5.0, 10.0])


def energy(body):
    R = body.get_pose().to_transformation_matrix()[:3, :3]
    return J @ (R.T @ body.get_angular_velocity()) ** 2 / 2


def energy_left(off):
    system = sapien.physx.PhysxCpuSystem()
    scene, body, entity = sapien.Scene([system]), sapien.physx.PhysxRigidDynamicComponent(), sapien.Entity()
    system.timestep = 0.01
    body.set_inertia(np.float32(J))
    if off:
        body.set_angular_damping(0)
    entity.add_component(body)
    scene.add_entity(entity)
    body.set_angular_velocity(np.float32([0, 0.05, 10]))
    first = energy(body)
    for _ in range(600):
        system.step()
    return energy(body) / first


rest, undamped = energy_left(False), energy_left(True)
print(f"energy after 6 s over energy at the start: {rest:.3f}, without damping {undamped:.3f}:", end=" ")
print("wrong" if rest < 0.99 else "right")
