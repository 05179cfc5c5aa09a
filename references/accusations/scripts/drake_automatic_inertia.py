"""SDF: a mesh with automatic inertia is refused with a `MemoryError`."""

import sys

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

plant = MultibodyPlant(0.0)
try:
    Parser(plant).AddModels(sys.argv[1])
    plant.Finalize()
    answer = f"a mass of {plant.GetBodyByName('base').default_spatial_inertia().get_mass():.4g} kg"
except (MemoryError, RuntimeError) as error:
    answer = repr(error)
print(f"it answers {answer}, by the file 5.934 kg:", "wrong" if "MemoryError" in answer else "right")
