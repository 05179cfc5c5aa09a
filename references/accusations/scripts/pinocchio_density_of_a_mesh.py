"""MJCF: the density of a mesh is ignored."""

import sys

import numpy as np
import pinocchio as pin

corners = np.array([[0.1, 0, 0], [-0.1, 0.15, 0], [-0.05, -0.2, 0.02], [0.03, 0.05, 0.3]])  # of part.obj, beside the file
mass = 1900 * abs(np.linalg.det(corners[1:] - corners[0])) / 6
loaded = pin.buildModelFromMJCF(sys.argv[1]).inertias[1].mass
print(f"the mass is {loaded:.4g} kg, in the file {mass:.4g} kg:", "wrong" if abs(loaded - mass) > 1e-3 else "right")
