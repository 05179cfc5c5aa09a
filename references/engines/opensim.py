"""OpenSim, which is Simbody, with one of its integrators, in its own loop (`Manager.integrate`).

A free body is on a `FreeJoint`, one about a fixed point on a `BallJoint`. For both, OpenSim selects three angles as Simbody's
coordinates, and its Python module has nothing to change that: errors grow when the second angle comes near a right angle, and a
top that spins about its third axis is easier than in other engines. Switched off: storage and analyses of states
(`setWriteToStorage`, `setPerformAnalyses`).

Parameters
----------
integrator
    "RungeKuttaMerson", OpenSim's default, "RungeKuttaFeldberg", "RungeKutta3", "RungeKutta2", "ExplicitEuler",
    "SemiExplicitEuler2" or "Verlet".
accuracy
    Accuracy of adaptive steps, up to 1, 1e-3 by OpenSim's default; 0 for fixed steps of dt.

References
----------
Manager, integrators and their settings: https://simtk.org/api_docs/opensim/api_docs/classOpenSim_1_1Manager.html
"""

import math

import numpy as np

ENGINE = {
    "package": "opensim",
    "module": "opensim",
    "oldest": "4.5",
    "settings": {"integrator": "RungeKuttaMerson", "accuracy": 0.0},
    "orders": {
        **{"RungeKuttaMerson": 4, "RungeKuttaFeldberg": 4, "RungeKutta3": 3, "RungeKutta2": 2},
        **{"ExplicitEuler": 1, "SemiExplicitEuler2": 1, "Verlet": 2},
    },
    "tolerance": "accuracy",
    "fields": ("UniformGravity",),
    "method_info": {
        "variants": ("", "RungeKuttaFeldberg", "Verlet", "accuracy=1e-14", "RungeKuttaFeldberg,accuracy=1e-15"),
        "as_installed": ("RungeKuttaMerson,accuracy=1e-3",),
    },
}


def prepare(given):
    """Return a run of one body."""
    import opensim

    opensim.Logger.setLevelString("off")
    model = opensim.Model()
    model.setGravity(opensim.Vec3(0, 0, -given.gravity))
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = given.inertia_com.tolist()
    com = opensim.Vec3(*given.com.tolist())
    body = opensim.Body("body", given.mass, com, opensim.Inertia(xx, yy, zz, xy, xz, yz))
    joint = (opensim.FreeJoint if given.free else opensim.BallJoint)("joint", model.getGround(), body)
    model.addBody(body)
    model.addJoint(joint)
    state, R = model.initSystem(), given.R0
    # Angles about body-fixed axes x, y and z.
    angles = math.atan2(-R[1, 2], R[2, 2]), math.asin(max(-1.0, min(1.0, R[0, 2]))), math.atan2(-R[0, 1], R[0, 0])
    for i, (angle, rate) in enumerate(zip(angles, given.w0_W.tolist(), strict=True)):
        joint.get_coordinates(i).setValue(state, angle, False)
        joint.get_coordinates(i).setSpeedValue(state, rate)  # angular velocity in the world
    times = (given.steps * given.dt).tolist()

    def run():
        manager = opensim.Manager(model)
        manager.setIntegratorMethod(getattr(opensim.Manager, f"IntegratorMethod_{given.integrator}"))
        manager.setWriteToStorage(False)
        manager.setPerformAnalyses(False)
        if given.accuracy:
            manager.setIntegratorAccuracy(given.accuracy)
        else:
            manager.setIntegratorFixedStepSize(given.dt)
        manager.initialize(opensim.State(state))
        R, w = np.empty((len(times), 3, 3)), np.empty((len(times), 3))
        R[0], w[0] = given.R0, given.w0_W
        for sample, time in enumerate(times[1:], start=1):
            now = manager.integrate(time)
            model.realizeVelocity(now)
            turn, rate = body.getTransformInGround(now).R(), body.getVelocityInGround(now).get(0)
            R[sample] = [[turn.get(i, j) for j in range(3)] for i in range(3)]
            w[sample] = rate.get(0), rate.get(1), rate.get(2)
        return {"R": R, "w_W": w}

    return run
