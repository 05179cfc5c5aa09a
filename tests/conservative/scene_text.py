"""The text of a scene file that is good, and ways to change it."""

import numpy as np

from conservative.attitude import rotation_about

AXIS, ANGLE = np.array([0.3, -1.2, 0.7]), 0.83
R = rotation_about(AXIS, ANGLE)
TENSOR = [[3.1, 0.2, -0.1], [0.2, 2.7, 0.3], [-0.1, 0.3, 1.9]]

GOOD = f"""# a comment
t_end = 3
dt = 0.01

[body]
inertia = [
    {TENSOR[0]},   # a comment inside
    {TENSOR[1]},
    {TENSOR[2]},
]

[potential]
kind = "uniform_gravity"
weight = 12.5
com_B = [0.1, -0.2, 0.3]

[start]
w_WB_B = [0.5, -1.5, 2.5]
R_WB.axis = {AXIS.tolist()}
R_WB.angle = {ANGLE}
"""


def replaced(old, new):
    assert GOOD.count(old) == 1, old
    return GOOD.replace(old, new)


def body_of(text):
    head, rest = GOOD.split("[body]")
    return head + "[body]\n" + text + "\n\n[start]" + rest.split("[start]")[1]
