"""URDF: `quat_xyzw`, an attribute of version 1.1, is ignored in a joint."""

import sys

import mujoco

model = mujoco.MjModel.from_xml_string(
    open(sys.argv[1]).read().replace("<link", '<mujoco><compiler fusestatic="false"/></mujoco><link', 1)
)
loaded, (x, y, z, s) = model.body("arm").quat, (0.2, -0.4, 0.1, 0.8888194417315589)
print(f"the quaternion of the arm is {loaded.round(4)}, in the file [{s:.4f} {x} {y} {z}]:", end=" ")
print("wrong" if abs(loaded - (s, x, y, z)).max() > 1e-6 else "right")
