"""URDF: `quat_xyzw`, an attribute of version 1.1, is ignored in the inertial frame."""

import sys

import pybullet

pybullet.connect(pybullet.DIRECT)
flags = pybullet.URDF_USE_INERTIA_FROM_FILE
turned, straight = open(sys.argv[1]).read(), "straight.urdf"
with open(straight, "w") as file:
    file.write(turned.replace(' quat_xyzw="0.2 -0.4 0.1 0.8888194417315589"', ""))
loaded, without = (pybullet.getDynamicsInfo(pybullet.loadURDF(path, flags=flags), -1)[4] for path in (sys.argv[1], straight))
print(f"\naxes of inertia: {[round(x, 3) for x in loaded]}, without the attribute {[round(x, 3) for x in without]}:", end=" ")
print("wrong" if max(abs(a - b) for a, b in zip(loaded, without)) < 1e-6 else "right")
