"""Newton's solvers on the CPU, in single precision, on a free joint or a ball joint at the fixed point.

Switched off: angular damping of `SolverSemiImplicit` and `SolverFeatherstone`, which is 0.05 by default, and contacts of
`SolverMuJoCo`. `SolverKamino` solves with DVI on sparse matrices, as in Newton's example `basic_dzhanibekov`: thirty times as
fast as its default here, with the same motion. Warp records a step once and replays it; from Python a step takes a hundred
times as long. Only `SolverVBD` is stepped from Python, because it keeps values from step to step that our record does not
contain. Kernels are compiled when a run is prepared, once in the life of an environment, which takes one to four minutes
per solver.

Parameters
----------
solver
    "SemiImplicit", "XPBD", "Featherstone", "VBD", "Kamino", or MuJoCo Warp inside Newton (`SolverMuJoCo`) with an integrator:
    "MuJoCo_euler", "MuJoCo_implicitfast" or "MuJoCo_rk4"; or MuJoCo itself there (`use_mujoco_cpu`): "MuJoCo_cpu_euler",
    "MuJoCo_cpu_implicitfast" or "MuJoCo_cpu_rk4".
as_installed
    True if Newton's own defaults stay: damping, contacts, the solver inside Kamino.

References
----------
Solvers: https://newton-physics.github.io/newton/stable/api/newton_solvers.html
Damping: https://newton-physics.github.io/newton/stable/api/_generated/newton.solvers.SolverSemiImplicit.html
Its own spinning body: https://github.com/newton-physics/newton/blob/main/newton/examples/basic/example_basic_dzhanibekov.py
Warp, graphs: https://nvidia.github.io/warp/
"""

from functools import partial
from tempfile import TemporaryDirectory

import numpy as np

from .shared import FAR_MASS, FAR_PLACE, OTHER_MASS, OTHER_SIZE, description_of, halves, record_warp, rescaled, write_urdf

ORDERS = {
    **{"SemiImplicit": 1, "XPBD": 1, "Featherstone": 1, "VBD": 1, "Kamino": 1},
    **{"MuJoCo_euler": 1, "MuJoCo_implicitfast": 1, "MuJoCo_rk4": 4},
    **{"MuJoCo_cpu_euler": 1, "MuJoCo_cpu_implicitfast": 1, "MuJoCo_cpu_rk4": 2},
}
ENGINE = {
    "package": "newton[sim]",  # without the extra it lacks MuJoCo
    "module": "newton",
    "requirements": ("usd-core<26.9", "newton-usd-schemas", "scipy"),  # its importer of USD; its extra `importers` takes 1 GB
    "oldest": "1.8",  # earlier versions build and step models in other ways
    "settings": {"solver": "MuJoCo_rk4", "as_installed": False},
    "orders": ORDERS,
    "precision": "f32",
    "descriptions": ("frame", "file", "setter", "child", "world", "rewritten", "mass", "scaled"),
    "fields": ("UniformGravity",),
    "free_only": {
        "SemiImplicit": "the joints of SolverSemiImplicit are springs, too stiff for such steps",
        "XPBD": "no settings of SolverXPBD were found with which its ball joint holds a body right",
    },
    "method_info": {
        "variants": (*ORDERS, "SemiImplicit,as_installed=true"),
        "as_installed": ("SemiImplicit,as_installed=true",),
    },
}

DAMPED = ("SemiImplicit", "Featherstone")
OF_FILES = {
    "file": {},
    "rewritten": {},
    "mass": {"mass": OTHER_MASS},
    "scaled": {"length": 1 / OTHER_SIZE, "inertia": OTHER_SIZE**-2},
}
"""Descriptions of a body by a file, and the factors of what the file has."""
DUMMY = (0.1, 0.2, 0.3), np.array([[2.0, 0.1, 0.2], [0.1, 3.0, 0.3], [0.2, 0.3, 4.0]])
"""Centre of mass, m, and inertia, kg m^2, of a body before its setters."""
WITH_MEMORY = ("VBD", "Kamino")
"""Solvers that keep more than the state from step to step, which `reset` clears."""
NOT_RECORDED = ("VBD", "MuJoCo_cpu_euler", "MuJoCo_cpu_implicitfast", "MuJoCo_cpu_rk4")
"""A record does not contain the poses that VBD keeps from step to step. MuJoCo is not Warp's."""


def prepare(given):
    """Return a run of one body, with its kernels compiled."""
    import newton
    import warp

    warp.config.quiet = True
    warp.set_device("cpu")
    model = _model(newton, warp, given)
    solver = _solver(newton, model, given)
    if description_of(given) in ("setter", "mass"):
        _set_body(newton, model, solver, given)
    contacts = newton.CollisionPipeline(model).contacts() if given.solver == "VBD" else None  # VBD does not step without
    states, start, control = (model.state(), model.state()), model.state(), model.control()
    newton.eval_ik(model, start, start.joint_q, start.joint_qd)

    def step(before, after):
        before.clear_forces()
        solver.step(before, after, control, contacts, given.dt)

    steps = [partial(step, *states), partial(step, *reversed(states))]
    for run_step in steps:
        run_step()
    steps = steps if given.solver in NOT_RECORDED else [record_warp(run_step) for run_step in steps]
    # Views of the engine's own arrays: position and quaternion, scalar last; velocities in the world.
    views = [(state.body_q.numpy()[0], state.body_qd.numpy()[0]) for state in states]

    def run():  # steps alternate between two states
        for state in states:
            for name in ("body_q", "body_qd", "joint_q", "joint_qd"):
                getattr(state, name).assign(getattr(start, name))
        if given.solver in WITH_MEMORY:
            solver.reset(states[0], flags=0)  # 0: the state itself stays
        q, w = np.empty((len(given.steps), 4)), np.empty((len(given.steps), 3))
        done = 0
        for sample, count in enumerate(given.steps.tolist()):
            for number in range(done, count):
                steps[number % 2]()
            done = count
            pose, velocity = views[done % 2]
            q[sample], w[sample] = pose[[6, 3, 4, 5]], velocity[3:]
        return {"q": q, "w_W": w}

    return run


def _model(newton, warp, given):
    builder = newton.ModelBuilder()
    builder.gravity = -given.gravity if isinstance(builder.gravity, float) else (0.0, 0.0, -given.gravity)  # until 1.0
    if given.solver == "Kamino":
        newton.solvers.SolverKamino.register_custom_attributes(builder)
    body = _add_body(newton, builder, warp, given)
    lever = given.R0 @ given.com
    if description_of(given) == "world":
        far = warp.transform(FAR_PLACE, (0.0, 0.0, 0.0, 1.0))
        builder.add_body(xform=far, mass=FAR_MASS, inertia=warp.mat33(*(FAR_MASS * np.eye(3)).ravel().tolist()))
    builder.body_qd[body] = warp.spatial_vector(*np.cross(given.w0_W, lever).tolist(), *given.w0_W.tolist())
    if given.solver == "VBD":
        builder.color()
    return builder.finalize(device="cpu")


def _add_body(newton, builder, warp, given):
    """Add the body, on a free joint, or on a ball joint without armature, friction and damping; return its number."""
    w, x, y, z = given.q0.tolist()
    options = {
        "xform": warp.transform((0.0, 0.0, 0.0), (x, y, z, w)),
        "com": warp.vec3(*given.com.tolist()),
        "inertia": warp.mat33(*given.inertia_com.ravel().tolist()),
        "mass": given.mass,
    }
    if description_of(given) == "setter":
        options |= {"com": warp.vec3(*DUMMY[0]), "inertia": warp.mat33(*DUMMY[1].ravel().tolist()), "mass": 1.0}
    of_file = description_of(given) in OF_FILES
    if of_file and given.free:
        _add_file(newton, builder, given)
        builder.body_q[0] = options["xform"]
        return 0
    if given.free and description_of(given) != "child":
        return builder.add_body(**options)
    parts = [{**options, "mass": mass, "inertia": warp.mat33(*inertia.ravel().tolist())} for mass, inertia in halves(given)]
    if of_file:  # its numbers, because a URDF file has no ball joint
        loaded = newton.ModelBuilder()
        _add_file(newton, loaded, given)
        parts = [{**options, **{name: getattr(loaded, f"body_{name}")[0] for name in ("mass", "com", "inertia")}}]
    body = builder.add_link(**parts[0])
    still = {"armature": 0.0, "friction": 0.0, "damping": 0.0}
    joints = [builder.add_joint_free(body) if given.free else builder.add_joint_ball(-1, body, **still)]
    joints += [builder.add_joint_fixed(body, builder.add_link(**part)) for part in parts[1:]]
    builder.add_articulation(joints)
    return body


def _add_file(newton, builder, given):
    """Add the body of a URDF file, or of the MJCF file as which Newton saves it."""
    description = description_of(given)
    text = write_urdf(rescaled(given, **OF_FILES[description]))
    if description != "rewritten":
        builder.add_urdf(text, floating=True, scale=OTHER_SIZE if description == "scaled" else 1.0)
        return
    loaded = newton.ModelBuilder()
    loaded.add_urdf(text, floating=True)
    with TemporaryDirectory() as folder:
        saved = {"save_to_mjcf": f"{folder}/saved.xml", "use_mujoco_cpu": True, "disable_contacts": True}
        newton.solvers.SolverMuJoCo(loaded.finalize(device="cpu"), **saved)
        builder.add_mjcf(saved["save_to_mjcf"])


def _set_body(newton, model, solver, given):
    """Set mass, centre of mass and inertia of the model, or its mass, and tell the solver, which has computed with others.

    Solvers of Newton read the inverses, too, which no setter computes.
    """
    values = {"mass": given.mass, "inv_mass": 1 / given.mass}
    if description_of(given) == "setter":
        values |= {"com": given.com, "inertia": given.inertia_com, "inv_inertia": np.linalg.inv(given.inertia_com)}
    for name, value in values.items():
        getattr(model, f"body_{name}").assign(np.array([value], np.float32))
    solver.notify_model_changed(newton.ModelFlags.BODY_INERTIAL_PROPERTIES)


def _solver(newton, model, given):
    name, *cpu, integrator = given.solver.split("_") if "_" in given.solver else (given.solver, "")
    options = {"integrator": integrator} if integrator else {}
    if cpu:
        options["use_mujoco_cpu"] = True
    if not given.as_installed and name in DAMPED:
        options["angular_damping"] = 0.0
    if not given.as_installed and name == "MuJoCo":
        options["disable_contacts"] = True
    if not given.as_installed and name == "Kamino":
        sparse = {"dynamics_solver": "dvi", "sparse_dynamics": True, "sparse_jacobian": True}
        options["config"] = newton.solvers.SolverKamino.Config.from_model(model, **sparse)
    return getattr(newton.solvers, f"Solver{name}")(model, **options)
