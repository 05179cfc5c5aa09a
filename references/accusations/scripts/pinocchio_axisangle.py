"""MJCF: the axis of `axisangle` is not normalized, so that an axis of another length than 1 changes the moments."""

import sys
from pathlib import Path

import numpy as np
import pinocchio as pin

text, traces = Path(sys.argv[1]).read_text(), []
for axis in ((1, 2, -1), np.array((1, 2, -1)) / 6**0.5):
    Path("axis.xml").write_text(text.replace("1 2 -1", " ".join(map(str, axis))))
    traces.append(np.trace(pin.buildModelFromMJCF("axis.xml").inertias[1].inertia))
print(f"the sum of the moments is {traces[0]:.4f}, with a unit axis {traces[1]:.4f}, in the file 0.0960:", end=" ")
print("wrong" if abs(traces[0] - 0.096) > 1e-6 else "right")
