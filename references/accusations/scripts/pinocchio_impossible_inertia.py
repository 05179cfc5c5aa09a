"""URDF: a moment larger than the sum of the others is accepted."""

import sys

import numpy as np
import pinocchio as pin

try:
    model = pin.buildModelFromUrdf(sys.argv[1], pin.JointModelFreeFlyer())
    moments = np.linalg.eigvalsh(model.inertias[1].inertia)
    print(f"the moments are {moments.round(4)}:", "wrong" if moments[2] > moments[0] + moments[1] else "right")
except ValueError:
    print("it refuses the file: right")
