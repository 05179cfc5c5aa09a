"""URDF: `quat_xyzw`, an attribute of version 1.1, is ignored in the inertial frame."""

import sys

import mujoco
import numpy as np

model = mujoco.MjModel.from_xml_string(
    open(sys.argv[1]).read().replace("<link", '<mujoco><compiler fusestatic="false"/></mujoco><link', 1)
)
R, (x, y, z, s) = np.zeros(9), (0.2, -0.4, 0.1, 0.8888194417315589)
mujoco.mju_quat2Mat(R, model.body_iquat[-1])
loaded = R.reshape(3, 3) @ np.diag(model.body_inertia[-1]) @ R.reshape(3, 3).T
mujoco.mju_quat2Mat(R, np.array((s, x, y, z)))
written = np.array([[0.021, 0.002, -0.003], [0.002, 0.034, 0.004], [-0.003, 0.004, 0.041]])
in_file = R.reshape(3, 3) @ written @ R.reshape(3, 3).T
print(f"Ixx, Iyy, Izz are {np.diag(loaded).round(4)}, in the file {np.diag(in_file).round(4)}:", end=" ")
print("wrong" if abs(loaded - in_file).max() > 1e-6 else "right")
