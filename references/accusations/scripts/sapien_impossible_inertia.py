"""URDF: a moment larger than the sum of the others is accepted."""

import sys

import numpy as np
import sapien

loader = sapien.Scene([sapien.physx.PhysxCpuSystem()]).create_urdf_loader()
loader.fix_root_link = False
body = loader.load_multiple(sys.argv[1])[1][0].find_component_by_type(sapien.physx.PhysxRigidDynamicComponent)
moments = np.sort(body.inertia)
print(f"the moments are {moments.round(4)}:", "wrong" if moments[2] > moments[0] + moments[1] + 1e-6 else "right")
