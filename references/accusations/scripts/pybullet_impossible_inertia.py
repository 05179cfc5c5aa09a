"""URDF: an impossible inertia becomes 0, with a warning; then nothing turns the body."""

import sys

import pybullet

pybullet.connect(pybullet.DIRECT)
try:
    moments = pybullet.getDynamicsInfo(pybullet.loadURDF(sys.argv[1], flags=pybullet.URDF_USE_INERTIA_FROM_FILE), -1)[2]
    print(f"\nthe moments are {moments}, in the file 0.01, 0.02 and 0.04 kg m^2:", "right" if any(moments) else "wrong")
except pybullet.error:
    print("it refuses the file: right")
