"""`MJScene` has order 2 with RK4, except with `highOrderAttitudeIntegration`."""

import numpy as np
from Basilisk.simulation import mujoco, svIntegrators
from Basilisk.utilities import SimulationBaseClass

TEXT = """<mujoco><worldbody><body name="body"><freejoint/><inertial mass="1" pos="0 0 0" diaginertia="13 5 10"/></body>
</worldbody></mujoco>"""


def attitude(steps, high):  # modified Rodrigues parameters after 1 s
    simulation, step = SimulationBaseClass.SimBaseClass(), 10**9 // steps
    simulation.CreateNewProcess("process").addTask(simulation.CreateNewTask("task", step))
    scene = mujoco.MJScene(TEXT)
    scene.ModelTag, scene.highOrderAttitudeIntegration = "scene", high
    simulation.AddModelToTask("task", scene)
    integrator = svIntegrators.svIntegratorRK4(scene)
    scene.setIntegrator(integrator)
    simulation.InitializeSimulation()
    scene.getBody("body").setAttitudeRate([1.0, 2.0, 3.0])
    simulation.ConfigureStopTime(10**9)
    simulation.ExecuteSimulation()
    return np.array(scene.getBody("body").getOrigin().stateOutMsg.read().sigma_BN)


def order(high):
    errors = [np.linalg.norm(attitude(steps, high) - attitude(6400, True)) for steps in (25, 50, 100)]
    return np.log2(errors[0] / errors[2]) / 2


usual, high = order(False), order(True)
print(f"order of the attitude {usual:.1f}, with highOrderAttitudeIntegration {high:.1f}:", "wrong" if usual < 3 else "right")
