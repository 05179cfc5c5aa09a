"""USD: `metersPerUnit` and `kilogramsPerUnit` are ignored."""

import sys

import newton

builder = newton.ModelBuilder()
builder.add_usd(sys.argv[1])
mass, com = builder.body_mass[0], [round(float(x), 4) for x in builder.body_com[0]]
print(f"mass {mass:g} kg, centre of mass {com} m, in the file 2.3 kg and [0.12, -0.07, 0.2] m:", end=" ")
print("wrong" if abs(mass - 2.3) > 1e-4 or abs(com[0] - 0.12) > 1e-4 else "right")
