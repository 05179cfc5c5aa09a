"""The rigid body of a URDF or SDF file with one body: mass, centre of mass and inertia as the formats define them.

This is the second reading, beside `reference.by_urdfdom` and libsdformat in Drake. Every element and attribute is used, known
to be irrelevant to a free body, or named in the notes. trimesh reads meshes.

References
----------
URDF: https://wiki.ros.org/urdf/XML/link
SDF: http://sdformat.org/spec
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array
from conservative.errors import BadInput

from .files import Unread, load_mesh, parse, reason, refuse
from .pieces import DENSITY, ONE, SHAPES, Link, Piece, Reading, join, make_pose, rounding_of, weigh

_POSE = "relative_to degrees rotation_format frame"
_I = "ixx iyy izz ixy ixz iyz"
KNOWN: dict[str, dict[str, tuple[str, str]]] = {
    "urdf": {
        "robot": ("name version link joint", "material transmission sensor"),
        "link": ("name inertial collision", "type visual"),
        "inertial": ("origin mass inertia", ""),
        "origin": ("xyz rpy quat_xyzw", ""),
        "mass": ("value", ""),
        "inertia": (_I, ""),
        "collision": ("name origin geometry", "verbose"),
        "joint": ("name type origin parent child", "axis limit dynamics mimic calibration safety_controller"),
    },
    "sdf": {
        "sdf": ("version model world", ""),
        "world": ("name model", "*"),
        "model": (
            "name link frame joint",
            "canonical_link placement_frame pose static self_collide allow_auto_disable enable_wind gripper",
        ),
        "link": (
            "name pose inertial collision",
            "visual sensor projector audio_sink audio_source battery light particle_emitter gravity enable_wind"
            " self_collide velocity_decay must_be_base_link",
        ),
        "inertial": ("auto pose mass inertia density", ""),
        "pose": (_POSE, ""),
        "inertia": (_I, ""),
        "collision": ("name pose geometry density", "surface laser_retro max_contacts"),
        "frame": ("name attached_to pose", ""),
        "joint": ("name type pose parent child", "axis axis2 physics sensor screw_thread_pitch thread_pitch gearbox_ratio"),
    },
}
"""Names of attributes and children by format and element: those that are read, and those that do not matter to a free body."""
MASS = ("inertial", "origin", "pose", "mass", "inertia")
EXTENSIONS = {"mujoco": "mujoco", "drake": "drake"}
"""Names and prefixes of elements that ask one engine for something."""
SINCE = {
    ("pose", "relative_to"): "1.7",
    ("frame", "attached_to"): "1.7",
    ("pose", "degrees"): "1.9",
    ("pose", "rotation_format"): "1.9",
    ("inertial", "auto"): "1.11",
    ("inertial", "density"): "1.11",
    ("collision", "density"): "1.11",
}
"""Versions of SDF from which on an element has such an attribute or child."""


def is_true(text: str | None) -> bool:
    """Return whether a truth value of XML is true."""
    return (text or "").strip().lower() in ("true", "1")


def version_of(text: str) -> tuple[int, ...]:
    """Return a version such as "1.11" as numbers. Raise `Unread`."""
    if not re.fullmatch(r"\d+(\.\d+)*", text):
        raise Unread(f"the version {text!r}")
    return tuple(map(int, text.split(".")))


class Joint(NamedTuple):
    """A joint of URDF or SDF: its name and kind, the links that it joins, and its pose (4, 4) in the parent of URDF."""

    name: str
    kind: str
    parent: str
    child: str
    pose: Array


class Description:
    """A model of URDF or SDF: its joints, and poses of links, joints and frames. `reading` collects notes and doubts."""

    def __init__(self, path: Path, model: Any, search: Sequence[Path] = (), reading: Reading | None = None) -> None:
        self.path, self.model, self.search, self.reading = path, model, search, reading or Reading()
        self.urdf = model.tag == "robot"
        self.version = model.getroottree().getroot().get("version", "1.0")
        self.own, attribute = ("origin", "link") if self.urdf else ("pose", "name")
        tags = ("link",) if self.urdf else ("joint", "frame", "link")  # a joint of URDF may have the name of its link
        self.elements = {element.get("name", ""): element for tag in tags for element in model.findall(tag)}
        self.joints = []
        for joint in model.findall("joint"):
            ends = [joint.find(name) for name in ("parent", "child")]
            parent, child = ("" if end is None else (end.get(attribute) or end.text or "").strip() for end in ends)
            pose = self.pose(joint.find(self.own)) if self.urdf else np.eye(4)
            self.joints.append(Joint(joint.get("name", ""), joint.get("type", ""), parent, child, pose))
        self._bases = {joint.child: joint for joint in self.joints if joint.kind == "fixed"}

    def place(self, name: str) -> Array:
        """Return the pose (4, 4) of a link, frame or joint in the model, in URDF in the link that it is fixed to."""
        if name in ("", "__model__"):
            return np.eye(4)
        if self.urdf:
            return self.place(self._bases[name].parent) @ self._bases[name].pose if name in self._bases else np.eye(4)
        element = self.elements[name]
        pose = element.find(self.own)
        base = ("" if pose is None else pose.get("relative_to", "")) or element.get("attached_to", "")
        return self.place(base or element.findtext("child", "")) @ self.pose(pose)

    def inside(self, link: str, element: Any) -> Array:
        """Return the pose (4, 4) of an element of a link in the link."""
        pose = element.find(self.own)
        base = "" if pose is None else pose.get("relative_to", "")
        return (np.linalg.inv(self.place(link)) @ self.place(base) if base else np.eye(4)) @ self.pose(pose)

    def pose(self, element: Any, of: str = "") -> Array:
        """Return the pose (4, 4) in an <origin> of URDF or a <pose> of SDF, of a link `of`; without one the identity."""
        if element is None:
            return np.eye(4)
        owner, form = element.getparent(), element.get("rotation_format")
        name = owner.get("name") or owner.getparent().get("name")
        if element.tag == "pose":
            values = numbers(
                (element.text or "").strip() or ("0 0 0 0 0 0" + " 1" * (form == "quat_xyzw")), 6 + (form == "quat_xyzw")
            )
            if element.get("frame"):
                doubt = f"<pose> of {name!r} has frame={element.get('frame')!r}, an attribute of SDF 1.5 that is not read here"
                self.reading.doubts.append(doubt)
        else:
            values = numbers(element.get("xyz", "0 0 0"), 3) + numbers(element.get("rpy", "0 0 0"), 3)
        if of and (base := element.get("relative_to", of)):
            doubt = f"the pose in <{owner.tag}> of {of!r} is relative to {base!r}, which the format does not allow"
            (self.reading.doubts if base == of else self.reading.invalid).extend([doubt] * ("relative_to" in element.attrib))
        if "quat_xyzw" in element.attrib:
            if version_of(self.version) >= (1, 1):
                values[3:], form = numbers(element.get("quat_xyzw"), 4), "quat_xyzw"
            else:
                self.reading.notes.append(
                    f"quat_xyzw of {name!r} is ignored in URDF {self.version}, which has no such attribute"
                )
        if form == "quat_xyzw":
            if not any(values[3:]):
                raise Unread(f"the quaternion 0 0 0 0 of {name!r}")
            return make_pose(values[:3], Rotation.from_quat(values[3:]))
        unit = math.pi / 180 if is_true(element.get("degrees")) else 1.0
        return make_pose(values[:3], Rotation.from_euler("xyz", unit * np.array(values[3:])))

    def weigh(self, element: Any, place: Array, density: float = DENSITY) -> list[Piece]:
        """Return the part in a <geometry> of URDF or SDF at a place (4, 4), m, with a density, kg/m^3; none for a plane.

        Raise `BadInput` for a mesh that cannot be read, and for a shape that `weigh` does not know.
        """
        form = element[0]
        values = _values(form)
        if form.tag == "mesh":
            name = values.get("filename", values.get("uri", ""))
            vertices, faces = load_mesh(self.path, name, self.search)
            return weigh("mesh", [vertices * numbers(values.get("scale", "1 1 1")), faces], place, density)
        names = {"box": ("size",), "ellipsoid": ("radii",), "sphere": ("radius",), "plane": ()}.get(
            form.tag, ("radius", "length")
        )
        if form.tag not in SHAPES or not set(names) <= set(values):
            raise refuse(self.path, f"the shape <{form.tag}>", f"shapes whose volume is known: {', '.join(SHAPES)}")
        return weigh(form.tag, numbers(" ".join(values[name] for name in names)), place, density)

    def link(self, name: str) -> Link:
        """Return a link with its mass and inertia. In URDF all values are required; in SDF the defaults are 1 and 0."""
        element, link = self.elements[name], Link(self.place(name), name=name)
        inertial = element.find("inertial")
        auto = not self.urdf and inertial is not None and is_true(inertial.get("auto"))
        try:
            forms = []
            for collision in element.findall("collision"):
                density = collision.findtext("density") or (inertial is not None and inertial.findtext("density")) or DENSITY
                forms += self.weigh(collision.find("geometry"), self.inside(name, collision), number(str(density)))
            link = replace(link, geometry=join(forms))
        except BadInput as error:
            if auto:
                raise
            self.reading.notes.append(f"the geometry of {name!r} is not used: {reason(error)}")
        if auto:  # a mass in the file is the mass of the whole, from libsdformat 15.2 on
            mass = inertial.findtext("mass")
            return link.filled(link.geometry.scale(number(mass) / link.geometry.mass if mass and link.geometry.mass else 1.0))
        if inertial is None and self.urdf:
            return link
        inertial = element.makeelement("inertial") if inertial is None else inertial
        mass, values = inertial.find("mass"), _values(inertial.find("inertia"))
        weight = None if mass is None else mass.get("value") if self.urdf else mass.text
        missing = [key for key in _I.split() if key not in values] + ["mass"] * (weight is None)
        if self.urdf and missing:
            self.reading.invalid.append(f"<inertial> of {name!r} has no {', '.join(missing)}, which the format requires")
        default = "0" if self.urdf else "1"
        inertia = [[number(values.get(f"i{min(a, b)}{max(a, b)}", default if a == b else "0")) for a in "xyz"] for b in "xyz"]
        frame, rounding = self.pose(inertial.find(self.own), name), rounding_of(np.ravel(inertia).tolist())
        return replace(link, mass=number(weight or default), frame=frame, inertia=np.array(inertia), rounding=rounding)

    def look(self, element: Any) -> None:
        """Note what no rule here covers in an element; with a mass it is a doubt."""
        tag = element.tag
        used, ignored = (names.split() for names in KNOWN["urdf" if self.urdf else "sdf"].get(tag, ("*", "")))
        owners = [*((name, element) for name in element.attrib), *((child.tag, child) for child in element)]
        for name, owner in () if used == ["*"] else owners:
            if not self.urdf and version_of(self.version) < version_of(SINCE.get((tag, name), "0")):
                doubt = f"<{tag}> has {name!r}, which is of SDF {SINCE[tag, name]}, and the file of SDF {self.version}"
                self.reading.doubts.append(doubt)
            if name not in used and name not in ignored:
                if engine := EXTENSIONS.get(name.partition(":")[0]):
                    self._ask(engine, name, owner if owner is not element else None)
                else:
                    note = f"<{tag}> has {name!r}, which is not read here"
                    matters = tag in MASS or name in ("namespace", "kinematic")
                    (self.reading.doubts if matters else self.reading.notes).append(note)
            if name in MASS and len(element.findall(name)) > 1:
                self.reading.invalid.append(f"<{tag}> has several elements <{name}>")
        for child in element:
            if child.tag in used:
                self.look(child)

    def _ask(self, engine: str, name: str, owner: Any) -> None:
        """Add what an element, or an attribute if the owner is None, asks an engine for."""
        inside = (
            [] if owner is None else [(node.tag.rpartition(":")[2], *pair) for node in owner.iter() for pair in node.items()]
        )
        for tag, key, value in inside or [(name.rpartition(":")[2], "", "")]:
            option = key if name == "mujoco" else f"{tag} {key}"
            self.reading.ask(engine, option, value, f"<{name}> {tag} {key}={value!r}" if key else f"<{name}>")


def read_xml(path: Path, search: Sequence[Path], reading: Reading) -> list[Link]:
    """Return the links of a URDF or SDF file with one body, and note what is not read. Raise `BadInput`."""
    root = parse(path)
    models = [root] if root.tag == "robot" else [*root.findall("model"), *root.findall("world/model")]
    if len(models) != 1 or models[0].find("include") is not None or models[0].find("model") is not None:
        raise refuse(path, f"{len(models)} models, or one within another", "one model without includes")
    model = Description(path, models[0], search, reading)
    model.look(root)
    fixed = [joint.child for joint in model.joints if joint.kind == "fixed"]
    for joint in model.joints:
        if joint.kind != "fixed" or joint.parent == "world":
            raise refuse(path, f"the joint {joint.name!r}, which moves or holds the body ({joint.kind})", ONE)
    links = [model.link(element.get("name", "")) for element in models[0].findall("link")]
    roots = [link for link in links if link.name not in fixed]
    if len(roots) != 1:
        raise refuse(path, f"{len(roots)} root links", ONE)
    if roots[0].name == "world":
        reading.doubts.append("the body is named 'world', which some engines hold")
    return [*roots, *(link for link in links if link.name in fixed)]


def _values(element: Any) -> dict[str, str]:
    """Return the attributes and the texts of the children of an element."""
    return {} if element is None else {**element.attrib, **{child.tag: child.text or "" for child in element}}


_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)


def numbers(text: str | None, count: int = 0) -> list[float]:
    """Return the finite numbers of a text, `count` if it is given. Raise `Unread` for others."""
    words = (text or "").split()
    values = [float(word) if _NUMBER.fullmatch(word) else math.nan for word in words]
    if wrong := [word for word, value in zip(words, values, strict=True) if not math.isfinite(value)]:
        finite = wrong[0].lstrip("+-").lower() in ("nan", "inf", "infinity") or _NUMBER.fullmatch(wrong[0])
        raise Unread(f"{wrong[0]!r}, which is {'not finite' if finite else 'no number'}")
    if count and len(values) != count:
        raise Unread(f"{text!r}, which is {len(values)} numbers instead of {count}")
    return values


def number(text: str) -> float:
    """Return the finite number in a text. Raise `Unread`."""
    return numbers(text, 1)[0]
