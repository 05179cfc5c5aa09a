"""In fixed steps of `cenic`, a body with little energy keeps its rates."""

import numpy as np
import pydrake.all as drake


def rates(moment):
    builder = drake.DiagramBuilder()
    plant, _ = drake.AddMultibodyPlantSceneGraph(builder, 0.0)
    plant.set_name("plant")
    inertia = drake.SpatialInertia.MakeFromCentralInertia(
        1.0, np.zeros(3), drake.RotationalInertia(1.3 * moment, 0.5 * moment, moment)
    )
    body = plant.AddRigidBody("body", inertia)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    plant.Finalize()
    simulator = drake.Simulator(builder.Build())
    drake.ResetIntegratorFromFlags(simulator, "cenic", 0.01)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    velocity = drake.SpatialVelocity(np.array([1.0, 2.0, 3.0]), np.zeros(3))
    plant.SetFreeBodySpatialVelocity(context=context, body=body, V_JpJc=velocity)
    simulator.AdvanceTo(1.0)
    return plant.GetVelocities(context)[:3].copy()


usual, moments = rates(10.0), 10.0 ** -np.arange(10, 17)
errors = [abs(rates(moment) - usual).max() for moment in moments]
texts = [f"{error:.3f} rad/s at {moment:g}" for error, moment in zip(errors, moments)]
print(
    f"difference of the rates after 1 s by the moment, kg m^2: {', '.join(texts)}:", "wrong" if max(errors) > 1e-3 else "right"
)
