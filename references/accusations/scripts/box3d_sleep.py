"""As installed, a body without a shape falls asleep at any rate."""

import numpy as np
from robox3d._ffi import ffi, lib, shim


def vector(x, y, z):
    return ffi.new("b3Vec3*", (x, y, z))[0]


def turned(speed, sleep):
    world_data, data, mass = lib.b3DefaultWorldDef(), lib.b3DefaultBodyDef(), ffi.new("b3MassData*")
    world_data.gravity, data.type, data.enableSleep = vector(0, 0, 0), lib.b3_dynamicBody, sleep
    world = lib.b3CreateWorld(ffi.addressof(world_data))
    body = lib.b3CreateBody(world, ffi.addressof(data))
    mass.mass, (mass.inertia.cx, mass.inertia.cy, mass.inertia.cz) = 1.0, (vector(*column) for column in np.eye(3))
    lib.b3Body_SetMassData(body, mass[0])
    lib.b3Body_SetAngularVelocity(body, vector(0, 0, speed))
    angle = 0.0
    for _ in range(1000):
        before = lib.b3Body_GetRotation(body)
        shim.rxWorldStepN(world, 0.001, 4, 1)
        after = lib.b3Body_GetRotation(body)
        angle += 2 * np.arctan2(after.v.z * before.s - after.s * before.v.z, after.s * before.s + after.v.z * before.v.z)
    return angle


speeds = 1.0, 10.0, 100.0
angles = {speed: (turned(speed, True), turned(speed, False)) for speed in speeds}
texts = [f"{asleep:.2f} rad at {speed:g} rad/s, {awake:.2f} rad without sleep" for speed, (asleep, awake) in angles.items()]
print(f"turned in 1 s: {'; '.join(texts)}:", end=" ")
print("wrong" if any(abs(asleep - awake) > 0.01 * awake for asleep, awake in angles.values()) else "right")
