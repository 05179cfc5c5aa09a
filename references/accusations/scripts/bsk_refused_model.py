"""`MJScene` ends the process if MuJoCo refuses the model."""

import os

from Basilisk.simulation import mujoco
from Basilisk.utilities import SimulationBaseClass

TEXT = """<mujoco><worldbody><body name="body"><freejoint/><inertial mass="1" pos="0 0 0" diaginertia="1 1 {}"/></body>
</worldbody></mujoco>"""


def end(moment):
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    simulation = SimulationBaseClass.SimBaseClass()
    simulation.CreateNewProcess("process").addTask(simulation.CreateNewTask("task", 10**7))
    try:
        scene = mujoco.MJScene(TEXT.format(moment))
        scene.ModelTag = "scene"
        simulation.AddModelToTask("task", scene)
        simulation.InitializeSimulation()
    finally:
        os._exit(0)  # also after an exception, which is right


usual, refused = end(1), end(0)
print(f"exit code of a process {usual}, if a moment is 0 {refused}:", "wrong" if refused else "right")
