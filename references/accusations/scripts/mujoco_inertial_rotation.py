"""URDF: the rotation of the inertial frame of a floating body is ignored (issue 3559)."""

import sys

import mujoco
import numpy as np

spec = mujoco.MjSpec.from_file(sys.argv[1])
spec.worldbody.first_body().add_freejoint()
model, R = spec.compile(), np.zeros(9)
mujoco.mju_quat2Mat(R, model.body_iquat[-1])
loaded = R.reshape(3, 3) @ np.diag(model.body_inertia[-1]) @ R.reshape(3, 3).T


def turn(angle, i, j):
    matrix = np.eye(3)
    matrix[[i, i, j, j], [i, j, i, j]] = np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)
    return matrix


R = turn(1.1, 0, 1) @ turn(-0.7, 2, 0) @ turn(0.4, 1, 2)
in_file = R @ np.diag([0.021, 0.034, 0.041]) @ R.T
print(f"Ixx, Iyy, Izz are {np.diag(loaded).round(4)}, in the file {np.diag(in_file).round(4)}:", end=" ")
print("wrong" if abs(loaded - in_file).max() > 1e-6 else "right")
