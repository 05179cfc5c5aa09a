"""URDF: `quat_xyzw`, an attribute of version 1.1, is ignored in the inertial frame."""

import sys

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant


def load(path):
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(path)
    plant.Finalize()
    return plant.GetBodyByName("base").default_spatial_inertia()


inertia = load(sys.argv[1])
moments = np.diag(inertia.Shift(inertia.get_com()).CalcRotationalInertia().CopyToFullMatrix3())
in_file = np.array([0.0351, 0.0323, 0.0286])
print(f"Ixx, Iyy, Izz about the centre of mass are {moments.round(4)}, in the file {in_file}:", end=" ")
print("wrong" if abs(moments - in_file).max() > 1e-3 else "right")
