"""With `implicitfast`, a needle whose inertia is that of a fixed child moves otherwise than one body (issue 3553)."""

import sys

import mujoco
import numpy as np

J, w, text, energies = np.array([1.7231e-4, 6.58e-6, 1.7243e-4]), np.array([21.0, 35.0, -17.0]), open(sys.argv[1]).read(), []
child = text.replace("<inertial", "<body><inertial").replace("</body>", "</body></body>", 1)
for file in (text, child):
    model = mujoco.MjModel.from_xml_string(file)
    data = mujoco.MjData(model)
    data.qvel[-3:] = w
    mujoco.mj_step(model, data, 1000)
    energies.append(J @ data.qvel[-3:] ** 2 / (J @ w**2))
print("energy after 1 s over energy at the start: {:.3f}, with a fixed child {:.3f}:".format(*energies), end=" ")
print("wrong" if abs(energies[1] - energies[0]) > 1e-3 else "right")
