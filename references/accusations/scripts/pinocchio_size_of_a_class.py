"""MJCF: if a shape has fewer sizes than its class, the others are not taken from the class."""

import sys

import pinocchio as pin

inertia, mass = pin.buildModelFromMJCF(sys.argv[1]).inertias[1], 1.2 + 8 * 1900 * 0.04 * 0.15 * 0.05
print(f"the mass is {inertia.mass:.4g} kg, in the file {mass:.4g} kg:", end=" ")
print("wrong" if abs(inertia.mass - mass) > 1e-6 else "right")
