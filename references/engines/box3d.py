"""Box3D in single precision, by its interface in C from `robox3d`, in the loop of that package (`rxWorldStepN`).

A body has the shape of a solid ball with its mass and mean moment: the engine compares the speed of the shape's surface with
the threshold of sleeping. A body about a fixed point is on a spherical joint. Switched off: sleeping (`enableSleep`), the
limit of 400 m/s (`maximumLinearSpeed`), and the limit of the rotation in a step to an eighth of a turn (`allowFastRotation`),
which is 78.5 rad/s at steps of 0.01 s, with any number of substeps.

Parameters
----------
substeps
    Substeps of a step, 1 or more; 4 by default, as in the examples of Box3D and in `robox3d`.
as_installed
    True if sleeping and both limits stay on.

References
----------
Bodies, `allowFastRotation`, sleeping: https://github.com/erincatto/box3d/blob/main/include/box3d/types.h
Its Python package: https://github.com/neka-nat/robox3d
"""

import numpy as np

from .shared import FAR_MASS, FAR_PLACE, description_of

ENGINE = {
    "package": "robox3d",
    "module": "robox3d",
    "oldest": "0.1",
    "settings": {"substeps": 4, "as_installed": False},
    "precision": "f32",
    "fields": ("UniformGravity",),
    "descriptions": ("frame", "world", "damping"),
    "method_info": {
        "variants": ("", "substeps=1", "as_installed=true"),
        "as_installed": ("as_installed=true",),
        "usual_dt": 1 / 60,
    },
}


def prepare(given):
    """Return a run of one body. `renew` creates the world of the next call."""
    from robox3d._ffi import lib, shim

    ready = []

    def renew():
        while ready:
            lib.b3DestroyWorld(ready.pop()[0])  # there may be 128 worlds at once
        ready.append(_build(given))

    def run():
        if not ready:
            renew()
        world, body = ready.pop()
        q, w = np.empty((len(given.steps), 4)), np.empty((len(given.steps), 3))
        for sample, count in enumerate(np.diff(given.steps, prepend=0).tolist()):
            shim.rxWorldStepN(world, given.dt, given.substeps, count)
            turn, rate = lib.b3Body_GetRotation(body), lib.b3Body_GetAngularVelocity(body)
            q[sample], w[sample] = (turn.s, turn.v.x, turn.v.y, turn.v.z), (rate.x, rate.y, rate.z)
        lib.b3DestroyWorld(world)
        return {"q": q, "w_W": w}

    run.renew = renew
    run.dispose = lambda: [lib.b3DestroyWorld(world) for world, _ in ready]
    return run


def _build(given):
    """Return a world and its body."""
    from robox3d._ffi import ffi, lib

    world_data = lib.b3DefaultWorldDef()
    world_data.gravity = _vector(0.0, 0.0, -given.gravity)
    if not given.as_installed:
        world_data.maximumLinearSpeed = 1e6
    world = lib.b3CreateWorld(ffi.addressof(world_data))
    if description_of(given) == "world":
        far = lib.b3DefaultBodyDef()
        far.type, far.position = lib.b3_dynamicBody, _vector(*FAR_PLACE)
        _set_mass(lib.b3CreateBody(world, ffi.addressof(far)), FAR_MASS, np.zeros(3), FAR_MASS * np.eye(3))
    data = lib.b3DefaultBodyDef()
    data.type = lib.b3_dynamicBody
    data.rotation.s, (data.rotation.v.x, data.rotation.v.y, data.rotation.v.z) = given.q0[0], given.q0[1:]
    if not given.as_installed:
        data.enableSleep, data.allowFastRotation = False, True
    if description_of(given) == "damping":
        data.linearDamping = data.angularDamping = 0.0
    body = lib.b3CreateBody(world, ffi.addressof(data))
    ball, shape = ffi.new("b3Sphere*"), lib.b3DefaultShapeDef()
    ball.center, ball.radius = _vector(*given.com), np.sqrt(2.5 * given.moments_com.mean() / given.mass)
    shape.density = given.mass / (4 / 3 * np.pi * ball.radius**3)
    lib.b3CreateSphereShape(body, ffi.addressof(shape), ball)
    _set_mass(body, given.mass, given.com, given.inertia_com)  # after the shape, from which the engine computes a mass
    lib.b3Body_SetLinearVelocity(body, _vector(*given.v0))
    lib.b3Body_SetAngularVelocity(body, _vector(*given.w0_W))
    if not given.free:
        joint = lib.b3DefaultSphericalJointDef()
        joint.base.bodyIdA, joint.base.bodyIdB = lib.b3CreateBody(world, ffi.addressof(lib.b3DefaultBodyDef())), body
        lib.b3CreateSphericalJoint(world, ffi.addressof(joint))
    return world, body


def _vector(x, y, z):
    from robox3d._ffi import ffi

    return ffi.new("b3Vec3*", (x, y, z))[0]


def _set_mass(body, mass, com, inertia):
    from robox3d._ffi import ffi, lib

    data = ffi.new("b3MassData*")
    data.mass, data.center = mass, _vector(*com)
    data.inertia.cx, data.inertia.cy, data.inertia.cz = (_vector(*column) for column in inertia.T)
    lib.b3Body_SetMassData(body, data[0])
