"""Newton in its environment. Source: its documentation, Solvers; its example `basic_dzhanibekov`; Warp's, Graphs."""

from functools import partial

import numpy as np

DAMPED = ("SemiImplicit", "Featherstone")
WITH_MEMORY = ("VBD", "Kamino")
"""Solvers that keep something from step to step beside the state, which `reset` clears."""
NOT_RECORDED = "VBD"
"""A record of its step takes the pose of each step for the one before it, so that nothing moves."""


def prepare(given):
    """Return a run of one free body; its kernels are compiled here."""
    import newton
    import warp

    warp.config.quiet = True
    warp.set_device("cpu")
    model = _model(newton, warp, given)
    solver, contacts = _solver(newton, model, given), _contacts(newton, model, given)
    states, start, control = (model.state(), model.state()), model.state(), model.control()

    def step(before, after):
        before.clear_forces()
        solver.step(before, after, control, contacts, given.dt)

    def renew():
        for state in states:
            _start(state, start)
        if given.solver in WITH_MEMORY:
            solver.reset(states[0], flags=0)  # which leaves the state

    steps = [partial(step, *states), partial(step, *reversed(states))]
    for each in steps:
        each()
    steps = steps if given.solver == NOT_RECORDED else [_record(warp, each) for each in steps]
    return partial(_march, steps, [_views(state) for state in states], renew, given.steps)


def _start(state, start):
    for name in ("body_q", "body_qd", "joint_q", "joint_qd"):
        getattr(state, name).assign(getattr(start, name))


def _march(steps, views, renew, counts):
    """Return samples of a run. States are written in turns, each from the other."""
    renew()
    q, w = np.empty((len(counts), 4)), np.empty((len(counts), 3))
    done = 0
    for sample, count in enumerate(counts.tolist()):
        for number in range(done, count):
            steps[number % 2]()
        done = count
        pose, velocity = views[done % 2]
        q[sample], w[sample] = pose[[6, 3, 4, 5]], velocity[3:]
    return {"q": q, "w_W": w}


def _views(state):
    """Return what the engine computes with, as arrays: position and quaternion, scalar last; velocities in the world."""
    return state.body_q.numpy()[0], state.body_qd.numpy()[0]


def _record(warp, step):
    """Return what replays a step; the step itself, where a version of Warp records none on the CPU."""
    try:
        with warp.ScopedCapture() as capture:
            step()
    except RuntimeError:
        return step
    return partial(warp.capture_launch, capture.graph)


def _model(newton, warp, given):
    builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
    if given.solver == "Kamino":
        newton.solvers.SolverKamino.register_custom_attributes(builder)
    w, x, y, z = given.q0.tolist()
    body = builder.add_body(
        xform=warp.transform((0.0, 0.0, 0.0), (x, y, z, w)),
        mass=given.mass,
        inertia=warp.mat33(*np.diag(given.moments).ravel().tolist()),
    )
    velocity = [0.0, 0.0, 0.0, *given.w0_W.tolist()]
    builder.body_qd[body], builder.joint_qd = warp.spatial_vector(*velocity), velocity
    if given.solver == "VBD":
        builder.color()
    return builder.finalize(device="cpu")


def _solver(newton, model, given):
    name, _, integrator = given.solver.partition("_")
    options = {"integrator": integrator} if integrator else {}
    if not given.as_installed and name in DAMPED:
        options["angular_damping"] = 0.0
    if not given.as_installed and name == "MuJoCo":
        options["disable_contacts"] = True
    if not given.as_installed and name == "Kamino":
        sparse = {"dynamics_solver": "dvi", "sparse_dynamics": True, "sparse_jacobian": True}
        options["config"] = newton.solvers.SolverKamino.Config.from_model(model, **sparse)
    return getattr(newton.solvers, f"Solver{name}")(model, **options)


def _contacts(newton, model, given):
    """Return a place for contacts, without which VBD does not step."""
    return newton.CollisionPipeline(model).contacts() if given.solver == "VBD" else None
