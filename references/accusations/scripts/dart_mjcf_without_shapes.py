"""MJCF: without a shape, the body has 1 kg, the unit matrix as inertia, and its centre of mass at the origin."""

import sys

import dartpy

body = dartpy.utils.MjcfParser.readWorld(sys.argv[1]).getSkeleton(0).getBodyNode(0)
print(f"{body.getMass():.3g} kg and centre of mass {body.getLocalCOM()}, in the file 2.3 kg and [0.12 -0.07 0.2]:", end=" ")
print("wrong" if abs(body.getMass() - 2.3) > 1e-6 or abs(body.getLocalCOM() - [0.12, -0.07, 0.2]).max() > 1e-6 else "right")
