"""URDF: a moment larger than the sum of the others is accepted."""

import sys

import dartpy
import numpy as np

skeleton = dartpy.utils.DartLoader().parseSkeleton(sys.argv[1])
if skeleton is None:
    print("it refuses the file: right")
else:
    moments = np.linalg.eigvalsh(skeleton.getBodyNode(0).getInertia().getMoment())
    print(f"the moments are {moments.round(4)}:", "wrong" if moments[2] > moments[0] + moments[1] + 1e-9 else "right")
