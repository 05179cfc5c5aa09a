"""MJCF: `balanceinertia` is ignored."""

import sys

import numpy as np
import pinocchio as pin

moments = np.diag(pin.buildModelFromMJCF(sys.argv[1]).inertias[1].inertia)
print(f"the moments are {moments.round(4)}, all are 0.0233 as the file asks:", "wrong" if np.ptp(moments) > 1e-6 else "right")
