"""Errors of `cenic` with error control fall with the square root of the accuracy."""

import numpy as np
import pydrake.all as drake


def quaternion(scheme, accuracy):
    builder = drake.DiagramBuilder()
    plant, _ = drake.AddMultibodyPlantSceneGraph(builder, 0.0)
    plant.set_name("plant")
    inertia = drake.SpatialInertia.MakeFromCentralInertia(1.0, np.zeros(3), drake.RotationalInertia(13.0, 5.0, 10.0))
    body = plant.AddRigidBody("body", inertia)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    plant.Finalize()
    simulator = drake.Simulator(builder.Build())
    drake.ResetIntegratorFromFlags(simulator, scheme, 0.01)
    simulator.get_mutable_integrator().set_target_accuracy(accuracy)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    velocity = drake.SpatialVelocity(np.array([1.0, 2.0, 3.0]), np.zeros(3))
    plant.SetFreeBodySpatialVelocity(context=context, body=body, V_JpJc=velocity)
    simulator.AdvanceTo(1.0)
    return plant.GetPositions(context)[:4].copy(), simulator.get_integrator().get_num_steps_taken()


best, texts, errors, accuracies = quaternion("runge_kutta5", 1e-13)[0], [], [], (1e-5, 1e-6, 1e-7)
for accuracy in accuracies:
    q, steps = quaternion("cenic", accuracy)
    errors.append(2 * np.linalg.norm(q - best))
    texts.append(f"{errors[-1]:.1e} rad at {accuracy:g} in {steps} steps")
power = np.log(errors[0] / errors[-1]) / np.log(accuracies[0] / accuracies[-1])
print(f"error after 1 s: {', '.join(texts)}, power {power:.2f} of the accuracy:", "wrong" if power < 0.75 else "right")
