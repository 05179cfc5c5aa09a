"""The angular velocity about an axis without inertia becomes 0, except if this is an axis of the world (issue 587)."""

import numpy as np
import rapier3d as rp


def speed(moment, q, w):
    world = rp.PhysicsWorld(gravity=(0.0, 0.0, 0.0))
    properties = rp.MassProperties((0.0, 0.0, 0.0), 1.0, (1.0, 1.0, moment), rp.Rotation3(1.0, 0.0, 0.0, 0.0))
    body = rp.RigidBody.dynamic(rotation=rp.Rotation3(*q).scaled_axis).additional_mass_properties(properties)
    body = world.rigid_bodies[world.add_body(body.angvel(tuple(w)).can_sleep(False).build())]
    world.step()
    return np.linalg.norm([body.angvel.x, body.angvel.y, body.angvel.z])


q = np.array([0.79**0.5, 0.2, -0.4, 0.1])
axis = 4 * np.array([2 * (q[1] * q[3] + q[0] * q[2]), 2 * (q[2] * q[3] - q[0] * q[1]), 1 - 2 * (q[1] ** 2 + q[2] ** 2)])
rod, needle, along_z = speed(0.0, q, axis), speed(1e-6, q, axis), speed(0.0, (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 4.0))
numbers = f"{rod:.3f}, with a moment of 1e-6 {needle:.3f}, along the world's z axis {along_z:.3f}"
print(f"after one step 4 rad/s about an axis without inertia are {numbers}:", "wrong" if abs(rod - 4) > 1e-3 else "right")
