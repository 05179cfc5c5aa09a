"""MJCF: `settotalmass` is ignored."""

import sys

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant


def load(path):
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(path)
    plant.Finalize()
    return plant.GetBodyByName("base").default_spatial_inertia()


mass = load(sys.argv[1]).get_mass()
print(f"the mass is {mass:.4g} kg, in the file 2.3 kg:", "wrong" if abs(mass - 2.3) > 1e-6 else "right")
