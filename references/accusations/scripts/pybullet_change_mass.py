"""`changeDynamics(mass=...)` replaces the inertia of a file, also if the mass is the one that it has."""

import sys

import pybullet as p

p.connect(p.DIRECT)
body = p.loadURDF(sys.argv[1], flags=p.URDF_USE_INERTIA_FROM_FILE)
mass, before = p.getDynamicsInfo(body, -1)[0], p.getDynamicsInfo(body, -1)[2]
p.changeDynamics(body, -1, mass=mass)
after = p.getDynamicsInfo(body, -1)[2]
p.changeDynamics(body, -1, mass=mass, localInertiaDiagonal=before)
both = p.getDynamicsInfo(body, -1)[2]
texts = [", ".join(f"{moment:.3g}" for moment in moments) for moments in (before, after, both)]
print(f"moments {texts[0]} kg m^2, after setting the same mass {texts[1]}, with the moments {texts[2]}:", end=" ")
print("wrong" if max(abs(a / b - 1) for a, b in zip(after, before)) > 1e-6 else "right")
