"""MJCF: `inertiagrouprange` is ignored."""

import sys

import pinocchio as pin

mass = pin.buildModelFromMJCF(sys.argv[1]).inertias[1].mass
print(f"the mass is {mass:.4g} kg, in the file 6 kg:", "wrong" if abs(mass - 6) > 1e-6 else "right")
