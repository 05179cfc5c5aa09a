"""The body of an MJCF file as this package reads it, a second opinion beside MuJoCo's compiler.

Rules: https://mujoco.readthedocs.io/en/stable/XMLreference.html. What has no rule here raises `NotRead` instead of a guess.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from conservative.attitude import Array

from .files import find, load_mesh, parse
from .pieces import DENSITY, Piece, join, make_pose, weigh

IRRELEVANT = ("joint", "freejoint", "site", "camera", "light", "inertial")
_TURNS = ("quat", "axisangle", "euler", "xyaxes", "zaxis")
_UNREAD = {  # attributes of <compiler> and of a shape by the values for which there is a rule
    "compiler": {
        "balanceinertia": "false",
        "settotalmass": "-1",
        "boundmass": "0",
        "boundinertia": "0",
        "inertiagrouprange": "0 5",
    }
    | {"alignfree": "false", "coordinate": "local"},
    "geom": {"shellinertia": "false", "fitscale": "1"},
    "mesh": {"inertia": "legacy", "refpos": "0 0 0", "refquat": "1 0 0 0", "builtin": "none"},
    "joint": {"align": "false"},
    "freejoint": {"align": "false"},
}
_HALF = {"capsule": (1, 2), "cylinder": (1, 2), "box": (2, 2, 2), "ellipsoid": (1, 1, 1), "sphere": (1,)}
"""Shapes, and the factors from sizes in MJCF, which are half lengths, to those of `weigh`."""


class NotRead(Exception):
    """The file has something for which there is no rule here. The message names it."""


def inline(path: Path, search: Sequence[Path] = ()) -> Any:
    """Return the root element of an MJCF file with the content of the files that it includes."""
    root = parse(path, "mujoco", "mujocoinclude")
    while (each := next(root.iter("include"), None)) is not None:
        other, parent = parse(find(path, each.get("file"), search), "mujoco", "mujocoinclude"), each.getparent()
        for child in reversed(other):
            each.addnext(child)
        parent.remove(each)
    return root


class Model:
    """An MJCF model: its compiler options, defaults and meshes."""

    def __init__(self, path: Path, search: Sequence[Path] = (), other_angles: bool = False) -> None:
        self.path, self.search, self.root = path, search, inline(path, search)
        self.options = {key: value for each in self.root.findall("compiler") for key, value in each.attrib.items()}
        self.unit = 1.0 if (self.options.get("angle", "degree") == "radian") != other_angles else math.pi / 180
        _require_rules("compiler", self.options)
        self.classes: dict[str, dict[tuple[str, str], str]] = {"main": {}}
        for each in self.root.findall("default"):
            self._collect(each, "main")
        self.meshes = {each.get("name") or Path(each.get("file", "")).stem: each for each in self.root.iterfind("asset/mesh")}

    def _collect(self, element: Any, name: str) -> None:
        own = self.classes.setdefault(name, {})
        for child in element:
            own |= {(child.tag, key): value for key, value in child.attrib.items()}
        for child in element.findall("default"):
            self.classes[child.get("class")] = dict(own)
            self._collect(child, child.get("class"))

    def values(self, element: Any, inherited: str) -> dict[str, str]:
        """Return the attributes of an element with those of its class, `inherited` unless it has one."""
        of_class = self.classes.get(element.get("class", inherited), {})
        found = {key: value for (tag, key), value in of_class.items() if tag == element.tag}
        if "size" in found and "size" in element.attrib:  # fewer numbers than in the class replace the first ones
            given = element.get("size").split()
            found |= dict(element.attrib) | {"size": " ".join([*given, *found["size"].split()[len(given) :]])}
        found |= {key: value for key, value in element.attrib.items() if key != "size" or key not in found}
        _require_rules(element.tag, found)
        return found

    def pose(self, values: dict[str, str]) -> Array:
        """Return the pose (4, 4) in attributes."""
        turn, R = {key: _numbers(values[key]) for key in _TURNS if key in values}, Rotation.identity()
        if "quat" in turn:
            R = Rotation.from_quat(turn["quat"], scalar_first=True)
        if "axisangle" in turn:
            axis = np.array(turn["axisangle"][:3])
            R = Rotation.from_rotvec(self.unit * turn["axisangle"][3] * axis / np.linalg.norm(axis))
        if "euler" in turn:  # small letters turn about axes that move along, which scipy writes in capitals
            R = Rotation.from_euler(self.options.get("eulerseq", "xyz").swapcase(), self.unit * np.array(turn["euler"]))
        if "xyaxes" in turn:
            x = np.array(turn["xyaxes"][:3]) / np.linalg.norm(turn["xyaxes"][:3])
            y = np.array(turn["xyaxes"][3:]) - x * (x @ turn["xyaxes"][3:])
            y /= np.linalg.norm(y)
            R = Rotation.from_matrix(np.transpose([x, y, np.cross(x, y)]))
        if "zaxis" in turn:
            R = _from_z(np.array(turn["zaxis"]))
        return make_pose(_numbers(values.get("pos", "0 0 0")), R)

    def body(self, element: Any, inherited: str, pose: Array) -> list[Piece]:
        """Return the parts of a body and of those below it, in the axes in which it has a pose (4, 4)."""
        inherited = element.get("childclass", inherited)
        inertial, rule = element.find("inertial"), self.options.get("inertiafromgeom", "auto")
        parts = []
        if inertial is not None and rule != "true":
            v = self.values(inertial, inherited)
            a = _numbers(v.get("fullinertia", v.get("diaginertia", "") + " 0 0 0"))
            inertia = np.array([[a[0], a[3], a[4]], [a[3], a[1], a[5]], [a[4], a[5], a[2]]])
            parts.append(Piece(float(v["mass"]), np.zeros(3), inertia).place(self.pose(v)).place(pose))
        self._below(element, inherited, pose, parts, rule == "true" or (inertial is None and rule == "auto"))
        return parts

    def _below(self, element: Any, inherited: str, pose: Array, parts: list[Piece], shapes: bool) -> None:
        for child in element:
            if child.tag == "geom":
                parts += self.geom(self.values(child, inherited), pose) if shapes else []
            elif child.tag == "frame":
                inner = pose @ self.pose(dict(child.attrib))
                self._below(child, child.get("childclass", inherited), inner, parts, shapes)
            elif child.tag == "body":
                parts += self.body(child, inherited, pose @ self.pose(dict(child.attrib)))
            elif child.tag not in IRRELEVANT:
                raise NotRead(f"<{child.tag}>")
            else:
                self.values(child, inherited)

    def geom(self, v: dict[str, str], pose: Array) -> list[Piece]:
        """Return the part of a geometry with given attributes."""
        kind, place, sizes = v.get("type", "sphere"), self.pose(v), _numbers(v.get("size", ""))
        if kind in ("plane", "hfield") or float(v.get("mass", "1")) == 0:
            return []
        if kind == "mesh":
            asset = self.meshes[v["mesh"]]
            mesh = self.values(asset, "main")
            name = "/".join(filter(None, [self.options.get("meshdir", self.options.get("assetdir", "")), mesh.get("file", "")]))
            vertices, faces = load_mesh(self.path, name, self.search)
            shape: Any = [vertices * _numbers(mesh.get("scale", "1 1 1")), faces]
            if weigh("mesh", shape, np.eye(4), 1.0)[0].mass < ConvexHull(shape[0]).volume * (1 - 1e-6):
                raise NotRead(f"the mesh {name!r}: it is not convex, and what its volume is depends on the version of MuJoCo")
        elif kind in _HALF:
            if "fromto" in v:
                ends = np.reshape(_numbers(v["fromto"]), (2, 3))
                place = make_pose(ends.mean(axis=0), _from_z(ends[0] - ends[1]))
                sizes = [sizes[0]] * (1 if kind in ("capsule", "cylinder") else 2) + [
                    float(np.linalg.norm(ends[1] - ends[0])) / 2
                ]
            shape = np.multiply(sizes[: len(_HALF[kind])], _HALF[kind])
            shape = shape[0] if kind == "sphere" else shape
        else:
            raise NotRead(f"a geometry of type {kind!r}")
        (part,) = weigh(kind, shape, pose @ place, float(v.get("density", DENSITY)))
        return [part.scale(float(v["mass"]) / part.mass) if "mass" in v else part]


def second_opinion(path: Path, search: Sequence[Path] = (), other_angles: bool = False) -> Piece:
    """Return the body of an MJCF file with one body in the world, in its axes. Raise `NotRead` and `BadInput`."""
    model = Model(path, search, other_angles)
    found: list[tuple[Any, str]] = []
    for world in model.root.findall("worldbody"):
        found += [(each, world.get("childclass", "main")) for each in world.findall("body")]
        if world.find("frame") is not None:
            raise NotRead("<frame> in the world")
    if len(found) != 1:
        raise NotRead(f"{len(found)} bodies in the world")
    return join(model.body(*found[0], np.eye(4)))


def _require_rules(tag: str, values: dict[str, str]) -> None:
    for key, value in _UNREAD.get(tag, {}).items():
        if key in values and values[key] != value:
            raise NotRead(f"{key}={values[key]!r} of <{tag}>")


def _numbers(text: str) -> list[float]:
    return [float(word) for word in text.split()]


def _from_z(z: Array) -> Rotation:
    """Return the smallest rotation that turns the third axis to z (3,)."""
    z = z / np.linalg.norm(z)
    axis = np.array([-z[1], z[0], 0.0])
    length = np.linalg.norm(axis)
    return Rotation.from_rotvec(axis / length * math.atan2(length, z[2]) if length else (math.pi * (z[2] < 0), 0, 0))
