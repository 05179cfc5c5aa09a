"""Speeds above 400 m/s become 400 m/s, without a message."""

import rapier3d as rp


def speed(metres):
    world = rp.PhysicsWorld(gravity=(0.0, 0.0, 0.0))
    body = world.rigid_bodies[
        world.add_body(rp.RigidBody.dynamic().linvel((metres, 0.0, 0.0)).can_sleep(False).additional_mass(1.0).build())
    ]
    world.step()
    return body.linvel.x


speeds = (399, 401, 1000)
found = [speed(float(metres)) for metres in speeds]
wrong = any(abs(x - metres) > 0.1 for x, metres in zip(found, speeds))
print(
    f"after one step, {', '.join(map(str, speeds))} m/s are {', '.join(f'{x:.1f}' for x in found)}:",
    "wrong" if wrong else "right",
)
