"""URDF: `quat_xyzw`, an attribute of version 1.1, is ignored in the inertial frame."""

import sys

import newton
import numpy as np

builder = newton.ModelBuilder()
builder.add_urdf(sys.argv[1], floating=True)
moments, in_file = np.diag(np.array(builder.body_inertia[0]).reshape(3, 3)), np.array([0.0351, 0.0323, 0.0286])
print(
    f"Ixx, Iyy, Izz are {moments.round(4)}, in the file {in_file}:", "wrong" if abs(moments - in_file).max() > 1e-3 else "right"
)
