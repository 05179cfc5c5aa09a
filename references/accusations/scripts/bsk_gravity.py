"""`MJScene` switches the gravity of the model off, without a message."""

from Basilisk.simulation import mujoco
from Basilisk.utilities import SimulationBaseClass

TEXT = """<mujoco><option gravity="0 0 -9.81"/><worldbody><body name="body"><freejoint/>
<inertial mass="1" pos="0 0 0" diaginertia="13 5 10"/></body></worldbody></mujoco>"""
simulation = SimulationBaseClass.SimBaseClass()
simulation.CreateNewProcess("process").addTask(simulation.CreateNewTask("task", 10**7))
scene = mujoco.MJScene(TEXT)
scene.ModelTag = "scene"
simulation.AddModelToTask("task", scene)
simulation.InitializeSimulation()
simulation.ConfigureStopTime(10**9)
simulation.ExecuteSimulation()
height = scene.getBody("body").getOrigin().stateOutMsg.read().r_BN_N[2]
print(
    f"the body is at z = {height:.3f} m after 1 s, by the model at -4.905 m:", "wrong" if abs(height + 4.905) > 0.1 else "right"
)
