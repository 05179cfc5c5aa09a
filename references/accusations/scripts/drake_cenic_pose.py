"""After a fixed step of `cenic`, `EvalBodyPoseInWorld` returns the pose before the step."""

import numpy as np
import pydrake.all as drake


def angles(scheme):
    builder = drake.DiagramBuilder()
    plant, _ = drake.AddMultibodyPlantSceneGraph(builder, 0.0)
    plant.set_name("plant")
    inertia = drake.SpatialInertia.MakeFromCentralInertia(1.0, np.zeros(3), drake.RotationalInertia(13.0, 5.0, 10.0))
    body = plant.AddRigidBody("body", inertia)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    plant.Finalize()
    simulator = drake.Simulator(builder.Build())
    drake.ResetIntegratorFromFlags(simulator, scheme, 0.01)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    velocity = drake.SpatialVelocity(np.array([1.0, 2.0, 3.0]), np.zeros(3))
    plant.SetFreeBodySpatialVelocity(context=context, body=body, V_JpJc=velocity)
    simulator.AdvanceTo(0.01)
    poses = plant.EvalBodyPoseInWorld(context, body), plant.GetFreeBodyPose(context, body)
    return [pose.rotation().ToAngleAxis().angle() for pose in poses]


(pose, state), (other, _) = angles("cenic"), angles("runge_kutta3")
text = f"it turned by {pose:.4f} rad by EvalBodyPoseInWorld, {state:.4f} rad by GetFreeBodyPose"
print(
    f"after a step, {text}, with runge_kutta3 {other:.4f} rad by the former:", "wrong" if abs(pose - state) > 1e-6 else "right"
)
