"""URDF: `quat_xyzw`, an attribute of version 1.1, is ignored in the inertial frame."""

import sys

import numpy as np
import sapien

loader = sapien.Scene([sapien.physx.PhysxCpuSystem()]).create_urdf_loader()
loader.fix_root_link = False
body = loader.load_multiple(sys.argv[1])[1][0].find_component_by_type(sapien.physx.PhysxRigidDynamicComponent)
R = body.cmass_local_pose.to_transformation_matrix()[:3, :3]
moments, in_file = np.diag(R @ np.diag(body.inertia) @ R.T), np.array([0.0351, 0.0323, 0.0286])
print(
    f"Ixx, Iyy, Izz are {moments.round(4)}, in the file {in_file}:", "wrong" if abs(moments - in_file).max() > 1e-3 else "right"
)
