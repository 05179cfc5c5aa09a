"""SDF: the inertia of the file is ignored; it is computed from the shapes, and without shapes it is tiny."""

import sys

import pybullet

pybullet.connect(pybullet.DIRECT)
moments = pybullet.getDynamicsInfo(pybullet.loadSDF(sys.argv[1])[0], -1)[2]
print(f"\nthe moments are {[float(f'{moment:.3g}') for moment in moments]}, in the file about 0.02 to 0.04 kg m^2:", end=" ")
print("wrong" if min(moments) < 0.015 else "right")
