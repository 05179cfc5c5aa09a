"""Pinocchio's `aba` and `integrate`, stepped from Python.

Pinocchio is a library of algorithms without a time loop, so this loop is Python's. The library's eight calls take a sixth of a
step of RK4. The body is on a spherical joint at its fixed point, or at its centre of mass if it is free. In free flight it is
on a free flyer at the origin of its frame. The torque of a field other than gravity is the joint's torque, in each call of
`aba`; numba compiles it where it is installed.

Parameters
----------
scheme
    "Euler": semi-implicit, v += dt aba(q, v), then q = integrate(q, dt v). "RK4": Munthe-Kaas's Runge-Kutta method of
    order 4 on the group of rotations, or of motions (Munthe-Kaas 1998, with the two commutators of Munthe-Kaas & Owren 1999).

References
----------
aba, integrate: https://docs.ros.org/en/kinetic/api/pinocchio/html/
"""

from tempfile import TemporaryDirectory

import numpy as np

from .shared import FIELDS, OTHER_MASS, compile_torque, description_of, halves, pack_field, rescaled, write_urdf

ENGINE = {
    "package": "pin",
    "module": "pinocchio",
    "settings": {"scheme": "RK4"},
    "orders": {"Euler": 1, "RK4": 4},
    "prefix": "aba+",
    "fields": FIELDS,
    "descriptions": ("frame", "offset", "file", "setter", "child", "joints", "saved", "rewritten", "mass"),
    "method_info": {
        "variants": ("Euler", "RK4"),
        "report": ("",),
        "suite": ("RK4",),
        "many": ("RK4",),
        "pictures": ("Euler",),
        "colour": "purple",
        "flight": True,
    },
}

DUMMY = 1.0, np.array([0.1, 0.2, 0.3]), np.array([[2.0, 0.1, 0.2], [0.1, 3.0, 0.3], [0.2, 0.3, 4.0]])
"""Mass, kg, centre of mass, m, and inertia, kg m^2, of a body before its setter."""


def prepare(given):
    """Return a run of one body."""
    import pinocchio as pin

    step = _stepper(pin, given)
    evaluations = given.n_steps * (4 if given.scheme == "RK4" else 1)

    def run():
        q, v = _march(step, given)
        samples = {"q": np.roll(q[:, -4:], 1, axis=1), "w": v[:, -3:], "evaluations": evaluations}
        if hasattr(given, "p_WB0"):  # velocities of the free flyer are in body axes
            samples |= {"p": q[:, :3], "v": np.array([pin.Quaternion(a) * b for a, b in zip(q[:, 3:], v[:, :3], strict=True)])}
        return samples

    if len(given.steps) == 2:
        (q0, v0), times = _start(given), [count * given.dt for count in range(given.n_steps)]

        def loop():
            q, v = q0, v0
            for t in times:
                q, v = step(q, v, t)
            return q, v

        run.loop = loop
    return run


def prepare_many(bodies):
    """Return one loop over all bodies, each with its own model: Pinocchio has no function for many bodies."""
    import pinocchio as pin

    steps = [_stepper(pin, body) for body in bodies]

    def run():
        q, w = zip(*(_march(step, body) for step, body in zip(steps, bodies, strict=True)), strict=True)
        return {"q": np.roll(np.stack(q), 1, axis=-1), "w": np.stack(w)}

    return run


def _march(step, given):
    """Return samples of Pinocchio's coordinates (n, 4 or 7) and velocities (n, 3 or 6), nan after a run has diverged."""
    (q, v), count = _start(given), 0
    qs, vs = np.full((len(given.steps), len(q)), np.nan), np.full((len(given.steps), len(v)), np.nan)
    qs[0], vs[0] = q, v
    with np.errstate(all="ignore"):
        for sample, n_steps in enumerate(np.diff(given.steps), start=1):
            for _ in range(n_steps):
                q, v = step(q, v, count * given.dt)
                count += 1
            if not np.isfinite(v).all():
                break
            qs[sample], vs[sample] = q, v
    return qs, vs


def _start(given):
    """Return the initial coordinates and velocities: Pinocchio has the scalar last; velocities are in body axes."""
    q, v = np.roll(given.q0, -1), given.w0
    if _flies(given):
        p0, v0 = getattr(given, "p_WB0", np.zeros(3)), getattr(given, "v_WB0", np.zeros(3))
        return np.concatenate([p0, q]), np.concatenate([given.R0.T @ v0, v])
    return q, v


def _flies(given):
    return hasattr(given, "p_WB0") or (given.free and description_of(given) == "joints")


def _stepper(pin, given):
    """Return a function that makes a step from a quaternion, rates and time.

    RK4 is k_i = dt (v, aba) at q exp(u_i), with u_3 and the last u corrected by a commutator. The signs are correct for a group
    that acts from the right, q' = q v, with v in body axes.
    """
    kind = pin.JointModelFreeFlyer() if _flies(given) else pin.JointModelSpherical()
    if description_of(given) in ("file", "rewritten", "mass"):
        file = rescaled(given, mass=OTHER_MASS) if description_of(given) == "mass" else given
        model = pin.buildModelFromXML(write_urdf(file), kind)
    else:
        model = pin.Model()
        joint = model.addJoint(0, kind, pin.SE3.Identity(), "body")
        parts = (
            [DUMMY] if description_of(given) == "setter" else [(mass, given.com, inertia) for mass, inertia in halves(given)]
        )
        for part in parts:  # about the centre of mass, in the axes of the joint
            model.appendBodyToJoint(joint, pin.Inertia(*part), pin.SE3.Identity())
    model = _change(pin, model, given)
    model.gravity.linear = np.array([0.0, 0.0, -given.gravity])
    aba, integrate, data, tau, dt = pin.aba, pin.integrate, model.createData(), np.zeros(model.nv), given.dt
    field, torque, bracket = pack_field(given), compile_torque(), _cross_motions if model.nv == 6 else _cross

    def acceleration(q, v, t):
        return aba(model, data, q, v, np.array(torque(field, pin.Quaternion(q).toRotationMatrix().ravel(), t)))

    if not field.any():
        acceleration = lambda q, v, t: aba(model, data, q, v, tau)  # noqa: E731

    def euler(q, v, t):
        v = v + dt * acceleration(q, v, t)
        return integrate(model, q, dt * v), v

    def rk4(q, v, t):
        k1, a1 = dt * v, dt * acceleration(q, v, t)
        v2 = v + a1 / 2
        k2, a2 = dt * v2, dt * acceleration(integrate(model, q, k1 / 2), v2, t + dt / 2)
        v3 = v + a2 / 2
        k3, a3 = dt * v3, dt * acceleration(integrate(model, q, k2 / 2 + bracket(k1, k2) / 8), v3, t + dt / 2)
        v4 = v + a3
        k4, a4 = dt * v4, dt * acceleration(integrate(model, q, k3), v4, t + dt)
        u = (k1 + 2 * (k2 + k3) + k4 + bracket(k1, k4) / 2) / 6
        return integrate(model, q, u), v + (a1 + 2 * (a2 + a3) + a4) / 6

    return rk4 if given.scheme == "RK4" else euler


def _change(pin, model, given):
    """Return the model after what its description asks for: its body is set, or it is saved and loaded."""
    description = description_of(given)
    if description == "setter":
        model.inertias[1] = pin.Inertia(given.mass, given.com, given.inertia_com)
    if description == "mass":
        model.inertias[1].mass = given.mass  # an inertia about the centre of mass, which stays
    if description in ("saved", "rewritten"):
        kind, loaded = "Binary" if description == "saved" else "XML", pin.Model()
        with TemporaryDirectory() as folder:
            arguments = (f"{folder}/body", *(("model",) if kind == "XML" else ()))
            getattr(model, f"saveTo{kind}")(*arguments)
            getattr(loaded, f"loadFrom{kind}")(*arguments)
        return loaded
    return model


def _cross_motions(a, b):
    """Return the commutator of twists: linear velocity first, in body axes."""
    return np.concatenate([_cross(a[3:], b[:3]) + _cross(a[:3], b[3:]), _cross(a[3:], b[3:])])


def _cross(a, b):
    """Return a x b for single vectors; `numpy.cross` costs more than `aba`."""
    a1, a2, a3 = a.tolist()
    b1, b2, b3 = b.tolist()
    return np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])
