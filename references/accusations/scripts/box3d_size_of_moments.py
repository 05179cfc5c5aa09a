"""A body with very small or very large moments has no gyroscopic motion."""

import numpy as np
from robox3d._ffi import ffi, lib, shim


def vector(x, y, z):
    return ffi.new("b3Vec3*", (x, y, z))[0]


def rates(scale):
    world_data, data, mass = lib.b3DefaultWorldDef(), lib.b3DefaultBodyDef(), ffi.new("b3MassData*")
    world_data.gravity, data.type, data.enableSleep = vector(0, 0, 0), lib.b3_dynamicBody, False
    world = lib.b3CreateWorld(ffi.addressof(world_data))
    body = lib.b3CreateBody(world, ffi.addressof(data))
    columns = (vector(*column) for column in scale * np.diag([1.0, 1.5, 2.0]))
    mass.mass, (mass.inertia.cx, mass.inertia.cy, mass.inertia.cz) = 1.0, columns
    lib.b3Body_SetMassData(body, mass[0])
    lib.b3Body_SetAngularVelocity(body, vector(1, 2, 3))
    shim.rxWorldStepN(world, 0.01, 4, 100)
    w = lib.b3Body_GetAngularVelocity(body)
    return np.array([w.x, w.y, w.z])


usual, initial = rates(1.0), np.array([1.0, 2.0, 3.0])
sizes = 10.0 ** np.arange(-16, 17)
still = [abs(rates(size) - initial).max() < 1e-3 < abs(usual - initial).max() for size in sizes]
moving = sizes[~np.array(still)]
print(
    f"of 1e-16 to 1e16 kg m^2, moments of {moving.min():g} to {moving.max():g} kg m^2 have it:",
    "wrong" if any(still) else "right",
)
