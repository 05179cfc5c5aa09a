"""MJCF: the inertia of the file is ignored; without shapes it is 0, which means that nothing turns the body."""

import sys

import pybullet

pybullet.connect(pybullet.DIRECT)
moments = pybullet.getDynamicsInfo(pybullet.loadMJCF(sys.argv[1])[0], -1)[2]
print(
    f"\nthe moments are {[float(f'{moment:.3g}') for moment in moments]}, in the file 0.021, 0.034 and 0.041 kg m^2:", end=" "
)
print("wrong" if min(moments) < 0.02 else "right")
