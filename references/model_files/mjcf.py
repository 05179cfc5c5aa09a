"""The body of an MJCF file from its elements: the second reading. The first one is `reference.by_mujoco`.

The file is read here as XML, with its files within files, classes and frames, by the rules of
https://mujoco.readthedocs.io/en/stable/XMLreference.html. What has no rule here raises `NotRead` instead of a guess: generated
bodies (`<replicate>`, `<composite>`, `<flexcomp>`, `<attach>`), shells of ellipsoids, shapes fitted to meshes, and meshes whose
volume depends on the version of MuJoCo.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from conservative.attitude import Array

from .description import is_true, number, numbers
from .files import inline, load_mesh
from .pieces import Link, Piece, Reading, join, join_links, make_pose, rounding_of, weigh

_HALF = {"capsule": (1, 2), "cylinder": (1, 2), "box": (2, 2, 2), "ellipsoid": (1, 1, 1), "sphere": (1,)}
"""Shapes, and the factors from sizes in MJCF, which are half lengths, to the sizes of `weigh`."""
_TURNS = ("axisangle", "xyaxes", "zaxis", "euler")
"""Attributes for a rotation that come before a quaternion."""
_GENERATED = ("replicate", "composite", "flexcomp", "attach")
"""Elements that stand for further bodies or geometries."""
_WHOLE = 1e-6
"""Largest difference of the volumes of a mesh and of its convex hull, relative to it, for a convex mesh."""

OPTIONS = ("inertiagrouprange", "inertiafromgeom", "balanceinertia", "boundinertia", "boundmass", "settotalmass")
"""Options of the compiler that change the body, without the units of angles."""

Attributes = Mapping[str, str]


class NotRead(Exception):
    """The file has something for which there is no rule here. The message names it."""


class Document:
    """An MJCF file: the options of its compiler and the attributes of its elements, after classes.

    `root` is the element <mujoco> with the content of the files that it includes. `shells` is True after `weigh` of a shell.
    """

    def __init__(self, path: Path, root: Any, search: Sequence[Path] = ()) -> None:
        self.path, self.root, self.search, self.shells = path, root, search, False
        self.options: dict[str, str] = {}
        for compiler in root.findall("compiler"):
            self.options.update(compiler.attrib)
        self.classes: dict[str, dict[str, dict[str, str]]] = {"main": {}}
        for default in root.findall("default"):
            self._read_class(default, "main", {})

    def _read_class(self, default: Any, name: str, outer: dict[str, dict[str, str]]) -> None:
        """Add a class, which begins as a copy of the class around it. Classes within it come after its own attributes."""
        attributes = self.classes.setdefault(name, deepcopy(outer))
        for child in default:
            if child.tag != "default":
                of = attributes.setdefault(child.tag, {})
                of.update(dict(child.attrib) | _sizes(of, child.attrib))
        for child in default.findall("default"):
            self._read_class(child, child.get("class", ""), attributes)

    def attributes(self, element: Any, inherited: str = "main") -> dict[str, str]:
        """Return the attributes of an element, with those of its class or of the class that it inherits."""
        name = element.get("class", inherited)
        if name not in self.classes:
            raise NotRead(f"the class {name!r}, which is not there")
        of = self.classes[name].get(element.tag, {})
        own = dict(element.attrib)
        turned = {key: value for key, value in of.items() if key not in _TURNS or not set(_TURNS) & set(own)}
        return turned | own | _sizes(of, own)

    def inherited(self, element: Any) -> str:
        """Return the class that the children of an element inherit."""
        chain = [element, *element.iterancestors()]
        return next((name for each in chain if each.tag in ("body", "frame") and (name := each.get("childclass"))), "main")

    def pose(self, attributes: Attributes) -> Array:
        """Return the pose (4, 4) in attributes."""
        return make_pose(numbers(attributes.get("pos", "0 0 0"), 3), self._turn(attributes))

    def frame(self, element: Any, top: Any) -> Array:
        """Return the pose (4, 4) of the frames between an element and a body above it."""
        whole, outer = np.eye(4), element.getparent()
        while outer is not top:
            whole, outer = self.pose(outer.attrib) @ whole, outer.getparent()
        return whole

    def joints(self, body: Any) -> list[tuple[str, Array]]:
        """Return the kinds of the joints of a body, and where they are in it (3,), m."""
        found = []
        for joint in within(body, "joint", "freejoint"):
            attributes = self.attributes(joint, self.inherited(joint)) if joint.tag == "joint" else {"type": "free"}
            place = self.frame(joint, body) @ [*numbers(attributes.get("pos", "0 0 0"), 3), 1.0]
            found.append((attributes.get("type", "hinge"), place[:3]))
        return found

    def _turn(self, attributes: Attributes) -> Rotation:
        """Return the rotation in attributes: a quaternion, scalar first, or what stands for it."""
        unit = 1.0 if self.options.get("angle", "degree") == "radian" else math.pi / 180
        if "axisangle" in attributes:
            *axis, angle = numbers(attributes["axisangle"], 4)
            return Rotation.from_rotvec(unit * angle * np.array(axis) / np.linalg.norm(axis))
        if "xyaxes" in attributes:
            x, y = np.reshape(numbers(attributes["xyaxes"], 6), (2, 3))
            x = x / np.linalg.norm(x)
            y = y - x * (x @ y)
            y /= np.linalg.norm(y)
            return Rotation.from_matrix(np.transpose([x, y, np.cross(x, y)]))
        if "zaxis" in attributes:
            return _from_z(np.array(numbers(attributes["zaxis"], 3)))
        if "euler" in attributes:
            whole = Rotation.identity()
            for letter, angle in zip(self.options.get("eulerseq", "xyz"), numbers(attributes["euler"], 3), strict=True):
                step = Rotation.from_euler(letter.lower(), unit * angle)
                whole = whole * step if letter.islower() else step * whole  # about axes that move along, or fixed ones
            return whole
        quaternion = np.array(numbers(attributes.get("quat", "1 0 0 0"), 4))
        return Rotation.from_quat(quaternion, scalar_first=True) if quaternion.any() else Rotation.identity()

    def weigh(self, geom: Any, place: Array, solid: bool = False) -> list[Piece]:
        """Return the part of a geometry in a frame (4, 4), with shells or all `solid`; none for one without mass."""
        attributes = self.attributes(geom, self.inherited(geom))
        kind, mesh = attributes.get("type", "sphere"), attributes.get("mesh")
        mass = number(attributes["mass"]) if "mass" in attributes else None
        density = number(attributes.get("density", "1000"))
        if kind in ("plane", "hfield") or mass == 0 or (mass is None and density == 0):
            return []
        pose, sizes = self.pose(attributes), numbers(attributes.get("size", ""))
        shell = is_true(attributes.get("shellinertia"))
        if mesh is not None:
            if kind != "mesh" or shell:
                raise NotRead(f"the mesh {mesh!r} of a geometry of type {kind!r}" + " that is a shell" * shell)
            vertices, faces, shell = self._mesh(mesh)
            shape: Any = [vertices, faces]
        elif kind in _HALF:
            if "fromto" in attributes:
                ends = np.reshape(numbers(attributes["fromto"], 6), (2, 3))
                pose = make_pose(ends.mean(axis=0), _from_z(ends[0] - ends[1]))
                sizes = [sizes[0]] * (len(_HALF[kind]) - 1) + [float(np.linalg.norm(ends[1] - ends[0]) / 2)]
            shape = np.multiply(sizes[: len(_HALF[kind])], _HALF[kind])
            shape = shape[0] if kind == "sphere" else shape
        else:
            raise NotRead(f"a geometry of type {kind!r}")
        self.shells |= shell
        # Parts of density 1 first: a mass comes before the density.
        (part,) = (_shell if shell and not solid else weigh)(kind, shape, place @ pose, 1.0)
        return [part.scale(density if mass is None else mass / part.mass)]

    def _mesh(self, name: str) -> tuple[Array, Array, bool]:
        """Return vertices and triangles of a mesh whose volume is known, and whether it is a shell."""
        for asset in self.root.iterfind("asset/mesh"):
            attributes = self.attributes(asset)
            if (attributes.get("name") or Path(attributes.get("file", "")).stem) == name:
                break
        else:
            raise NotRead(f"the mesh {name!r}")
        rules = attributes.get("inertia", "legacy")
        odd = {"refpos", "refquat", "builtin"} & set(attributes) or asset.find("plugin") is not None
        if odd or not ("file" in attributes or "vertex" in attributes):
            raise NotRead(f"the mesh {name!r}, which is generated or moved")
        if "file" in attributes:
            folder = self.options.get("meshdir", self.options.get("assetdir", ""))
            vertices, faces = load_mesh(self.path, "/".join(filter(None, [folder, attributes["file"]])), self.search)
        else:
            vertices = np.reshape(numbers(attributes["vertex"]), (-1, 3))
            faces = np.reshape(numbers(attributes.get("face")), (-1, 3)).astype(int)
        vertices = vertices * numbers(attributes.get("scale", "1 1 1"), 3)
        hull = ConvexHull(vertices)
        if "face" not in attributes and "file" not in attributes:
            faces = _outwards(hull)
        elif rules == "convex":
            vertices, faces = vertices, _outwards(hull)
        if rules == "shell":
            return vertices, faces, True
        if rules == "legacy" and weigh("mesh", [vertices, faces], np.eye(4), 1.0)[0].mass < hull.volume * (1 - _WHOLE):
            raise NotRead(f"the mesh {name!r}: it is not convex, and its volume depends on the version of MuJoCo")
        return vertices, faces, False


def _sizes(of: Attributes, own: Attributes) -> dict[str, str]:
    """Return the sizes of an element of a class, whose first ones it may replace."""
    words = own.get("size", "").split()
    return {"size": " ".join([*words, *of["size"].split()[len(words) :]])} if words and "size" in of else {}


def within(body: Any, *tags: str) -> list[Any]:
    """Return the elements of a body with some tags, and those in its frames."""
    found = []
    for child in body:
        if child.tag in tags:
            found.append(child)
        if child.tag == "frame":
            found += within(child, *tags)
    return found


def _outwards(hull: ConvexHull) -> Array:
    """Return the triangles (m, 3) of a convex hull, whose corners turn left as seen from outside."""
    corners = hull.points[hull.simplices]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inside_out = np.einsum("ni,ni->n", normals, hull.equations[:, :3]) < 0
    return np.where(inside_out[:, None], hull.simplices[:, ::-1], hull.simplices)


def read_mjcf(path: Path, search: Sequence[Path], reading: Reading) -> list[Link]:
    """Return the links of a file with one body in the world, in its axes. Raise `NotRead` and `BadInput`."""
    root, *_ = inline(path, search)
    document = Document(path, root, search)
    if generated := next(root.iter(*_GENERATED), None):
        raise NotRead(f"<{generated.tag}>")
    bodies = [body for world in root.findall("worldbody") for body in within(world, "body")]
    if len(bodies) != 1 or root.find("deformable") is not None:
        raise NotRead(f"{len(bodies)} bodies in the world, or flexible ones")
    default = document.options.get("alignfree", "false")
    if any(is_true(joint.get("align", default)) for joint in root.iter("freejoint", "joint")):
        reading.doubts.append("the axes of the body are its principal axes by an option of the file")
    links = _read_links(document, bodies[0], document.options)
    without = {
        name: _read_links(document, bodies[0], {key: value for key, value in document.options.items() if key != name})
        for name in OPTIONS
        if name in document.options
    }
    if document.shells:
        without["shellinertia"] = _read_links(document, bodies[0], document.options, solid=True)
    alone = {name: [replace(other, pose=np.eye(4)).part for other in others] for name, others in without.items()}
    return [replace(link, without={name: alone[name][k] for name in alone}) for k, link in enumerate(links)]


def _read_links(document: Document, root: Any, options: Attributes, solid: bool = False) -> list[Link]:
    """Return the links of a body with options of the compiler, with shells or all `solid`."""
    low, high = numbers(options.get("inertiagrouprange", "0 5"), 2)
    of_shapes = options.get("inertiafromgeom", "auto")

    def weigh_geoms(body: Any) -> Piece:
        parts = []
        for geom in within(body, "geom"):
            group = document.attributes(geom, document.inherited(geom)).get("group", "0")
            parts += document.weigh(geom, document.frame(geom, body), solid) if low <= number(group) <= high else []
        return join(parts)

    def read(body: Any, pose: Array) -> list[Link]:
        geometry, inertial = weigh_geoms(body), body.find("inertial")
        link = Link(pose, name=body.get("name", ""), geometry=geometry)
        if inertial is not None and of_shapes != "true":
            link = _inertial(document, inertial, link)
        elif of_shapes != "false":
            link = link.filled(geometry)
        moments, axes = np.linalg.eigh(link.inertia)
        raised = np.maximum(moments, number(options.get("boundinertia", "0")))
        if is_true(options.get("balanceinertia")) and raised[2] > raised[0] + raised[1]:
            raised[:] = raised.mean()
        link = link if (raised == moments).all() else replace(link, inertia=(axes * raised) @ axes.T)
        links = [replace(link, mass=max(link.mass, number(options.get("boundmass", "0"))))]
        for child in within(body, "body"):
            links += read(child, pose @ document.frame(child, body) @ document.pose(child.attrib))
        return links

    links = read(root, np.eye(4))
    if (total := number(options.get("settotalmass", "-1"))) > 0:
        factor = total / join_links(links).mass
        return [replace(k, mass=factor * k.mass, inertia=factor * k.inertia, geometry=k.geometry.scale(factor)) for k in links]
    return links


def _inertial(document: Document, inertial: Any, link: Link) -> Link:
    """Return a link with the mass and the inertia of <inertial>."""
    full = "fullinertia" in inertial.attrib
    moments = numbers(inertial.get("fullinertia", inertial.get("diaginertia")), 6 if full else 3)
    inertia = np.diag(moments[:3])
    if full:
        for value, (a, b) in zip(moments[3:], ((0, 1), (0, 2), (1, 2)), strict=True):
            inertia[a, b] = inertia[b, a] = value
    frame, mass = document.pose(inertial.attrib), number(inertial.get("mass", ""))
    return replace(link, mass=mass, frame=frame, inertia=inertia, rounding=rounding_of(moments))


def _shell(kind: str, sizes: Any, pose: Array, density: float) -> list[Piece]:
    """Return the surface of a shape as `weigh`, with a density in kg/m^2. MuJoCo approximates the shell of an ellipsoid."""
    # `second` is the integral of x x' over the surface, for a centroid at 0, as in `weigh`.
    centroid = np.zeros(3)
    if kind == "mesh":  # the integral over a triangle with corners a, b, c: area/12 (a a' + b b' + c c' + s s'), s = a + b + c
        corners = np.asarray(sizes[0], float)[np.asarray(sizes[1])]
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
        area, sums = areas.sum(), corners.sum(axis=1)
        centroid = areas @ sums / 3 / area
        second = (sums.T * areas) @ sums + np.einsum("n,nki,nkj->ij", areas, corners, corners)
        second = second / 12 - area * np.outer(centroid, centroid)
    elif kind == "sphere":
        area = 4 * math.pi * sizes**2
        second = area * sizes**2 / 3 * np.eye(3)
    elif kind == "box":
        sides = np.asarray(sizes)
        areas = 2 * np.prod(sides) / sides  # both faces normal to each axis
        area = areas.sum()
        second = np.diag((area / 12 + areas / 6) * sides**2)
    elif kind in ("cylinder", "capsule"):
        r, length = sizes
        side, end = 2 * math.pi * r * length, math.pi * r * r * (2 if kind == "capsule" else 1)
        area = side + 2 * end
        if kind == "capsule":  # the centroid of the surface of a half ball is at half of its radius
            across, along = 2 * end * r * r / 3, 2 * end * (length**2 / 4 + length * r / 2 + r * r / 3)
        else:
            across, along = 2 * end * r * r / 4, 2 * end * length**2 / 4
        second = np.diag([side * r * r / 2 + across] * 2 + [side * length**2 / 12 + along])
    else:
        raise NotRead(f"shellinertia='true' of a geometry of type {kind!r}")
    return [Piece(density * area, centroid, density * (np.trace(second) * np.eye(3) - second)).place(pose)]


def _from_z(z: Array) -> Rotation:
    """Return the smallest rotation that turns the third axis to z (3,)."""
    z = z / np.linalg.norm(z)
    axis = np.array([-z[1], z[0], 0.0])
    length = np.linalg.norm(axis)
    return Rotation.from_rotvec(axis / length * math.atan2(length, z[2]) if length else (math.pi * (z[2] < 0), 0, 0))
