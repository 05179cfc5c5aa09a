"""As installed, the rotation in a step is limited to 45 degrees, so that fast bodies lose angular velocity."""

import numpy as np
from robox3d._ffi import ffi, lib, shim


def speed(dt):
    world_data, data = lib.b3DefaultWorldDef(), lib.b3DefaultBodyDef()
    world_data.gravity = ffi.new("b3Vec3*", (0.0, 0.0, 0.0))[0]
    world = lib.b3CreateWorld(ffi.addressof(world_data))
    data.type = lib.b3_dynamicBody
    body = lib.b3CreateBody(world, ffi.addressof(data))
    ball, shape = ffi.new("b3Sphere*"), lib.b3DefaultShapeDef()
    ball.radius = 0.1
    lib.b3CreateSphereShape(body, ffi.addressof(shape), ball)
    lib.b3Body_SetAngularVelocity(body, ffi.new("b3Vec3*", (0.0, 0.0, 100.0))[0])
    shim.rxWorldStepN(world, dt, 4, 1)
    speed = lib.b3Body_GetAngularVelocity(body).z
    lib.b3DestroyWorld(world)
    return speed


speeds = {dt: speed(dt) for dt in (1e-3, 0.01, 1 / 60)}
texts = [f"{speed:.1f} with {dt:.4g} s, {np.degrees(speed * dt):.1f} degrees" for dt, speed in speeds.items()]
print(f"100 rad/s of a sphere after one step: {'; '.join(texts)}:", "wrong" if min(speeds.values()) < 99.9 else "right")
