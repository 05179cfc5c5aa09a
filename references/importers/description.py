"""The rigid body of a model file with one body: mass, centre of mass and inertia as URDF, SDF, USD or MJCF define them.

This is the second opinion: `readers` has the reference readers, and `mjcf` the second one of MJCF. Every element and attribute
is used, known to be irrelevant to a free body, or named in the notes. trimesh reads meshes, usd-core opens the stage of a file.

References
----------
URDF: https://wiki.ros.org/urdf/XML/link
SDF: http://sdformat.org/spec
USD: https://openusd.org/release/api/usd_physics_page_front.html
MJCF: https://mujoco.readthedocs.io/en/stable/XMLreference.html
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array
from conservative.errors import BadInput

from ..engine import load
from .files import kind_of, load_mesh, parse, qualified, reason, refuse
from .pieces import DENSITY, SHAPES, Link, Piece, Reading, join, make_pose, weigh
from .usd import read_usd

ONE = "one free rigid body, whose parts are on fixed joints"
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
            "visual sensor projector audio_sink audio_source battery light particle_emitter kinematic gravity enable_wind"
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


def read_links(path: Path, angles: float = 1.0, search: Sequence[Path] = ()) -> list[Link]:
    """Return the links of `read_own`."""
    return read_own(path, angles, search).links


def read_own(path: Path, angles: float = 1.0, search: Sequence[Path] = ()) -> Reading:
    """Return the links of a URDF, SDF or USD file with one rigid body as this package reads them, and of MJCF as MuJoCo does.

    All angles in URDF and SDF are multiplied by `angles`; if it is not 1, MJCF is read with the other unit of angles. Meshes
    may lie in the folder of the file or in those of `search`.

    Raises
    ------
    BadInput
        The file cannot be read, has a joint that moves, no inertia, a missing mesh, or no units.
    MissingEngine, MissingExtra
        MuJoCo, usd-core, lxml or trimesh is not installed.
    """
    kind = kind_of(path)
    file = File(path, angles, search)
    try:
        file.read.links = read_usd(path, search, file.read) if kind == "usd" else {"mjcf": read_mjcf}.get(kind, _read_xml)(file)
    except RecursionError:
        raise refuse(path, "frames that refer to each other in a circle", "frames that lead to the model") from None
    except (ValueError, LookupError, AttributeError, TypeError) as error:
        if isinstance(error, BadInput):
            raise
        what = f"what cannot be read ({type(error).__name__}: {error})"
        raise refuse(path, what, "elements and numbers of its format") from None
    links = file.read.links
    if not all(
        np.isfinite([*link.inertia.ravel(), *link.frame.ravel(), *link.pose.ravel(), link.mass]).all() for link in links
    ):
        raise refuse(path, "numbers that are not finite", "finite numbers in m, kg and kg m^2")
    if not any(link.mass for link in links):
        raise refuse(path, "no mass in any link", "mass and inertia of a link")
    base = np.linalg.inv(links[0].pose)
    file.read.links = [replace(link, pose=base @ link.pose) for link in links]
    return file.read


@dataclass(frozen=True)
class File:
    """A file, for messages, poses and geometry; `read` collects what has to be said."""

    path: Path
    angles: float
    search: Sequence[Path] = ()
    read: Reading = field(default_factory=Reading)

    def refuse(self, what: str, allowed: str) -> BadInput:
        return refuse(self.path, what, allowed)

    def pose(self, element: Any, of: str = "", version: str = "9") -> Array:
        """Return the pose (4, 4) in an <origin> of URDF or a <pose> of SDF, of a link `of`; without one the identity."""
        if element is None:
            return np.eye(4)
        if element.tag == "pose":
            values = numbers(element.text)
            if element.get("frame"):
                self.read.doubts.append(
                    f"a pose has frame={element.get('frame')!r}, an attribute of SDF 1.5 that is not read here"
                )
        else:
            values = numbers(f"{element.get('xyz', '0 0 0')} {element.get('rpy', '0 0 0')}")
        if of and (base := element.get("relative_to", of)):
            said = f"the pose in <{element.getparent().tag}> of {of!r} is relative to {base!r}, which the format does not allow"
            (self.read.doubts if base == of else self.read.invalid).extend([said] * ("relative_to" in element.attrib))
        if "quat_xyzw" in element.attrib:
            if tuple(map(int, version.split("."))) >= (1, 1):
                return make_pose(values[:3], Rotation.from_quat(numbers(element.get("quat_xyzw"))))
            self.read.notes.append("quat_xyzw is ignored in URDF 1.0, which has no such attribute")
        if element.get("rotation_format") == "quat_xyzw":
            return make_pose(values[:3], Rotation.from_quat(values[3:]))
        unit = self.angles * (math.pi / 180 if element.get("degrees") in ("true", "1") else 1.0)
        return make_pose(values[:3], Rotation.from_euler("xyz", unit * np.array(values[3:] or [0, 0, 0])))

    def weigh(self, element: Any, place: Array, density: float = DENSITY) -> list[Piece]:
        """Return the part in a <geometry> of URDF or SDF at a place (4, 4), m, with a density, kg/m^3; none for a plane.

        Raise `BadInput` for a mesh that cannot be read, and for another shape than those of `weigh`.
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
            raise self.refuse(f"the shape <{form.tag}>", f"shapes whose volume is known: {', '.join(SHAPES)}")
        return weigh(form.tag, numbers(" ".join(values[name] for name in names)), place, density)

    def look(self, element: Any, format_: str) -> None:
        """Note what no rule here covers, in an element and its children: in the parts with a mass it is a doubt."""
        tag = element.tag
        used, ignored = (names.split() for names in KNOWN[format_].get(tag, ("*", "")))
        owners = [*((name, element) for name in element.attrib), *((child.tag, child) for child in element)]
        for name, owner in () if used == ["*"] else owners:
            if name not in used and name not in ignored:
                plain = qualified(owner, name)
                if engine := EXTENSIONS.get(plain.partition(":")[0]):
                    inside = [each for each in owner.iter() if each is not element and owner is not element]
                    values = [f"{each.tag} {key}={value!r}" for each in inside for key, value in each.attrib.items()]
                    self.read.asks.setdefault(engine, []).append(" ".join([f"<{plain}>", *values]))
                else:
                    said = f"<{tag}> has {plain!r}, which is not read here"
                    (self.read.doubts if tag in MASS else self.read.notes).append(said)
            if name in MASS and len(element.findall(name)) > 1:
                self.read.invalid.append(f"<{tag}> has several elements <{name}>")
        for child in element:
            if child.tag in used:
                self.look(child, format_)


def numbers(text: str | None) -> list[float]:
    """Return the finite numbers of a text. Raise ValueError for others."""
    values = [float(word) for word in (text or "").split()]
    if not all(map(math.isfinite, values)):
        raise ValueError(f"{text!r} is not finite")
    return values


@dataclass(frozen=True)
class Joint:
    """A joint of URDF or SDF: its name and kind, the links that it joins, and its pose (4, 4) in the parent of URDF."""

    name: str
    kind: str
    parent: str
    child: str
    pose: Array


class Frames:
    """The joints of a model of URDF or SDF, and the poses of its links, joints and frames."""

    def __init__(self, file: File, model: Any) -> None:
        self.urdf = model.tag == "robot"
        self._file, version = file, model.get("version", "1.0") if self.urdf else "1.0"
        self.own, attribute = ("origin", "link") if self.urdf else ("pose", "name")
        tags = ("link",) if self.urdf else ("joint", "frame", "link")  # a joint of URDF may have the name of its link
        self.elements = {each.get("name", ""): each for tag in tags for each in model.findall(tag)}
        self.joints = []
        for each in model.findall("joint"):
            ends = [each.find(name) for name in ("parent", "child")]
            names = ["" if end is None else (end.get(attribute) or end.text or "").strip() for end in ends]
            pose = file.pose(each.find(self.own), version=version) if self.urdf else np.eye(4)
            self.joints.append(Joint(each.get("name", ""), each.get("type", ""), names[0], names[1], pose))
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
        return self.place(base or element.findtext("child", "")) @ self._file.pose(pose)


def _read_xml(file: File) -> list[Link]:
    """Return the links of a URDF or SDF file, whose elements have the same names. URDF has attributes where SDF has texts."""
    root = parse(file.path)
    urdf = root.tag == "robot"
    version = root.get("version", "1.0") if urdf else "sdf"
    file.look(root, "urdf" if urdf else "sdf")
    models = [root] if urdf else [*root.findall("model"), *root.findall("world/model")]
    if len(models) != 1 or models[0].find("include") is not None or models[0].find("model") is not None:
        raise file.refuse(f"{len(models)} models, or one within another", "one model without includes")
    (model,) = models
    frames, free = Frames(file, model), list[str]()
    for joint in frames.joints:
        if urdf and joint.kind == "floating" and frames.elements[joint.parent].find("inertial") is None:
            free.append(joint.parent)
        elif joint.kind != "fixed" or joint.parent == "world":
            raise file.refuse(f"the joint {joint.name!r}, which moves or holds the body ({joint.kind})", ONE)
    links = {}
    for name in (each.get("name", "") for each in model.findall("link") if each.get("name") not in free):
        element, link = frames.elements[name], Link(frames.place(name), name=name)
        inertial = element.find("inertial")
        auto = inertial is not None and inertial.get("auto") in ("true", "1")
        try:
            link = replace(link, geometry=join(_shapes(file, frames, name, inertial)))
        except BadInput as error:
            if auto:
                raise
            file.read.notes.append(f"the geometry of {name!r} is not used: {reason(error)}")
        if auto:
            link = link.filled(link.geometry)
        elif inertial is not None or not urdf:
            link = _inertial(file, link, element.makeelement("inertial") if inertial is None else inertial, name, version)
        links[name] = link
    roots = [name for name in links if name not in [joint.child for joint in frames.joints if joint.kind == "fixed"]]
    if len(roots) != 1:
        raise file.refuse(f"{len(roots)} root links", ONE)
    return [links.pop(roots[0]), *links.values()]


def _shapes(file: File, frames: Frames, name: str, inertial: Any) -> list[Piece]:
    """Return the parts of the collision geometry of a link. Raise `BadInput` if one cannot be weighed."""
    forms = []
    for each in frames.elements[name].findall("collision"):
        density = each.findtext("density") or (inertial is not None and inertial.findtext("density")) or DENSITY
        pose = each.find(frames.own)
        at = file.pose(pose)
        if pose is not None and pose.get("relative_to"):
            at = np.linalg.inv(frames.place(name)) @ frames.place(pose.get("relative_to")) @ at
        forms += file.weigh(each.find("geometry"), at, float(density))
    return forms


def _inertial(file: File, link: Link, inertial: Any, name: str, version: str) -> Link:
    """Return a link with the <inertial> of URDF, where all values are required, or of SDF, where the defaults are 1 and 0."""
    urdf = version != "sdf"
    mass, given = inertial.find("mass"), _values(inertial.find("inertia"))
    missing = [each for each in KNOWN["urdf"]["inertia"][0].split() if each not in given] if urdf else []
    weight = None if mass is None else mass.get("value") if urdf else mass.text
    missing += ["mass"] * (urdf and weight is None)
    if missing:
        file.read.invalid.append(f"<inertial> of {name!r} has no {', '.join(missing)}, which the format requires")
    inertia = [[float(given.get(f"i{min(a, b)}{max(a, b)}", a == b and not urdf)) for a in "xyz"] for b in "xyz"]
    frame = file.pose(inertial.find("origin" if urdf else "pose"), name, version if urdf else "1.0")
    return replace(link, mass=float(weight or not urdf), frame=frame, inertia=np.array(inertia))


def _values(element: Any) -> dict[str, str]:
    """Return the attributes and the texts of the children of an element."""
    return {} if element is None else {**element.attrib, **{child.tag: child.text or "" for child in element}}


def read_mjcf(file: File) -> list[Link]:
    """Return the links of an MJCF file as MuJoCo compiles it, with their geometry."""
    mujoco = load("mujoco", "mujoco", "MuJoCo")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            spec = mujoco.MjSpec.from_file(str(file.path))
            spec.compiler.degree ^= file.angles != 1
            model = spec.compile()
        except (ValueError, mujoco.FatalError) as error:
            raise file.refuse(f"an error ({' '.join(str(error).split())})", "a file that MuJoCo compiles") from None
        file.read.notes.extend(f"MuJoCo warns: {each.message}" for each in said)
        spec.compiler.inertiafromgeom = int(mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE)
        try:
            shapes = spec.compile()
        except (ValueError, mujoco.FatalError):  # bodies without geometry
            shapes = None
    if model.njnt > (model.nq == 7):
        raise file.refuse(f"the joint {model.jnt(model.njnt - 1).name!r}, which moves", ONE)
    if (model.body_parentid[1:] == 0).sum() != 1:
        raise file.refuse(f"{(model.body_parentid[1:] == 0).sum()} bodies in the world", ONE)
    data, links = mujoco.MjData(model), []
    mujoco.mj_kinematics(model, data)

    def part(model: Any, body: int) -> Piece:
        place = make_pose(model.body_ipos[body], Rotation.from_quat(model.body_iquat[body], scalar_first=True))
        return Piece(float(model.body_mass[body]), np.zeros(3), np.diag(model.body_inertia[body])).place(place)

    for body in range(1, model.nbody):
        link = Link(make_pose(data.xpos[body], data.xmat[body].reshape(3, 3)), name=model.body(body).name)
        link = link.filled(part(model, body))
        links.append(replace(link, geometry=part(shapes, body)) if shapes else link)
    return links
