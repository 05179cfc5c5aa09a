"""Basilisk's spacecraft hub against its MJScene, both with Runge and Kutta's integrator: two back ends of one product.

Run it where Basilisk is installed (`pip install bsk`): `python basilisk.py`.
"""

import numpy as np
from scipy.spatial.transform import Rotation

import conservative as cv

MODEL = """<mujoco><option gravity="0 0 0"/><worldbody><body name="body"><freejoint/>
<inertial pos="0 0 0" mass="1" fullinertia="{}"/></body></worldbody></mujoco>"""


def hub(R0, w0, inertia, dt, n):
    """Return the motion of a spacecraft hub."""
    from Basilisk.simulation import spacecraft

    craft = spacecraft.Spacecraft()
    craft.hub.mHub, craft.hub.IHubPntBc_B = 1.0, inertia.tolist()
    craft.hub.r_BcB_B = craft.hub.r_CN_NInit = craft.hub.v_CN_NInit = [[0.0], [0.0], [0.0]]
    craft.hub.sigma_BNInit = [[x] for x in Rotation.from_matrix(R0).as_mrp()]
    craft.hub.omega_BN_BInit = [[x] for x in w0]
    return run(craft, craft.scStateOutMsg, dt, n)


def scene(R0, w0, inertia, dt, n):
    """Return the motion of a body in an MJScene."""
    from Basilisk.simulation import mujoco

    six = [inertia[i, k] for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    system = mujoco.MJScene(MODEL.format(" ".join(repr(float(x)) for x in six)))
    body = system.getBody("body")
    start = Rotation.from_matrix(R0).as_mrp().tolist(), w0.tolist()
    return run(system, body.getOrigin().stateOutMsg, dt, n, body, start)


def run(system, message, dt, n, body=None, start=None):
    """Return the attitudes and rates of a message after each step."""
    from Basilisk.simulation import svIntegrators
    from Basilisk.utilities import SimulationBaseClass

    step = round(dt * 1e9)  # nanoseconds
    if abs(step * 1e-9 / dt - 1) > 1e-9:
        raise NotImplementedError(f"Basilisk's steps are whole nanoseconds, unlike {dt:g} s")
    simulation, recorder = SimulationBaseClass.SimBaseClass(), message.recorder()
    simulation.CreateNewProcess("process").addTask(simulation.CreateNewTask("task", step))
    simulation.AddModelToTask("task", system)
    simulation.AddModelToTask("task", recorder)
    integrator = svIntegrators.svIntegratorRK4(system)
    system.setIntegrator(integrator)
    simulation.InitializeSimulation()
    if body is not None:
        body.setAttitude(start[0])
        body.setAttitudeRate(start[1])
    simulation.ConfigureStopTime(n * step)
    simulation.ExecuteSimulation()
    end = message.read()
    sigma, w = (np.array(x)[:n] for x in (recorder.sigma_BN, recorder.omega_BN_B))
    return Rotation.from_mrp([*sigma, end.sigma_BN]).as_matrix(), np.array([*w, end.omega_BN_B])


if __name__ == "__main__":
    print(cv.verification.parity(hub, scene).sentence)
