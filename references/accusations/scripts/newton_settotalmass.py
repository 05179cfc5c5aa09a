"""MJCF: `settotalmass` is ignored."""

import sys

import newton

builder = newton.ModelBuilder()
builder.add_mjcf(sys.argv[1])
mass = builder.body_mass[0]
print(f"the mass is {mass:.4g} kg, in the file 2.3 kg:", "wrong" if abs(mass - 2.3) > 1e-4 else "right")
