"""With default settings, the rates of a body depend on the unit of its moments: below 1e-7 kg m^2 in the fifth digit."""

import exudyn as exu
import numpy as np
from exudyn.utilities import RigidBodyInertia


def rates(scale):
    mbs = exu.SystemContainer().AddSystem()
    inertia = RigidBodyInertia(mass=1.7, inertiaTensor=scale * np.diag([2.1, 3.3, 4.2]))
    body = mbs.CreateRigidBody(inertia=inertia, initialAngularVelocity=[0.9, -1.1, 0.7])
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps, settings.timeIntegration.endTime = 100, 1
    settings.timeIntegration.verboseMode = 0
    mbs.SolveDynamic(settings)
    return np.array(mbs.GetObjectOutputBody(body, exu.OutputVariableType.AngularVelocityLocal, [0, 0, 0]))


large, scales = rates(1), (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
errors = [abs(rates(scale) - large).max() for scale in scales]
texts = [f"{error:.1e} rad/s at {2.1 * scale:.1e}" for error, scale in zip(errors, scales)]
print(f"difference of the rates after 1 s by the smallest moment, kg m^2: {', '.join(texts)}:", end=" ")
print("wrong" if max(errors) > 1e-6 else "right")
