"""PyBullet in its environment. Source: its quickstart guide, createMultiBody, changeDynamics, setPhysicsEngineParameter."""

import numpy as np


def prepare(given):
    """Return a run of one body, free or on a spherical joint at the fixed point; Bullet's loop is one step a call."""
    import pybullet as bullet

    client = bullet.connect(bullet.DIRECT)
    turn = [*given.q0[1:], given.q0[0]]  # x, y, z, w
    maximal = given.body == "maximal"

    def build():
        bullet.resetSimulation(client)
        bullet.setGravity(0, 0, 0, client)
        bullet.setPhysicsEngineParameter(fixedTimeStep=given.dt, numSubSteps=0, physicsClientId=client)
        # A body in maximal coordinates that has no shape never moves.
        shape = bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=0.1, physicsClientId=client) if maximal else -1
        options = {"baseOrientation": turn, "useMaximalCoordinates": maximal, "physicsClientId": client}
        body = bullet.createMultiBody(given.mass, shape, **options)
        bullet.changeDynamics(body, -1, localInertiaDiagonal=given.moments.tolist(), physicsClientId=client)
        if not given.as_installed:
            _switch_off(bullet, body, client)
        bullet.resetBaseVelocity(body, [0, 0, 0], given.w0_W.tolist(), physicsClientId=client)
        return body

    def run():
        body = build()
        q, w = np.empty((len(given.steps), 4)), np.empty((len(given.steps), 3))
        for sample, n_steps in enumerate(np.diff(given.steps, prepend=0).tolist()):
            for _ in range(n_steps):
                bullet.stepSimulation(client)
            x, y, z, s = bullet.getBasePositionAndOrientation(body, client)[1]
            q[sample], w[sample] = (s, x, y, z), bullet.getBaseVelocity(body, client)[1]
        return {"q": q, "w_W": w}

    return run


def _switch_off(bullet, body, client):
    """Switch off what keeps a body from turning on: damping, which is .04 by default, sleeping, and a limit of 100 rad/s."""
    awake = bullet.ACTIVATION_STATE_DISABLE_SLEEPING
    nothing = {"linearDamping": 0, "angularDamping": 0, "maxJointVelocity": 1e6}
    bullet.changeDynamics(body, -1, **nothing, activationState=awake, physicsClientId=client)
