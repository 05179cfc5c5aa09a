"""Drake with its discrete plant or one of its integrators, in its own loop (`Simulator.AdvanceTo`).

A free body is on Drake's quaternion floating joint. A body about a fixed point is on `BallRpyJoint`, Drake's only ball joint,
whose coordinates are roll, pitch and yaw: errors grow when the first principal axis comes near the vertical, and a run in which
it reaches the vertical ends there. A fixed spring with a rest length is a `LinearSpringDamper`. Other fields, except gravity,
are a `LeafSystem` in Python, which Drake calls in each evaluation. Switched off: error control (`set_fixed_step_mode`), unless
an accuracy is given or the integrator is "default". After a fixed step of "cenic", the cache is invalidated
(`references/accusations/scripts/drake_cenic_pose.py`).

Parameters
----------
integrator
    "discrete" (the plant's own update), one of Drake's integrators for a continuous plant, such as "runge_kutta5" or "cenic",
    or "default": the integrator of `Simulator`, with error control and steps of at most dt.
accuracy
    Relative accuracy of adaptive steps of at most dt, up to 1; 0 for fixed steps of dt.

References
----------
Simulator: https://drake.mit.edu/doxygen_cxx/classdrake_1_1systems_1_1_simulator.html
Its defaults: https://github.com/RobotLocomotion/drake/blob/master/systems/analysis/simulator_config.h
Fixed steps: https://drake.mit.edu/doxygen_cxx/classdrake_1_1systems_1_1_integrator_base.html
BallRpyJoint: https://drake.mit.edu/doxygen_cxx/classdrake_1_1multibody_1_1_ball_rpy_joint.html
CENIC: https://drake.mit.edu/doxygen_cxx/classdrake_1_1multibody_1_1_cenic_integrator.html
Springs: https://drake.mit.edu/doxygen_cxx/classdrake_1_1multibody_1_1_linear_spring_damper.html
No ball joint of quaternions: https://github.com/RobotLocomotion/drake/issues/12404
"""

from contextlib import suppress

import numpy as np

from .shared import FAR_MASS, FIELDS, LATER, OTHER_MASS, description_of, field_torque, halves, pack_field, rescaled, write_urdf

ENGINE = {
    "package": "drake",
    "module": "pydrake.all",
    "oldest": "1.40",
    "settings": {"integrator": "runge_kutta5", "accuracy": 0.0},
    "orders": {
        **{"default": None, "discrete": 1, "explicit_euler": 1, "semi_explicit_euler": 1, "implicit_euler": 1},
        **{"velocity_implicit_euler": 1, "runge_kutta2": 2, "runge_kutta3": 3, "runge_kutta5": 5, "bogacki_shampine3": 3},
        **{"radau1": 1, "radau3": 3, "cenic": 1},
    },
    "tolerance": "accuracy",
    "fields": FIELDS,
    "descriptions": ("frame", "offset", "file", "setter", "child", "world", "time", "mass"),
    "method_info": {
        "variants": (
            *("discrete", "cenic", "runge_kutta3", "runge_kutta5"),
            *("runge_kutta5,accuracy=1e-12", "runge_kutta5,accuracy=1e-16"),
        ),
        "suite": ("discrete", "runge_kutta5"),
        "as_installed": ("default",),
        "flight": True,
    },
}


def prepare(given):
    """Return a run of one body."""
    import pydrake.all as drake

    if given.accuracy and given.integrator == "discrete":
        raise NotImplementedError("the discrete plant has no accuracy")
    plant, body, simulator = _build(drake, given)
    context = simulator.get_mutable_context()
    inner = plant.GetMyMutableContextFromRoot(context)
    _set_body(drake, body, inner, given)
    start = _start(drake, plant, body, inner, given)
    begin = LATER if description_of(given) == "time" else 0.0
    times = begin + given.steps * given.dt

    def run():
        R, (w, p, v) = np.full((len(times), 3, 3), np.nan), np.full((3, len(times), 3), np.nan)
        reason = ""
        try:
            context.SetTime(begin)
            start()
            if given.integrator != "discrete":
                simulator.get_mutable_integrator().Reset()  # it would begin with the step at which the last run ended
                _choose(drake, simulator, given)
            simulator.Initialize()
            for sample, time in enumerate(times.tolist()):
                if sample:  # AdvanceTo(0) would update a discrete plant
                    simulator.AdvanceTo(time)
                if given.integrator == "cenic":  # see above
                    context.get_mutable_continuous_state()
                pose, velocity = plant.EvalBodyPoseInWorld(inner, body), plant.EvalBodySpatialVelocityInWorld(inner, body)
                R[sample], w[sample], p[sample] = pose.rotation().matrix(), velocity.rotational(), pose.translation()
                v[sample] = velocity.translational()
        except RuntimeError as error:
            if "singularity" not in str(error):
                raise
            reason = "Drake's BallRpyJoint has reached a singularity"
        return {"R": R, "w_W": w, "reason": reason, **({"p": p, "v": v} if hasattr(given, "p_WB0") else {})}

    return run


def _start(drake, plant, body, context, given):
    """Return a function that sets the initial state."""
    turn = drake.RotationMatrix(drake.Quaternion(given.q0 / np.linalg.norm(given.q0)))
    if given.free:
        p0, v0 = getattr(given, "p_WB0", np.zeros(3)), getattr(given, "v_WB0", np.zeros(3))
        pose, spin = drake.RigidTransform(turn, p0), drake.SpatialVelocity(given.w0_W, v0)

        def start():
            plant.SetFreeBodyPose(context, body, pose)
            plant.SetFreeBodySpatialVelocity(context=context, body=body, V_JpJc=spin)

    else:
        joint, angles = plant.GetJointByName("support"), drake.RollPitchYaw(turn).vector()

        def start():
            joint.set_angles(context, angles)
            joint.set_angular_velocity(context, given.w0_W)

    return start


def _build(drake, given):
    discrete = given.integrator == "discrete"
    builder = drake.DiagramBuilder()
    if given.integrator == "cenic":  # it finds the plant by its name, and needs a scene graph
        plant, _ = drake.AddMultibodyPlantSceneGraph(builder, 0.0)
    else:
        plant = builder.AddSystem(drake.MultibodyPlant(given.dt if discrete else 0.0))
    if description_of(given) == "world":
        plant.AddRigidBody("far", drake.SpatialInertia.SolidSphereWithMass(FAR_MASS, 2.0))
    if description_of(given) in ("file", "setter", "mass"):
        factor = 1.0 if description_of(given) == "file" else OTHER_MASS
        text = write_urdf(rescaled(given, mass=factor, inertia=factor))
        drake.Parser(plant).AddModelsFromString(text, "urdf")
        body = plant.GetBodyByName("body")
    else:
        body, *child = (_add_body(drake, plant, given, *part, name) for part, name in zip(halves(given), ("body", "child")))  # noqa: B905
        if child:
            plant.WeldFrames(body.body_frame(), child[0].body_frame())
    plant.mutable_gravity_field().set_gravity_vector([0, 0, -given.gravity])
    if not given.free:
        plant.AddJoint(drake.BallRpyJoint("support", plant.world_frame(), body.body_frame()))
    native = given.rest_length and not given.turn.any()
    if native:
        ends = plant.world_body(), given.anchor, body, given.point
        plant.AddForceElement(drake.LinearSpringDamper(*ends, given.rest_length, given.stiffness, 0.0))
    plant.Finalize()
    if not native and pack_field(given).any():
        field = builder.AddSystem(_field_system(drake, pack_field(given).tolist()))
        builder.Connect(plant.get_state_output_port(), field.get_input_port())
        builder.Connect(field.get_output_port(), plant.get_applied_generalized_force_input_port())
    simulator = drake.Simulator(builder.Build())
    if not discrete:
        _choose(drake, simulator, given)
    return plant, body, simulator


def _set_body(drake, body, context, given):
    """Set the inertia in a context, or the mass, with which `SetMass` scales the inertia."""
    if description_of(given) == "setter":
        body.SetSpatialInertiaInBodyFrame(context, _inertia(drake, given, given.mass, given.inertia_com))
    if description_of(given) == "mass":
        body.SetMass(context, given.mass)


def _inertia(drake, given, mass, inertia):
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia.tolist()
    return drake.SpatialInertia.MakeFromCentralInertia(mass, given.com, drake.RotationalInertia(xx, yy, zz, xy, xz, yz))


def _add_body(drake, plant, given, mass, inertia, name):
    return plant.AddRigidBody(name, _inertia(drake, given, mass, inertia))


def _field_system(drake, field):
    """Return a system whose input is the state of a `BallRpyJoint`, and whose output is its torque, which is in world axes."""
    system = drake.LeafSystem()
    state = system.DeclareVectorInputPort("state", 6)

    def torque(context, output):
        R = drake.RollPitchYaw(state.Eval(context)[:3]).ToRotationMatrix().matrix()
        output.SetFromVector(R @ field_torque(field, R.ravel().tolist(), context.get_time()))

    system.DeclareVectorOutputPort("torque", 3, torque)
    return system


def _choose(drake, simulator, given):
    """Set the integrator, with fixed steps or an accuracy."""
    if given.integrator == "default":
        simulator.get_mutable_integrator().set_maximum_step_size(given.dt)
    elif given.integrator in drake.GetIntegrationSchemes():
        drake.ResetIntegratorFromFlags(simulator, given.integrator, given.dt)
    else:
        schemes = ", ".join(drake.GetIntegrationSchemes())
        raise NotImplementedError(f"Drake has no integrator {given.integrator}, but {schemes}")
    integrator = simulator.get_mutable_integrator()
    if given.accuracy:
        integrator.set_target_accuracy(given.accuracy)
    elif given.integrator != "default":
        with suppress(RuntimeError):  # integrators without error estimates have fixed steps only
            integrator.set_fixed_step_mode(True)
