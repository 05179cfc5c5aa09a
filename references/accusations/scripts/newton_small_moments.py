"""URDF: moments of 1e-12 kg m^2 become 1e-6 kg m^2, with a warning."""

import sys

import newton
import numpy as np

builder = newton.ModelBuilder()
builder.add_urdf(sys.argv[1], floating=True)
moments = np.linalg.eigvalsh(np.reshape(builder.finalize(device="cpu").body_inertia.numpy()[0], (3, 3)))
texts = ", ".join(f"{moment:.2g}" for moment in moments)
print(f"the moments are {texts}, in the file 1e-12, 2e-12 and 2.5e-12 kg m^2:", "wrong" if moments[0] > 2e-12 else "right")
