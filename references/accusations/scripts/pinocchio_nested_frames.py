"""MJCF: shapes in a `<frame>` are ignored."""

import sys
from math import pi

import pinocchio as pin

mass = 8 * 0.1 * 0.15 * 0.05 * 800 + pi * 0.05**2 * 0.4 * 1200
loaded = pin.buildModelFromMJCF(sys.argv[1]).inertias[1].mass
print(f"the mass is {loaded:.4g} kg, in the file {mass:.4g} kg:", "wrong" if abs(loaded - mass) > 1e-3 else "right")
