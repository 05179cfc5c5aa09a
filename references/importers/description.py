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


@dataclass(frozen=True, eq=False)
class Piece:
    """Mass, kg, centre of mass (3,), m, and inertia about it (3, 3), kg m^2."""

    mass: float
    com: Array
    inertia: Array

    def place(self, pose: Array) -> Piece:
        """Return the part in other axes, in which its own have a pose (4, 4)."""
        R = pose[:3, :3]
        return Piece(self.mass, R @ self.com + pose[:3, 3], R @ self.inertia @ R.T)

    def scale(self, factor: float) -> Piece:
        """Return the part with another density."""
        return Piece(factor * self.mass, self.com, factor * self.inertia)

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

    `pose` (4, 4) is its pose in the root link, and `frame` (4, 4) that of the inertial frame in the link, m. `inertia` (3, 3)
    is in the inertial frame, kg m^2. `geometry` is its geometry with `DENSITY`.
    """

    pose: Array
    mass: float = 0.0
    frame: Array = field(default_factory=lambda: np.eye(4))
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))
    geometry: Piece = Piece(0.0, np.zeros(3), np.zeros((3, 3)))

    def filled(self, part: Piece) -> Link:
        """Return the link with mass and inertia of a part in its axes."""
        return replace(self, mass=part.mass, frame=make_pose(part.com), inertia=part.inertia)


def join_links(links: Iterable[Link]) -> Piece:
    """Return links as one part, in the axes of the root link."""
    return join(Piece(each.mass, np.zeros(3), each.inertia).place(each.frame).place(each.pose) for each in links)


def join(parts: Iterable[Piece]) -> Piece:
    """Return several parts as one: J = sum J_i + m_i (d_i.d_i 1 - d_i d_i'), d_i = c_i - c (Steiner)."""
    parts = list(parts)
    mass = sum(part.mass for part in parts)
    com = sum((part.mass * part.com for part in parts), np.zeros(3)) / (mass or 1.0)
    inertia = np.zeros((3, 3))
    for part in parts:
        d = part.com - com
        inertia = inertia + part.inertia + steiner(part.mass, d)
    return Piece(mass, com, inertia)


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
    """Return "urdf", "mjcf", "sdf" or "usd". Raise as `read_links`."""
    if path.suffix.lower() in (".usd", ".usda", ".usdc"):
        return "usd"
    try:
        return ROOTS[ElementTree.fromstring(path.read_bytes()).tag]
    except (OSError, ElementTree.ParseError, KeyError) as error:
        reason = f"the root element {error}" if isinstance(error, KeyError) else getattr(error, "strerror", None) or error
        allowed = f"a file of XML with the root element {', '.join(ROOTS)}, or .usd, .usda, .usdc"
        raise BadInput("file", f"{str(path)!r}: {reason}", allowed) from None


def read_links(path: Path, angles: float = 1.0) -> list[Link]:
    """Return the links of a URDF, SDF, USD or MJCF file with one rigid body, the root link first.

    All angles in URDF and SDF are multiplied by `angles`; if it is not 1, MJCF is read with the other unit of angles.

    Raises
    ------
    BadInput
        The file cannot be read, has a joint that moves, no inertia, a missing mesh, or no units.
    MissingEngine, MissingExtra
        MuJoCo, usd-core or trimesh is not installed.
    """
    file = _File(path, angles)
    try:
        links = {"mjcf": _read_mjcf, "usd": _read_usd}.get(kind_of(path), _read_xml)(file)
    except (ValueError, LookupError, AttributeError, TypeError) as error:
        if isinstance(error, BadInput):
            raise
        raise file.refuse(
            f"what cannot be read ({type(error).__name__}: {error})", "elements and numbers of its format"
        ) from None
    if not any(link.mass for link in links):
        raise file.refuse("no mass in any link", "mass and inertia of a link")
    base = np.linalg.inv(links[0].pose)
    return [replace(link, pose=base @ link.pose) for link in links]


@dataclass(frozen=True)
class _File:
    """A file, for messages, poses and geometry."""

    path: Path
    angles: float

    def refuse(self, what: str, allowed: str) -> BadInput:
        return BadInput("file", f"{str(self.path)!r} with {what}", allowed)

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

    def weigh(self, element: ElementTree.Element, place: Array, density: float = DENSITY) -> list[Piece]:
        """Return the part in a <geometry> of URDF or SDF at a place (4, 4), m, with a density, kg/m^3; none for a plane."""
        form = element[0]
        values = _values(form)
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


def weigh(kind: str, sizes: Any, pose: Array, density: float) -> list[Piece]:
    """Return the part of a shape after an affine map `pose` (4, 4), which may scale it; none for another kind.

    Shapes are centred and about the third axis: "box" (edges), "sphere" (radius), "ellipsoid" (semi-axes), "cylinder" and
    "capsule" (radius, length of the cylinder), "mesh" (vertices and triangles), m. The density is that after the map, kg/m^3.
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
    return [Piece(size * volume, A @ centroid + pose[:3, 3], np.trace(second) * np.eye(3) - second)]


def _numbers(text: str | None) -> list[float]:
    return [float(word) for word in (text or "").split()]


def _read_xml(file: _File) -> list[Link]:
    """Return the links of a URDF or SDF file, whose elements have the same names. URDF has attributes where SDF has texts."""
    root = ElementTree.fromstring(file.path.read_bytes())
    urdf = root.tag == "robot"
    models = [root] if urdf else [*root.findall("model"), *root.findall("world/model")]
    if len(models) != 1 or models[0].find("include") is not None or models[0].find("model") is not None:
        raise file.refuse(f"{len(models)} models, or one within another", "one model without includes")
    (model,) = models
    own, attribute = ("origin", "link") if urdf else ("pose", "")
    frames = {each.attrib["name"]: each for tag in ("link", "frame", "joint") for each in model.findall(tag)}
    bases, free = dict[str, tuple[str, Array]](), []
    for joint in model.findall("joint"):
        parent, child = ((end.get(attribute) or end.text or "") for name in ("parent", "child") for end in joint.findall(name))
        if urdf and joint.get("type") == "floating" and frames[parent].find("inertial") is None:
            free.append(parent)
        elif joint.get("type") == "fixed" and parent != "world":
            bases[child] = parent, file.pose(joint.find(own))
        else:
            raise file.refuse(f"the joint {joint.get('name')!r}, which moves or holds the body ({joint.get('type')})", ONE)

    def place(name: str) -> Array:
        """Return the pose of a link, frame or joint in the model."""
        if name in ("", "__model__"):
            return np.eye(4)
        if urdf:
            return place(bases[name][0]) @ bases[name][1] if name in bases else np.eye(4)
        pose, element = frames[name].find(own), frames[name]
        base = ("" if pose is None else pose.get("relative_to", "")) or element.get("attached_to", "")
        return place(base or element.findtext("child", "")) @ file.pose(pose)

    links = {}
    for name in (each.attrib["name"] for each in model.findall("link") if each.get("name") not in free):
        inertial, link, forms = frames[name].find("inertial"), Link(place(name)), []
        if inertial is None and not urdf:
            raise file.refuse(f"the link {name!r} without inertia", "<inertial> in each link")
        for each in frames[name].findall("collision"):
            density = each.findtext("density") or (inertial is not None and inertial.findtext("density")) or DENSITY
            forms += file.weigh(each.find("geometry"), file.pose(each.find(own)), float(density))  # type: ignore[arg-type]
        link = replace(link, geometry=join(forms))
        if inertial is not None and inertial.get("auto") in ("true", "1"):
            link = link.filled(link.geometry)
        elif inertial is not None:
            mass: Any = inertial.find("mass")
            given = _values(inertial.find("inertia"))
            inertia = np.array(
                [[float(given.get(f"i{min(a, b)}{max(a, b)}", a == b and not urdf)) for a in "xyz"] for b in "xyz"]
            )
            link = replace(
                link, mass=float(mass.get("value") or mass.text), frame=file.pose(inertial.find(own)), inertia=inertia
            )
        links[name] = link
    roots = [name for name in links if name not in bases]
    if len(roots) != 1:
        raise file.refuse(f"{len(roots)} root links", ONE)
    return [links.pop(roots[0]), *links.values()]


def _values(element: ElementTree.Element | None) -> dict[str, str]:
    """Return the attributes and the texts of the children of an element."""
    return {} if element is None else {**element.attrib, **{child.tag: child.text or "" for child in element}}


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

    def form(prim: Any, pose: Array, density: float) -> list[Piece]:
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
    bodies = [prim for prim in prims if prim.HasAPI(UsdPhysics.RigidBodyAPI)]
    if not bodies or len(joints) != len(bodies) - 1 or not all(joint.IsA(UsdPhysics.FixedJoint) for joint in joints):
        raise file.refuse(f"{len(bodies)} rigid bodies and the joints {[joint.GetName() for joint in joints]}", ONE)
    for body in bodies:
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
    return links


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

    def part(model: Any, body: int) -> Piece:
        place = make_pose(model.body_ipos[body], Rotation.from_quat(model.body_iquat[body], scalar_first=True))
        return Piece(float(model.body_mass[body]), np.zeros(3), np.diag(model.body_inertia[body])).place(place)

    for body in range(1, model.nbody):
        link = Link(make_pose(data.xpos[body], data.xmat[body].reshape(3, 3))).filled(part(model, body))
        links.append(replace(link, geometry=part(shapes, body)) if shapes else link)
    return links
