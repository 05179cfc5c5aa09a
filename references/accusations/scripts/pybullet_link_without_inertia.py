"""URDF: a link without an inertia gets 1 kg and moments of 1 kg m^2, with a warning."""

import sys

import pybullet

pybullet.connect(pybullet.DIRECT)
mass, _, moments = pybullet.getDynamicsInfo(pybullet.loadURDF(sys.argv[1], flags=pybullet.URDF_USE_INERTIA_FROM_FILE), -1)[:3]
print(f"\nthe link has {mass:g} kg and moments {moments}, in the file nothing:", "wrong" if mass else "right")
