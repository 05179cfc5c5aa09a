"""A loader of URDF files with one link, in the framing "lines" of PROTOCOL.md, with its own reader and equations of motion.

`loader.py unturned` ignores the rotation of the inertial frame. A file `crash.urdf` ends it.
"""

import json
import os
import sys
from xml.etree import ElementTree

import numpy as np


def numbers(element, name):
    text = "0 0 0" if element is None else element.get(name, "0 0 0")
    return np.array([float(word) for word in text.split()])


def read(path):
    """Return mass, centre of mass and inertia about it, in axes of the link."""
    links = ElementTree.parse(path).getroot().findall("link")
    if len(links) != 1:
        raise ValueError(f"{len(links)} links")
    inertial = links[0].find("inertial")
    origin, given = inertial.find("origin"), inertial.find("inertia")
    J = np.array([[float(given.get("i" + min(a, b) + max(a, b))) for b in "xyz"] for a in "xyz"])
    R = np.eye(3)
    if sys.argv[1:] != ["unturned"]:
        (a, b, c), (d, e, f) = np.cos(numbers(origin, "rpy")), np.sin(numbers(origin, "rpy"))
        R = (
            np.array([[c, -f, 0], [f, c, 0], [0, 0, 1]])
            @ [[b, 0, e], [0, 1, 0], [-e, 0, b]]
            @ [[1, 0, 0], [0, a, -d], [0, d, a]]
        )
    return float(inertial.find("mass").get("value")), numbers(origin, "xyz"), R @ J @ R.T


def accelerate(body, velocity, force):
    """Return the acceleration of the origin: the angular one about the centre of mass, and m a = F at the centre of mass."""
    mass, com, J = body
    w, F, T = np.array(velocity[3:]), np.array(force[:3]), np.array(force[3:])
    turn = np.linalg.solve(J, T - np.cross(com, F) - np.cross(w, J @ w))
    return [*(F / mass - np.cross(turn, com) - np.cross(w, np.cross(w, com))), *turn]


def answer(request):
    if request["do"] == "hello":
        engine = {"formats": ["urdf", "sdf"]}
        return {"protocol": 1, "program": "loader", "version": "2", "framing": "lines", "engine": engine}
    if request["do"] != "load" or request["kind"] != "urdf":
        return {"error": "unsupported", "message": "only URDF"}
    if os.path.basename(request["path"]) == "crash.urdf":  # noqa: PTH119
        os.abort()
    body = read(request["path"])
    return {"accelerations": [accelerate(body, *case) for case in zip(request["velocities"], request["forces"], strict=True)]}


for line in sys.stdin:
    try:
        given = answer(json.loads(line))
    except Exception as error:
        given = {"error": type(error).__name__, "message": str(error)}
    print(json.dumps(given), flush=True)
