"""As installed, damping takes energy from a free brick."""

import numpy as np
import pybullet as p

p.connect(p.DIRECT)
J = np.array([13.0, 5.0, 10.0])


def energy(body):
    R = np.reshape(p.getMatrixFromQuaternion(p.getBasePositionAndOrientation(body)[1]), (3, 3))
    return J @ (R.T @ p.getBaseVelocity(body)[1]) ** 2 / 2


def energy_left(**damping):
    p.resetSimulation()
    p.setPhysicsEngineParameter(fixedTimeStep=0.01, numSubSteps=0)
    body = p.createMultiBody(1.0)
    p.changeDynamics(body, -1, localInertiaDiagonal=J.tolist(), **damping)
    p.resetBaseVelocity(body, [0, 0, 0], [0, 0.05, 10])
    first = energy(body)
    for _ in range(600):
        p.stepSimulation()
    return energy(body) / first


rest, undamped = energy_left(), energy_left(angularDamping=0)
print(f"energy after 6 s over energy at the start: {rest:.3f}, without damping {undamped:.3f}:", end=" ")
print("wrong" if rest < 0.99 else "right")
