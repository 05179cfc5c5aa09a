"""In maximal coordinates, a body with moments below about 4e-6 kg m^2 does not move as one with larger ones."""

import pybullet as p

p.connect(p.DIRECT)


def move(scale):
    p.resetSimulation()
    p.setPhysicsEngineParameter(fixedTimeStep=0.01, numSubSteps=0)
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    body = p.createMultiBody(1.7, shape, -1, [0, 0, 0], useMaximalCoordinates=True)
    p.changeDynamics(body, -1, mass=1.7, localInertiaDiagonal=[scale * moment for moment in (2.1, 3.3, 4.2)])
    p.changeDynamics(body, -1, linearDamping=0, angularDamping=0, activationState=p.ACTIVATION_STATE_DISABLE_SLEEPING)
    p.resetBaseVelocity(body, [0, 0, 0], [0.9, -1.1, 0.7])
    for _ in range(100):
        p.stepSimulation()
    return p.getBaseVelocity(body)[1]


scales = (1, 1e-4, 2e-6, 1e-6, 1e-9)
errors = {scale: max(abs(a - b) for a, b in zip(move(scale), move(1))) for scale in scales}
texts = [f"{error:.1e} rad/s at {2.1 * scale:.1e}" for scale, error in errors.items()]
print("difference of the rates after 1 s by the smallest moment, kg m^2:", ", ".join(texts) + ":", end=" ")
print("wrong" if max(errors.values()) > 1e-6 else "right")
