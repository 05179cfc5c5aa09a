"""Pinocchio's `aba` and `integrate`, stepped from Python.

Pinocchio is a library of algorithms without a time loop, so this loop is Python's. The library's eight calls take a sixth of a
step of RK4. The body is on a spherical joint at its fixed point, or at its centre of mass if it is free. The torque of a field
other than gravity is the joint's torque, in each call of `aba`; numba compiles it where it is installed.

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

from .shared import FIELDS, compile_torque, pack_field

ENGINE = {
    "package": "pin",
    "module": "pinocchio",
    "settings": {"scheme": "RK4"},
    "orders": {"Euler": 1, "RK4": 4},
    "prefix": "aba+",
    "fields": FIELDS,
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
    q, v, count = np.roll(given.q0, -1), given.w0, 0  # Pinocchio has the scalar last; velocities are in body axes
    qs, vs = np.full((len(given.steps), 4), np.nan), np.full((len(given.steps), 3), np.nan)
    qs[0], vs[0] = q, v
    with np.errstate(all="ignore"):
        for sample, n_steps in enumerate(np.diff(given.steps), start=1):
            for _ in range(n_steps):
                q, v = step(q, v, count * given.dt)
                count += 1
            if not np.isfinite(v).all():
                break
            qs[sample], vs[sample] = q, v
    return np.roll(qs, 1, axis=1), vs


def _stepper(pin, given):
    """Return a function that makes a step from a quaternion, rates and time.

    RK4 is k_i = dt (v, aba) at q exp(u_i), with u_3 and the last u corrected by a commutator. The signs are correct for a group
    that acts from the right, q' = q v, with v in body axes.
    """
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "body")
    # The inertia about the centre of mass, in the axes of the joint.
    model.appendBodyToJoint(joint, pin.Inertia(given.mass, given.com, given.inertia_com), pin.SE3.Identity())
    model.gravity.linear = np.array([0.0, 0.0, -given.gravity])
    aba, integrate, data, tau, dt = pin.aba, pin.integrate, model.createData(), np.zeros(model.nv), given.dt
    field, torque = pack_field(given), compile_torque()
    no_field = not field.any()

    def acceleration(q, v, t):
        if no_field:
            return aba(model, data, q, v, tau)
        return aba(model, data, q, v, np.array(torque(field, pin.Quaternion(q).toRotationMatrix().ravel(), t)))

    def euler(q, v, t):
        v = v + dt * acceleration(q, v, t)
        return integrate(model, q, dt * v), v

    def rk4(q, v, t):
        k1, a1 = dt * v, dt * acceleration(q, v, t)
        v2 = v + a1 / 2
        k2, a2 = dt * v2, dt * acceleration(integrate(model, q, k1 / 2), v2, t + dt / 2)
        v3 = v + a2 / 2
        k3, a3 = dt * v3, dt * acceleration(integrate(model, q, k2 / 2 + _cross(k1, k2) / 8), v3, t + dt / 2)
        v4 = v + a3
        k4, a4 = dt * v4, dt * acceleration(integrate(model, q, k3), v4, t + dt)
        u = (k1 + 2 * (k2 + k3) + k4 + _cross(k1, k4) / 2) / 6
        return integrate(model, q, u), v + (a1 + 2 * (a2 + a3) + a4) / 6

    return rk4 if given.scheme == "RK4" else euler


def _cross(a, b):
    """Return a x b for single vectors; `numpy.cross` costs more than `aba`."""
    a1, a2, a3 = a.tolist()
    b1, b2, b3 = b.tolist()
    return np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])
