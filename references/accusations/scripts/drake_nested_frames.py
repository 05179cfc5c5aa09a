"""MJCF: shapes in a `<frame>` are ignored."""

import sys
from math import pi

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

plant, in_file = MultibodyPlant(0.0), 8 * 0.1 * 0.15 * 0.05 * 800 + pi * 0.05**2 * 0.4 * 1200
Parser(plant).AddModels(sys.argv[1])
mass = plant.GetBodyByName("base").default_mass()
print(f"the mass is {mass:.4g} kg, in the file {in_file:.4g} kg:", "wrong" if abs(mass - in_file) > 1e-3 else "right")
