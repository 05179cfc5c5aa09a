"""URDF: the inertia I in an inertial frame that is turned by R becomes R I instead of R I R' (issue 2245)."""

import sys

import newton
import numpy as np


def turn(angle, i, j):
    matrix = np.eye(3)
    matrix[[i, i, j, j], [i, j, i, j]] = np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)
    return matrix


builder = newton.ModelBuilder()
builder.add_urdf(sys.argv[1], floating=True)
loaded = np.array(builder.body_inertia[0]).reshape(3, 3)
R = turn(1.1, 0, 1) @ turn(-0.7, 2, 0) @ turn(0.4, 1, 2)
in_file = R @ np.diag([0.021, 0.034, 0.041]) @ R.T
print(f"Ixx, Iyy, Izz are {np.diag(loaded).round(4)}, in the file {np.diag(in_file).round(4)}:", end=" ")
print("wrong" if abs(loaded - in_file).max() > 1e-5 else "right")
