"""In maximal coordinates, a body without a shape does not move until `changeDynamics` sets the mass that it was made with."""

import pybullet as p

p.connect(p.DIRECT)


def turned(shape, **mass):
    p.resetSimulation()
    p.setPhysicsEngineParameter(fixedTimeStep=0.01, numSubSteps=0)
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1) if shape else -1
    body = p.createMultiBody(1.0, ball, useMaximalCoordinates=True)
    p.changeDynamics(body, -1, localInertiaDiagonal=[1, 1, 1], angularDamping=0, **mass)
    p.resetBaseVelocity(body, [0, 0, 0], [0, 0, 1])
    for _ in range(100):
        p.stepSimulation()
    return p.getEulerFromQuaternion(p.getBasePositionAndOrientation(body)[1])[2]


bare, again, ball = turned(False), turned(False, mass=1.0), turned(True)
print(f"at 1 rad/s it turned by {bare:.3f} rad in 1 s, with the mass set again {again:.3f}, with a shape {ball:.3f}:", end=" ")
print("wrong" if abs(bare - 1) > 0.01 else "right")
