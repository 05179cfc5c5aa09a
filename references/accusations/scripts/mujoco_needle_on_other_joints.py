"""With `implicitfast` and `discrete`, a needle on three slides and a ball gains energy; on a free joint it does not."""

import sys

import mujoco
import numpy as np

J, w = np.array([1.7231e-4, 6.58e-6, 1.7243e-4]), np.array([21.0, 35.0, -17.0])
text, result = open(sys.argv[1]).read(), {}
slides = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1")) + '<joint type="ball"/>'
for integrator in ("implicitfast", "discrete", "implicit"):
    for name, joints in (("free joint", "<freejoint/>"), ("slides and ball", slides)):
        changed = text.replace("<freejoint/>", joints).replace('"implicitfast"', f'"{integrator}"')
        model = mujoco.MjModel.from_xml_string(changed)
        data = mujoco.MjData(model)
        data.qvel[-3:] = w
        mujoco.mj_step(model, data, 1000)
        result[integrator, name] = J @ data.qvel[-3:] ** 2 / (J @ w**2)
names = {f"{integrator}, {name}": f"{energy:.3f}" for (integrator, name), energy in result.items()}
texts = [f"{name} {energy}" for name, energy in names.items()]
print("energy after 1 s over energy at the start:", "; ".join(texts) + ":", end=" ")
print(
    "wrong"
    if any(abs(result[i, "slides and ball"] - result[i, "free joint"]) > 0.01 for i in ("implicitfast", "discrete"))
    else "right"
)
