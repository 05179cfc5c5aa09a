"""Drake in its environment. Source: its documentation, MultibodyPlant, Simulator, ResetIntegratorFromFlags."""

import numpy as np


def prepare(given):
    """Return a run of one free body on a quaternion floating joint, advanced from sample to sample by Drake's Simulator."""
    import pydrake.all as drake

    plant, body, simulator = _build(drake, given)
    context = simulator.get_mutable_context()
    inner = plant.GetMyMutableContextFromRoot(context)
    pose = drake.RigidTransform(drake.Quaternion(given.q0 / np.linalg.norm(given.q0)), np.zeros(3))
    spin = drake.SpatialVelocity(given.w0_W, np.zeros(3))
    times = given.steps * given.dt

    def run():
        context.SetTime(0.0)
        plant.SetFreeBodyPose(inner, body, pose)
        plant.SetFreeBodySpatialVelocity(context=inner, body=body, V_JpJc=spin)
        simulator.Initialize()
        R, w = np.empty((len(times), 3, 3)), np.empty((len(times), 3))
        for sample, time in enumerate(times.tolist()):
            simulator.AdvanceTo(time)
            R[sample] = plant.EvalBodyPoseInWorld(inner, body).rotation().matrix()
            w[sample] = plant.EvalBodySpatialVelocityInWorld(inner, body).rotational()
        return {"R": R, "w_W": w}

    return run


def _build(drake, given):
    discrete = given.integrator == "discrete"
    builder = drake.DiagramBuilder()
    plant = builder.AddSystem(drake.MultibodyPlant(given.dt if discrete else 0.0))
    inertia = drake.RotationalInertia(*given.moments)
    body = plant.AddRigidBody("body", drake.SpatialInertia.MakeFromCentralInertia(given.mass, np.zeros(3), inertia))
    plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
    plant.Finalize()
    simulator = drake.Simulator(builder.Build())
    if not discrete:
        _choose(drake, simulator, given)
    return plant, body, simulator


def _choose(drake, simulator, given):
    """Choose the integrator: in fixed steps, or in its own to an accuracy."""
    if given.integrator not in drake.GetIntegrationSchemes():
        raise NotImplementedError(f"Drake has no integrator {given.integrator}, but {', '.join(drake.GetIntegrationSchemes())}")
    drake.ResetIntegratorFromFlags(simulator, given.integrator, given.dt)
    integrator = simulator.get_mutable_integrator()
    if given.accuracy:
        integrator.set_target_accuracy(given.accuracy)
    else:
        _fix_steps(integrator)


def _fix_steps(integrator):
    try:
        integrator.set_fixed_step_mode(True)
    except RuntimeError:  # one without error estimates, whose steps are fixed
        return
