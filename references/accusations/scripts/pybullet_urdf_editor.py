"""`UrdfEditor` writes five decimals, so that small moments become 0."""

import sys
import tempfile

import pybullet as p
from pybullet_utils.urdfEditor import UrdfEditor

p.connect(p.DIRECT)


def load(path):
    body = p.loadURDF(path, flags=p.URDF_USE_INERTIA_FROM_FILE)
    return body, p.getDynamicsInfo(body, -1)[2]


body, before = load(sys.argv[1])
with tempfile.TemporaryDirectory() as folder:
    editor = UrdfEditor()
    editor.initializeFromBulletBody(body, 0)
    editor.saveUrdf(f"{folder}/saved.urdf")
    after = load(f"{folder}/saved.urdf")[1]
texts = [", ".join(f"{moment:.3g}" for moment in moments) for moments in (before, after)]
error = max(abs(a - b) for a, b in zip(before, after))
print(f"moments {texts[0]} kg m^2, saved and loaded {texts[1]}:", "wrong" if error > 1e-9 * max(before) else "right")
