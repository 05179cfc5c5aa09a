"""URDF: a link without an inertia gets 1 kg and the unit matrix."""

import sys

import dartpy
import numpy as np

body = dartpy.utils.DartLoader().parseSkeleton(sys.argv[1]).getBodyNode("base")
moments = np.diag(body.getInertia().getMoment())
print(
    f"the link has {body.getMass():g} kg and moments {moments}, in the file nothing:",
    "wrong" if body.getMass() > 1e-6 else "right",
)
