"""The rigid body of a model file: mass, centre of mass and inertia as URDF, SDF, USD or MJCF define them.

URDF and SDF are read here, USD by usd-core, meshes by trimesh. MuJoCo defines MJCF, so MJCF is what MuJoCo compiles.

References
----------
URDF: https://wiki.ros.org/urdf/XML/link
SDF: http://sdformat.org/spec
USD: https://openusd.org/release/api/usd_physics_page_front.html
MJCF: https://mujoco.readthedocs.io/en/stable/XMLreference.html
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array
from conservative.errors import BadInput, require_extra

from ..engine import load

ROOTS = {"robot": "urdf", "mujoco": "mjcf", "sdf": "sdf"}
DENSITY = 1000.0
"""Density of geometry that has none in a file, kg/m^3."""
ONE = "one free rigid body, whose parts are on fixed joints"
_MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


@dataclass(frozen=True, eq=False)
class Part:
    """Mass, kg, centre of mass (3,), m, and inertia about it (3, 3), kg m^2."""

    mass: float
    com: Array
    inertia: Array

    def place(self, pose: Array) -> Part:
        """Return the part in other axes, in which its own have a pose (4, 4)."""
        R = pose[:3, :3]
        return Part(self.mass, R @ self.com + pose[:3, 3], R @ self.inertia @ R.T)

    def scale(self, factor: float) -> Part:
        """Return the part with another density."""
        return Part(factor * self.mass, self.com, factor * self.inertia)

    @property
    def flaw(self) -> str:
        """Why no body has this mass and inertia; empty if one has. Files may round the moments of a planar body."""
        moments = np.linalg.eigvalsh(self.inertia)
        if not (self.mass > 0 and moments[0] > 0):
            return "mass and principal moments are not all positive"
        return "a moment exceeds the sum of the others" if moments[2] > (moments[0] + moments[1]) * (1 + 1e-6) else ""


@dataclass(frozen=True, eq=False)
class Link:
    """A link, fixed to the root link.

    Attributes
    ----------
    pose, frame
        Pose (4, 4) of the link in the root link, and of the inertial frame in the link, m.
    mass, inertia
        Mass, kg, and inertia (3, 3) in the inertial frame, about its origin, kg m^2.
    geometry
        The part that the geometry is with `DENSITY`, axes of the link; its mass is 0 if there is none.
    """

    pose: Array
    mass: float = 0.0
    frame: Array = field(default_factory=lambda: np.eye(4))
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))
    geometry: Part = Part(0.0, np.zeros(3), np.zeros((3, 3)))  # frozen

    def filled(self, part: Part) -> Link:
        """Return the link with mass and inertia of a part in its axes."""
        return replace(self, mass=part.mass, frame=make_pose(part.com), inertia=part.inertia)


def join_links(links: Iterable[Link]) -> Part:
    """Return links as one part, in the axes of the root link."""
    return join(Part(each.mass, np.zeros(3), each.inertia).place(each.frame).place(each.pose) for each in links)


def join(parts: Iterable[Part]) -> Part:
    """Return several parts as one: J = sum J_i + m_i (d_i.d_i 1 - d_i d_i'), d_i = c_i - c (Steiner)."""
    parts = list(parts)
    mass = sum(part.mass for part in parts)
    com = sum((part.mass * part.com for part in parts), np.zeros(3)) / (mass or 1.0)
    inertia = np.zeros((3, 3))
    for part in parts:
        d = part.com - com
        inertia = inertia + part.inertia + steiner(part.mass, d)
    return Part(mass, com, inertia)


def steiner(mass: float, d: Array) -> Array:
    """Return the inertia (3, 3) of a point mass at d (3,) about the origin."""
    return mass * (d @ d * np.eye(3) - np.outer(d, d))


def make_pose(place: Any = (0, 0, 0), R: Array | Rotation | None = None) -> Array:
    """Return the pose (4, 4) of a place (3,) and a rotation."""
    T = np.eye(4)
    T[:3, 3] = place
    T[:3, :3] = np.eye(3) if R is None else R.as_matrix() if isinstance(R, Rotation) else R
    return T


def kind_of(path: Path) -> str:
    """Return "urdf", "mjcf", "sdf" or "usd". Raise `BadInput` for another file."""
    if path.suffix.lower() in (".usd", ".usda", ".usdc"):
        return "usd"
    try:
        return ROOTS[ElementTree.fromstring(path.read_bytes()).tag]
    except OSError as error:
        raise BadInput("file", f"{str(path)!r}: {error.strerror}", "a model file that can be read") from None
    except ElementTree.ParseError as error:
        raise BadInput("file", f"{str(path)!r}: {error}", "a file of XML, or .usd, .usda, .usdc") from None
    except KeyError as error:
        raise BadInput("file", f"{str(path)!r} with the root element {error}", f"one of {', '.join(ROOTS)}") from None


def read_links(path: Path, angles: float = 1.0) -> list[Link]:
    """Return the links of a file with one rigid body, the root link first.

    Parameters
    ----------
    path
        A URDF, SDF, USD or MJCF file.
    angles
        Factor of all angles in URDF and SDF; 180 / pi reads radians as degrees. Other than 1 in MJCF: the other unit.

    Raises
    ------
    BadInput
        The file cannot be read, has a joint that moves, no inertia, a missing mesh, or no units.
    MissingEngine, MissingExtra
        MuJoCo, usd-core or trimesh is not installed.
    """
    file = _File(path, angles)
    readers = {"urdf": _read_urdf, "mjcf": _read_mjcf, "sdf": _read_sdf, "usd": _read_usd}
    try:
        links = readers[kind_of(path)](file)
    except BadInput:
        raise
    except (ValueError, LookupError, AttributeError, TypeError) as error:
        raise file.refuse(
            f"what cannot be read ({type(error).__name__}: {error})", "elements and numbers of its format"
        ) from None
    if not any(link.mass for link in links):
        raise file.refuse("no mass in any link", "mass and inertia of a link")
    return links


@dataclass(frozen=True)
class _File:
    """A file, for messages, poses and geometry."""

    path: Path
    angles: float

    def refuse(self, what: str, allowed: str) -> BadInput:
        return BadInput("file", f"{str(self.path)!r} with {what}", allowed)

    @property
    def root(self) -> ElementTree.Element:
        return ElementTree.fromstring(self.path.read_bytes())

    def pose(self, element: ElementTree.Element | None) -> Array:
        """Return the pose (4, 4) in an <origin> of URDF or a <pose> of SDF; without one the identity."""
        if element is None:
            return np.eye(4)
        values = _numbers(
            f"{element.get('xyz', '0 0 0')} {element.get('rpy', '0 0 0')}" if element.tag == "origin" else element.text
        )
        if element.get("rotation_format") == "quat_xyzw":
            return make_pose(values[:3], Rotation.from_quat(values[3:]))
        unit = self.angles * (math.pi / 180 if element.get("degrees") in ("true", "1") else 1.0)
        return make_pose(values[:3], Rotation.from_euler("xyz", unit * np.array(values[3:] or [0, 0, 0])))

    def weigh(self, element: ElementTree.Element, place: Array, density: float = DENSITY) -> list[Part]:
        """Return the part in a <geometry> of URDF or SDF at a place (4, 4), m, with a density, kg/m^3; none for a plane."""
        form = element[0]
        values = form.attrib | {child.tag: child.text or "" for child in form}
        if form.tag == "mesh":
            name = values.get("filename", values.get("uri", ""))
            path = self.path.parent / name.removeprefix("file://")
            if not path.is_file():
                raise self.refuse(
                    f"the mesh {name!r}, which is not there", "meshes that exist, with paths relative to the file"
                )
            require_extra("a mesh", "models", "trimesh")
            import trimesh

            mesh: Any = trimesh.load(path, force="mesh")
            return weigh("mesh", [mesh.vertices * _numbers(values.get("scale", "1 1 1")), mesh.faces], place, density)
        names = {"box": ("size",), "ellipsoid": ("radii",), "sphere": ("radius",)}.get(form.tag, ("radius", "length"))
        sizes = _numbers(" ".join(values[name] for name in names)) if form.tag != "plane" else []
        return weigh(form.tag, sizes, place, density)


def weigh(kind: str, sizes: Any, pose: Array, density: float) -> list[Part]:
    """Return the part of a shape after an affine map (4, 4), which may scale it; none for another kind.

    Parameters
    ----------
    kind, sizes
        "box" (edges), "sphere" (radius), "ellipsoid" (semi-axes), "cylinder" or "capsule" (radius, length of the cylinder), all
        about their centres and the third axis, or "mesh" (vertices and triangles), m.
    pose, density
        The map, and the density after it, kg/m^3.
    """
    centroid = np.zeros(3)
    if kind == "mesh":  # tetrahedra from the origin
        corners = np.asarray(sizes[0], float)[np.asarray(sizes[1])]
        total, weight = corners.sum(axis=1), np.linalg.det(corners)
        volume = weight.sum() / 6
        centroid = weight @ total / 24 / volume
        second = (total.T * weight) @ total + np.einsum("n,nki,nkj->ij", weight, corners, corners)
        second = second / 120 - volume * np.outer(centroid, centroid)
    elif kind in ("box", "ellipsoid", "sphere"):
        sides = np.broadcast_to(sizes, 3)
        volume = np.prod(sides) * (1 if kind == "box" else 4 / 3 * math.pi)
        second = volume * np.diag(sides**2) / (12 if kind == "box" else 5)
    elif kind in ("cylinder", "capsule"):
        r, length = sizes
        rod, ball = math.pi * r * r * length, 4 / 3 * math.pi * r**3 * (kind == "capsule")
        ends = ball * (length**2 / 4 + 3 * length * r / 8)  # of the hemispheres along the axis, in addition to those of a ball
        volume = rod + ball
        second = np.diag([rod * r * r / 4] * 2 + [rod * length**2 / 12 + ends]) + ball * r * r / 5 * np.eye(3)
    else:
        return []
    A, size = pose[:3, :3], density * abs(np.linalg.det(pose[:3, :3])) * math.copysign(1, volume)  # a mesh may be inside out
    second = size * A @ second @ A.T
    return [Part(size * volume, A @ centroid + pose[:3, 3], np.trace(second) * np.eye(3) - second)]


def _numbers(text: str | None) -> list[float]:
    return [float(word) for word in (text or "").split()]


def _symmetric(xx: float, yy: float, zz: float, xy: float, xz: float, yz: float) -> Array:
    return np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))


def _read_urdf(file: _File) -> list[Link]:
    links, joints = dict[str, Link](), dict[str, tuple[str, Array]]()
    for element in file.root.findall("link"):
        forms = [(each.find("geometry"), file.pose(each.find("origin"))) for each in element.findall("collision")]
        link = Link(np.eye(4), geometry=join(part for form, at in forms if form is not None for part in file.weigh(form, at)))
        if (own := element.find("inertial")) is not None:
            values, mass = own.find("inertia").attrib, float(own.find("mass").attrib["value"])  # type: ignore[union-attr]
            inertia = _symmetric(*(float(values.get(key, 0)) for key in _MOMENTS))
            link = replace(link, mass=mass, frame=file.pose(own.find("origin")), inertia=inertia)
        links[element.attrib["name"]] = link
    for joint in file.root.findall("joint"):
        kind, parent, child = joint.get("type"), *(joint.find(end).attrib["link"] for end in ("parent", "child"))  # type: ignore[union-attr]
        if kind == "floating" and not links[parent].mass:
            del links[parent]
        elif kind == "fixed":
            joints[child] = parent, file.pose(joint.find("origin"))
        else:
            raise file.refuse(f"the joint {joint.get('name')!r}, which moves ({kind})", ONE)
    roots = [name for name in links if name not in joints]
    if len(roots) != 1:
        raise file.refuse(f"{len(roots)} root links", ONE)

    def place(name: str) -> Array:
        return joints[name][1] if joints[name][0] == roots[0] else place(joints[name][0]) @ joints[name][1]

    return [links[roots[0]], *(replace(links[name], pose=place(name)) for name in joints)]


def _read_sdf(file: _File) -> list[Link]:
    models = [*file.root.findall("model"), *file.root.findall("world/model")]
    if len(models) != 1 or models[0].find("include") is not None or models[0].find("model") is not None:
        raise file.refuse(f"{len(models)} models, or one within another", "one model without includes")
    (model,) = models
    frames = {each.get("name"): each for tag in ("link", "frame", "joint") for each in model.findall(tag)}

    def place(name: str) -> Array:
        """Return the pose of a link, frame or joint in the model."""
        if name in ("", "__model__"):
            return np.eye(4)
        own, element = frames[name].find("pose"), frames[name]
        base = ("" if own is None else own.get("relative_to", "")) or element.get("attached_to", "")
        return place(base or element.findtext("child", "")) @ file.pose(own)

    links = []
    for element in model.findall("link"):
        own = element.find("inertial")
        if own is None:
            raise file.refuse(f"the link {element.get('name')!r} without inertia", "<inertial> in each link")
        link, forms = Link(place(element.attrib["name"])), []
        for each in element.findall("collision"):
            density = float(each.findtext("density") or own.findtext("density") or DENSITY)
            forms += file.weigh(each.find("geometry"), file.pose(each.find("pose")), density)  # type: ignore[arg-type]
        if own.get("auto") in ("true", "1"):
            link = link.filled(join(forms))
        else:
            inertia = _symmetric(*(float(own.findtext(f"inertia/{key}") or key[1] == key[2]) for key in _MOMENTS))
            link = replace(link, mass=float(own.findtext("mass") or 1), frame=file.pose(own.find("pose")), inertia=inertia)
        links.append(replace(link, geometry=join(forms)))
    joints = model.findall("joint")
    for joint in joints:
        if joint.get("type") != "fixed" or "world" in (joint.findtext("parent"), joint.findtext("child")):
            raise file.refuse(f"the joint {joint.get('name')!r}, which moves or holds the body", ONE)
    return _relative(file, links, len(joints))


def _relative(file: _File, links: list[Link], joints: int) -> list[Link]:
    """Return links with their poses in the first one. Raise `BadInput` unless fixed joints make them one body."""
    if joints != len(links) - 1:
        raise file.refuse(f"{len(links)} links on {joints} fixed joints", ONE)
    base = np.linalg.inv(links[0].pose)
    return [replace(link, pose=base @ link.pose) for link in links]


def _read_usd(file: _File) -> list[Link]:
    require_extra("a USD file", "models", "pxr")
    from pxr import Tf, Usd, UsdGeom, UsdPhysics

    try:
        stage = Usd.Stage.Open(str(file.path))
    except Tf.ErrorException as error:
        raise file.refuse(f"an error ({' '.join(str(error).split())[:200]})", "a stage that usd-core opens") from None
    if not UsdGeom.StageHasAuthoredMetersPerUnit(stage):
        raise file.refuse("no unit of length", "metersPerUnit in the metadata of the stage")
    metre, kilogram = UsdGeom.GetStageMetersPerUnit(stage), UsdPhysics.GetStageKilogramsPerUnit(stage)
    units, cache, prims = np.diag((metre, metre, metre, 1.0)), UsdGeom.XformCache(), list(stage.Traverse())

    def world(prim: Any) -> Array:
        return units @ np.array(cache.GetLocalToWorldTransform(prim)).T

    def read(prim: Any, *names: str) -> list[Any]:
        """Return authored attributes; None for others."""
        attributes = [prim.GetAttribute(name) for name in names]
        return [each.Get() if each and each.HasAuthoredValue() else None for each in attributes]

    def form(prim: Any, pose: Array, density: float) -> list[Part]:
        kind = prim.GetTypeName().lower()
        if kind == "mesh":
            points, counts, corners = map(np.array, read(prim, "points", "faceVertexCounts", "faceVertexIndices"))
            starts = np.cumsum(counts) - counts
            fans = [(s, s + k, s + k + 1) for s, count in zip(starts, counts, strict=True) for k in range(1, count - 1)]
            return weigh(kind, [points, corners[np.array(fans)]], pose, density)
        names = {"cube": ("size",), "sphere": ("radius",)}.get(kind, ("radius", "height"))
        sizes = [prim.GetAttribute(name).Get() for name in names]
        axis = "XYZ".index(prim.GetAttribute("axis").Get()) if len(sizes) == 2 else 2
        turn = make_pose(R=np.roll(np.eye(3), axis - 2, axis=0))
        return weigh({"cube": "box"}.get(kind, kind), sizes if len(sizes) == 2 else sizes[0], pose @ turn, density)

    links, joints = [], [prim for prim in prims if prim.IsA(UsdPhysics.Joint)]
    for joint in joints:
        if not joint.IsA(UsdPhysics.FixedJoint):
            raise file.refuse(f"the joint {str(joint.GetPath())!r}, which moves", ONE)
    for body in (prim for prim in prims if prim.HasAPI(UsdPhysics.RigidBodyAPI)):
        pose = world(body)
        pose[:3, :3] /= metre
        if np.abs(pose[:3, :3] @ pose[:3, :3].T - np.eye(3)).max() > 1e-5:
            raise file.refuse(f"the scaled body {str(body.GetPath())!r}", "rigid bodies whose transforms have no scale")
        mass, density, com, moments, q = read(
            body, *(f"physics:{name}" for name in ("mass", "density", "centerOfMass", "diagonalInertia", "principalAxes"))
        )
        forms = []
        for prim in (each for each in Usd.PrimRange(body) if each.HasAPI(UsdPhysics.CollisionAPI)):
            own, its_density = read(prim, "physics:mass", "physics:density")
            si = (density or its_density or 0) * kilogram / metre**3 or DENSITY
            parts = form(prim, np.linalg.inv(pose) @ world(prim), si)
            forms += [part.scale(own * kilogram / part.mass) if own else part for part in parts]
        whole = join(forms)
        whole = whole.scale(mass * kilogram / whole.mass) if mass and whole.mass else whole
        link = Link(pose, geometry=whole).filled(whole)
        if com is not None:
            link = replace(link, frame=make_pose(metre * np.array(com)))
        if mass:
            link = replace(link, mass=mass * kilogram)
        if moments:
            turn = Rotation.from_quat([*q.GetImaginary(), q.GetReal()]) if q and q.GetLength() else None
            inertia = np.diag(np.array(moments, float)) * kilogram * metre**2
            link = replace(link, frame=make_pose(link.frame[:3, 3], turn), inertia=inertia)
        links.append(link)
    return _relative(file, links, len(joints))


def _read_mjcf(file: _File) -> list[Link]:
    mujoco = load("mujoco", "mujoco", "MuJoCo")
    try:
        spec = mujoco.MjSpec.from_file(str(file.path))
        spec.compiler.degree ^= file.angles != 1
        model = spec.compile()
    except ValueError as error:
        raise file.refuse(f"an error ({' '.join(str(error).split())})", "a file that MuJoCo compiles") from None
    spec.compiler.inertiafromgeom = int(mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE)
    try:
        shapes = spec.compile()
    except ValueError:  # bodies without geometry
        shapes = None
    if model.njnt > (model.nq == 7):
        raise file.refuse(f"the joint {model.jnt(model.njnt - 1).name!r}, which moves", ONE)
    if (model.body_parentid[1:] == 0).sum() != 1:
        raise file.refuse(f"{(model.body_parentid[1:] == 0).sum()} bodies in the world", ONE)
    data, links = mujoco.MjData(model), []
    mujoco.mj_kinematics(model, data)

    def part(model: Any, body: int) -> Part:
        place = make_pose(model.body_ipos[body], Rotation.from_quat(model.body_iquat[body], scalar_first=True))
        return Part(float(model.body_mass[body]), np.zeros(3), np.diag(model.body_inertia[body])).place(place)

    for body in range(1, model.nbody):
        link = Link(make_pose(data.xpos[body], data.xmat[body].reshape(3, 3))).filled(part(model, body))
        links.append(replace(link, geometry=part(shapes, body)) if shapes else link)
    return _relative(file, links, model.nbody - 2)
