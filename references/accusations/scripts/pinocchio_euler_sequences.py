"""MJCF: rotations about fixed axes (capital letters of `eulerseq`) are made about moving axes."""

import itertools
import sys
from pathlib import Path

import numpy as np
import pinocchio as pin

text = Path(sys.argv[1]).read_text()
angles, moments = np.radians([20, -50, 70]), np.diag([0.021, 0.034, 0.041])
wrong, tried = [0, 0], [0, 0]
for letters in map("".join, itertools.product("xyzXYZ", repeat=3)):
    low = letters.lower()
    if low[0] == low[1] or low[1] == low[2]:
        continue
    R = np.eye(3)
    for letter, angle in zip(letters, angles):
        turn = pin.exp3(angle * np.eye(3)["xyz".index(letter.lower())])
        R = R @ turn if letter.islower() else turn @ R
    Path("sequence.xml").write_text(text.replace('"ZYX"', f'"{letters}"'))
    difference = abs(pin.buildModelFromMJCF("sequence.xml").inertias[1].inertia - R @ moments @ R.T).max()
    fixed = letters != low
    wrong[fixed], tried[fixed] = wrong[fixed] + (difference > 1e-6), tried[fixed] + 1
print(f"{wrong[1]} of {tried[1]} sequences with capital letters differ, {wrong[0]} of {tried[0]} without:", end=" ")
print("wrong" if wrong[1] else "right")
