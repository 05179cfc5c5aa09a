"""MJCF: the `mass` of a class is ignored. Its shapes, sizes and density are used."""

import sys

import pinocchio as pin

mass = pin.buildModelFromMJCF(sys.argv[1]).inertias[1].mass
print(f"the mass is {mass:.4g} kg, in the file 1.2 kg:", "wrong" if abs(mass - 1.2) > 1e-6 else "right")
