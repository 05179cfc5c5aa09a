"""`mj_saveLastXML` and `MjSpec.to_xml` write six significant digits."""

import sys
import tempfile

import mujoco
import numpy as np

model = mujoco.MjModel.from_xml_path(sys.argv[1])
with tempfile.TemporaryDirectory() as folder:
    mujoco.mj_saveLastXML(f"{folder}/saved.xml", model)
    saved = mujoco.MjModel.from_xml_path(f"{folder}/saved.xml")
spec = mujoco.MjModel.from_xml_string(mujoco.MjSpec.from_file(sys.argv[1]).to_xml())
errors = [np.abs(other.body_inertia[-1] / model.body_inertia[-1] - 1).max() for other in (saved, spec)]
print(f"largest relative difference of the moments {errors[0]:.1e}, by MjSpec {errors[1]:.1e}:", end=" ")
print("wrong" if max(errors) > 1e-12 else "right")
