"""Without damping, a free brick loses energy, less of it with more substeps."""

import numpy as np
from robox3d._ffi import ffi, lib, shim

J = np.array([13.0, 5.0, 10.0])


def vector(x, y, z):
    return ffi.new("b3Vec3*", (x, y, z))[0]


def energy(body):
    q, w = lib.b3Body_GetRotation(body), lib.b3Body_GetAngularVelocity(body)
    v, w = np.array([q.v.x, q.v.y, q.v.z]), np.array([w.x, w.y, w.z])
    return J @ (w - 2 * q.s * np.cross(v, w) + 2 * np.cross(v, np.cross(v, w))) ** 2 / 2


def energy_left(substeps):
    world_data, data, mass = lib.b3DefaultWorldDef(), lib.b3DefaultBodyDef(), ffi.new("b3MassData*")
    world_data.gravity, data.type = vector(0, 0, 0), lib.b3_dynamicBody
    data.enableSleep, data.angularDamping = False, 0.0
    world = lib.b3CreateWorld(ffi.addressof(world_data))
    body = lib.b3CreateBody(world, ffi.addressof(data))
    mass.mass, (mass.inertia.cx, mass.inertia.cy, mass.inertia.cz) = 1.0, (vector(*column) for column in np.diag(J))
    lib.b3Body_SetMassData(body, mass[0])
    lib.b3Body_SetAngularVelocity(body, vector(0, 0.05, 10))
    first = energy(body)
    shim.rxWorldStepN(world, 0.01, substeps, 600)
    return energy(body) / first


one, four = energy_left(1), energy_left(4)
print(f"energy after 6 s over energy at the start: {one:.3f} with one substep, {four:.3f} with four:", end=" ")
print("wrong" if min(one, four) < 0.99 else "right")
