"""SDF: the rotation of the inertial frame is ignored."""

import sys

import dartpy
import numpy as np

body = dartpy.utils.SdfParser.readSkeleton(sys.argv[1]).getBodyNode(0)
inertia = body.getInertia().getMoment()
print(f"the inertia in the link is diagonal with {np.diag(inertia)}, in the file it is turned by 0.4 -0.7 1.1 rad:", end=" ")
print("wrong" if abs(inertia - np.diag(np.diag(inertia))).max() < 1e-6 else "right")
