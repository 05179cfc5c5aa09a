"""With `collapse_fixed_joints`, a fixed child is added about the root link's origin, not about the common centre of mass."""

import sys

import newton
import numpy as np

builder = newton.ModelBuilder()
builder.add_urdf(sys.argv[1], collapse_fixed_joints=True, floating=True)
masses, centres = np.array([2.3, 0.9]), np.array([[0.12, -0.07, 0.2], [0.3, -0.2, 0.1]])
inertias, com = np.array([[0.021, 0.034, 0.041], [0.011, 0.007, 0.016]]), masses @ centres / masses.sum()
arms = centres - com
in_file = sum(np.diag(J) + m * (a @ a * np.eye(3) - np.outer(a, a)) for J, m, a in zip(inertias, masses, arms))
loaded = np.array(builder.body_inertia[0]).reshape(3, 3)
print(
    f"Ixx, Iyy, Izz about the centre of mass are {np.diag(loaded).round(4)}, in the file {np.diag(in_file).round(4)}:", end=" "
)
print("wrong" if abs(loaded - in_file).max() > 1e-5 else "right")
