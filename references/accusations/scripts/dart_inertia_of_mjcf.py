"""MJCF: with a shape, the inertia is the unit matrix instead of that of the file."""

import sys

import dartpy
import numpy as np

body = dartpy.utils.MjcfParser.readWorld(sys.argv[1]).getSkeleton(0).getBodyNode(0)
moments = np.diag(body.getInertia().getMoment())
print(f"{body.getMass():.3g} kg and moments {moments.round(3)}, in the file 2.3 kg and [0.021 0.034 0.041]:", end=" ")
print("wrong" if abs(moments - [0.021, 0.034, 0.041]).max() > 1e-6 else "right")
