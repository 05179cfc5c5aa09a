"""Pinocchio's `aba` and `integrate`, stepped from Python.

Pinocchio is a library of algorithms without a time loop, so this loop is Python's, and calls of the library take most of the
time of a step. The body is on a spherical joint at its fixed point, or at its centre of mass if it is free.

Parameters
----------
scheme
    "Euler": semi-implicit, v += dt aba(q, v), then q = integrate(q, dt v). "RK4": Munthe-Kaas's Runge-Kutta method of
    order 4 on the rotation group (Munthe-Kaas 1998, with the two commutators of Munthe-Kaas & Owren 1999).

References
----------
aba, integrate: https://docs.ros.org/en/kinetic/api/pinocchio/html/
"""

import numpy as np

ENGINE = {
    "package": "pin",
    "module": "pinocchio",
    "settings": {"scheme": "RK4"},
    "orders": {"Euler": 1, "RK4": 4},
    "prefix": "aba+",
    "gravity": True,
    "card": {
        "variants": ("Euler", "RK4"),
        "report": ("",),
        "suite": ("RK4",),
        "many": ("RK4",),
        "pictures": ("Euler",),
        "colour": "purple",
    },
}


def prepare(given):
    """Return a run of one body."""
    import pinocchio as pin

    step = _stepper(pin, given)
    evaluations = given.n_steps * (4 if given.scheme == "RK4" else 1)

    def run():
        q, w = _march(step, given)
        return {"q": q, "w": w, "evaluations": evaluations}

    return run


def prepare_many(bodies):
    """Return one loop over all bodies, each with its own model: Pinocchio has no function for many bodies."""
    import pinocchio as pin

    steps = [_stepper(pin, body) for body in bodies]

    def run():
        q, w = zip(*(_march(step, body) for step, body in zip(steps, bodies, strict=True)), strict=True)
        return {"q": np.stack(q), "w": np.stack(w)}

    return run


def _march(step, given):
    """Return samples of quaternions (n, 4), scalar first, and rates (n, 3); nan after the end of a run that diverges."""
    q, v = np.roll(given.q0, -1), given.w0  # Pinocchio has the scalar last; velocities are in body axes
    qs, vs = np.full((len(given.steps), 4), np.nan), np.full((len(given.steps), 3), np.nan)
    qs[0], vs[0] = q, v
    with np.errstate(all="ignore"):
        for sample, n_steps in enumerate(np.diff(given.steps), start=1):
            for _ in range(n_steps):
                q, v = step(q, v)
            if not np.isfinite(v).all():
                break
            qs[sample], vs[sample] = q, v
    return np.roll(qs, 1, axis=1), vs


def _stepper(pin, given):
    """Return a function that makes a step from a quaternion and rates.

    RK4 is k_i = dt (v, aba) at q exp(u_i), with u_3 and the last u corrected by a commutator. The signs are correct for a group
    that acts from the right, q' = q v, with v in body axes.
    """
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "body")
    # The inertia about the centre of mass, in the axes of the joint.
    model.appendBodyToJoint(joint, pin.Inertia(given.mass, given.com, given.inertia_com), pin.SE3.Identity())
    model.gravity.linear = np.array([0.0, 0.0, -given.gravity])
    aba, integrate, data, tau, dt = pin.aba, pin.integrate, model.createData(), np.zeros(model.nv), given.dt

    def euler(q, v):
        v = v + dt * aba(model, data, q, v, tau)
        return integrate(model, q, dt * v), v

    def rk4(q, v):
        k1, a1 = dt * v, dt * aba(model, data, q, v, tau)
        v2 = v + a1 / 2
        k2, a2 = dt * v2, dt * aba(model, data, integrate(model, q, k1 / 2), v2, tau)
        v3 = v + a2 / 2
        k3, a3 = dt * v3, dt * aba(model, data, integrate(model, q, k2 / 2 + _cross(k1, k2) / 8), v3, tau)
        v4 = v + a3
        k4, a4 = dt * v4, dt * aba(model, data, integrate(model, q, k3), v4, tau)
        u = (k1 + 2 * (k2 + k3) + k4 + _cross(k1, k4) / 2) / 6
        return integrate(model, q, u), v + (a1 + 2 * (a2 + a3) + a4) / 6

    return rk4 if given.scheme == "RK4" else euler


def _cross(a, b):
    """Return a x b for single vectors; `numpy.cross` costs more than `aba`."""
    a1, a2, a3 = a.tolist()
    b1, b2, b3 = b.tolist()
    return np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])
