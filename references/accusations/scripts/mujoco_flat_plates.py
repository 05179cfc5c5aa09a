"""URDF: some flat plates, whose largest moment is the sum of the others, are refused because of round-off."""

import random
import sys

import mujoco
import numpy as np

entries, numbers = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}, random.Random(0)
text = open(sys.argv[1]).read().replace("0.4 -0.7 1.1", "0 0 0")
text = text.replace("<link", '<mujoco><compiler fusestatic="false"/></mujoco><link', 1)
old = 'ixx="0.0125" iyy="0.025" izz="0.0375" ixy="0.0" ixz="0.0" iyz="0.0"'


def refused(moments, R):
    inertia = {name: sum(R[i][k] * moments[k] * R[j][k] for k in range(3)) for name, (i, j) in entries.items()}
    new = " ".join(f'i{name}="{float(value)!r}"' for name, value in inertia.items())
    try:
        mujoco.MjModel.from_xml_string(text.replace(old, new))
    except ValueError:
        return True
    return False


counts, R = [0, 0], np.zeros(9)
for _ in range(300):
    a, b = (round(numbers.uniform(0.001, 1), 4) for _ in range(2))
    q = np.array([numbers.gauss(0, 1) for _ in range(4)])
    mujoco.mju_quat2Mat(R, q / sum(q * q) ** 0.5)
    counts[0] += refused([a, b, round(a + b, 4)], np.eye(3))
    counts[1] += refused([a, b, a + b], R.reshape(3, 3))
print(f"refused: {counts[0]} of 300 with moments of four digits, {counts[1]} of 300 with products:", end=" ")
print("wrong" if any(counts) else "right")
