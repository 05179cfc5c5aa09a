"""Rigid bodies of USD files from their attributes, by the rules of UsdPhysics: the second reading.

usd-core composes the layers and returns the values of attributes and materials: there is no other implementation of that. Which
prims are bodies and colliders, poses, units and sums are computed here. The first reading is `reference.by_usd_core`.

A round shape whose scale differs by axis is an ellipsoid here, as it is drawn; usd-core's parser takes the largest scale.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from conservative.attitude import Array
from conservative.errors import BadInput

from .files import refuse
from .pieces import DENSITY, ONE, Link, Piece, Reading, join, make_pose, rounding_of, weigh

ASKS = {"newton": "newton", "mjc": "newton"}
"""Namespaces of attributes that ask an engine for something."""
_SHAPES = {"cube": ("box", "size"), "sphere": ("sphere", "radius")} | {
    name: (name, "radius", "height") for name in ("cylinder", "capsule", "cone")
}
_SKEW = 1e-5
"""Largest cosine between axes at right angles, which single precision leaves."""
_APART = 1e-4
"""Largest distance of the two frames of a fixed joint, relative to their distance from the origin, and of their axes."""


class Stage:
    """A stage with its units in m and kg, its enabled rigid bodies and its joints. Poses are in m.

    Raise `BadInput` if it has no unit of length. `files.guard_layers` opens it before.
    """

    def __init__(self, path: Path) -> None:
        from pxr import Usd, UsdPhysics

        self.path, self.physics, self.stage = path, UsdPhysics, Usd.Stage.Open(str(path))
        if not self.stage.HasAuthoredMetadata("metersPerUnit"):
            raise refuse(path, "no unit of length", "metersPerUnit in the metadata of the stage")
        self.metre = float(self.stage.GetMetadata("metersPerUnit"))
        kilogram = self.stage.GetMetadata("kilogramsPerUnit") if self.stage.HasAuthoredMetadata("kilogramsPerUnit") else 1.0
        self.kilogram = float(kilogram)
        prims = list(Usd.PrimRange.Stage(self.stage, Usd.TraverseInstanceProxies()))
        bodies = [prim for prim in prims if prim.HasAPI(UsdPhysics.RigidBodyAPI)]
        self.bodies = [prim for prim in bodies if self._on(prim, "physics:rigidBodyEnabled")]
        self.joints = [prim for prim in prims if prim.IsA(UsdPhysics.Joint) and self._on(prim, "physics:jointEnabled")]
        children = [target for prim in self.joints for target in UsdPhysics.Joint(prim).GetBody1Rel().GetTargets()]
        self.bodies.sort(key=lambda prim: prim.GetPath() in children)  # axes are the root's
        self._maps: dict[str, Array] = {}

    @staticmethod
    def _on(prim: Any, name: str) -> bool:
        return prim.GetAttribute(name).Get() is not False

    def map_of(self, prim: Any) -> Array:
        """Return the affine map (4, 4) from the space of a prim to that of the stage, in units of the stage."""
        key = str(prim.GetPath())
        if key not in self._maps:
            own, resets = _transform(prim)
            outer = np.eye(4) if resets or prim.IsPseudoRoot() else self.map_of(prim.GetParent())
            self._maps[key] = outer @ own
        return self._maps[key]

    def pose(self, prim: Any) -> tuple[Array, Array]:
        """Return the pose (4, 4) of a prim, m, and its linear map (3, 3) in the axes of the pose: the scale, and the shear.

        With A the linear map to the stage, the axes are sign(det A) A (A'A)^(-1/2), the axes that usd-core's parser has.
        """
        world = self.map_of(prim)
        A = world[:3, :3]
        squares, axes = np.linalg.eigh(A.T @ A)
        if not squares[0] > 1e-24 * squares[2]:
            raise refuse(self.path, f"the scale of {str(prim.GetPath())!r}, which is 0 along an axis", "a scale that is not 0")
        R = math.copysign(1.0, np.linalg.det(A)) * A @ (axes / np.sqrt(squares)) @ axes.T
        return make_pose(self.metre * world[:3, 3], R), R.T @ A

    def unclear(self, prim: Any, body: bool) -> str:
        """Return why the frame of a prim leaves its axes open; "" if it does not."""
        A = self.map_of(prim)[:3, :3]
        directions = A / np.linalg.norm(A, axis=0)
        if np.abs(directions.T @ directions - np.eye(3)).max() > _SKEW:
            return f"the frame of {prim.GetPath()} is sheared, and UsdPhysics has positions, rotations and scales only"
        if body and np.linalg.det(A) < 0:
            return f"the frame of {prim.GetPath()} is mirrored, and UsdPhysics does not say which axes the body has"
        return ""

    def colliders(self, body: Any) -> list[Any]:
        """Return the enabled colliders of a body, without the colliders of enabled bodies below it."""
        from pxr import Usd

        colliders, prims, api = [], iter(Usd.PrimRange(body, Usd.TraverseInstanceProxies())), self.physics.CollisionAPI
        for prim in prims:
            if prim != body and prim in self.bodies:
                prims.PruneChildren()
            elif prim.HasAPI(api) and self._on(prim, "physics:collisionEnabled"):
                colliders.append(prim)
        return colliders

    def form(self, prim: Any, pose: Array, density: float) -> Piece:
        """Return the part of a collider after a map `pose` (4, 4), with lengths in the units of the stage before it."""
        kind = prim.GetTypeName().lower()
        if kind == "mesh":
            points, triangles = _triangles(prim)
            if not np.linalg.det(points[triangles].astype(float)).sum():
                raise refuse(self.path, f"the collider {str(prim.GetPath())!r}, a mesh without a volume", "a closed mesh")
            return weigh(kind, [points, triangles], pose, density)[0]
        if kind not in _SHAPES:
            allowed = f"colliders whose volume is known: mesh, {', '.join(_SHAPES)}"
            raise refuse(self.path, f"the collider {str(prim.GetPath())!r} of type {prim.GetTypeName()!r}", allowed)
        name, *keys = _SHAPES[kind]
        sizes = [prim.GetAttribute(key).Get() for key in keys]
        axis = "XYZ".index(prim.GetAttribute("axis").Get()) if len(sizes) == 2 else 2
        turn = make_pose(R=np.roll(np.eye(3), axis - 2, axis=0))
        return weigh(name, sizes if len(sizes) == 2 else sizes[0], pose @ turn, density)[0]

    def tensor(self, moments: Any, q: Any) -> Array:
        """Return an inertia (3, 3), kg m^2, from moments in units of the stage and the quaternion of their axes."""
        # The default of USD, (0, 0, 0, 0), stands for no axes.
        axes = Rotation.from_quat([*q.GetImaginary(), q.GetReal()]).as_matrix() if q and q.GetLength() > 1e-6 else np.eye(3)
        return (axes * np.array(moments, float)) @ axes.T * self.kilogram * self.metre**2

    def authored(self, prim: Any) -> tuple[float | None, float | None, Array | None, Array | None]:
        """Return mass, density, centre of mass, unscaled, and inertia of a prim in SI units; None for a missing one.

        A density that is not positive is not one, by OpenUSD. Nor is such a mass, if the body has colliders. Without MassAPI
        the attributes do not count.
        """
        if not prim.HasAPI(self.physics.MassAPI):
            return None, None, None, None
        names = ("mass", "density", "centerOfMass", "diagonalInertia", "principalAxes")
        attributes = [prim.GetAttribute(f"physics:{name}") for name in names]
        mass, density, com, moments, q = (
            attribute.Get() if attribute and attribute.HasAuthoredValue() else None for attribute in attributes
        )
        com = None if com is None or not np.isfinite(com).all() else self.metre * np.array(com, float)
        inertia = self.tensor(moments, q) if moments and any(moments) else None
        density = density * self.kilogram / self.metre**3 if density and density > 0 else None
        return mass and mass * self.kilogram, density, com, inertia

    def density_of_material(self, prim: Any) -> float | None:
        """Return the density of the material that is bound to a prim, kg/m^3, or None."""
        from pxr import UsdShade

        bound, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")
        if not bound or not bound.GetPrim().HasAPI(self.physics.MaterialAPI):
            return None
        value = bound.GetPrim().GetAttribute("physics:density").Get()
        return float(value) * self.kilogram / self.metre**3 if value and value > 0 else None

    def apart(self, joint: Any) -> str:
        """Return why a fixed joint leaves the poses of its bodies open; "" if its frames coincide, as far as it has both."""
        frames = []
        for number in (0, 1):
            targets = joint.GetRelationship(f"physics:body{number}").GetTargets()
            place, q = (joint.GetAttribute(f"physics:local{name}{number}") for name in ("Pos", "Rot"))
            prim = self.stage.GetPrimAtPath(targets[0]) if targets else None
            if not prim or not (place.HasAuthoredValue() or q.HasAuthoredValue()):
                return ""
            pose, scale = self.pose(prim)
            turn = Rotation.from_quat([*q.Get().GetImaginary(), q.Get().GetReal()]) if q.Get().GetLength() else None
            frames.append(pose @ make_pose(scale @ (self.metre * np.array(place.Get(), float)), turn))
        away = np.linalg.norm(frames[1][:3, 3] - frames[0][:3, 3])
        size = max(np.linalg.norm(frame[:3, 3] - frames[0][:3, 3]) for frame in (*frames, np.eye(4))) or 1.0
        if away < _APART * size and np.abs(frames[0][:3, :3] - frames[1][:3, :3]).max() < _APART:
            return ""
        return f"the frames of {joint.GetPath()} in its two bodies are apart, so that the poses of the bodies are not clear"


def _transform(prim: Any) -> tuple[Array, bool]:
    """Return the map (4, 4) of a prim to its parent from its operations, and whether the maps of its parents are left out.

    The first operation of `xformOpOrder` is the outermost. `!invert!` stands for the inverse.
    """
    order = prim.GetAttribute("xformOpOrder").Get() if prim.GetAttribute("xformOpOrder") else None
    names, whole = list(order or ()), np.eye(4)
    resets = "!resetXformStack!" in names
    if resets:  # what is before it does not count
        names = names[len(names) - names[::-1].index("!resetXformStack!") :]
    for name in names:
        plain = name.removeprefix("!invert!")
        value = prim.GetAttribute(plain).Get()
        if value is None:
            continue
        T = _operation(plain.split(":")[1], value)
        whole = whole @ (np.linalg.inv(T) if plain != name else T)
    return whole, resets


def _operation(kind: str, value: Any) -> Array:
    """Return the map (4, 4) of an operation of `xformOpOrder`.

    "rotateZXY" turns about fixed axes, Z first, by angles in degrees, which are always in the order X, Y, Z.
    """
    if kind == "transform":
        return np.array(value, float).T  # USD multiplies rows from the left
    if kind == "orient":
        q = np.array([*value.GetImaginary(), value.GetReal()], float)
        return make_pose(R=Rotation.from_quat(q) if q.any() else None)
    if kind.startswith("rotate"):
        letters = kind.removeprefix("rotate")
        angles = np.array(value, float)[["XYZ".index(letter) for letter in letters]] if len(letters) == 3 else float(value)
        return make_pose(R=Rotation.from_euler(letters.lower(), angles, degrees=True))
    axis = kind[-1] if kind[-1] in "XYZ" else ""
    numbers = np.full(3, 1.0 if kind.startswith("scale") else 0.0)
    numbers["XYZ".index(axis) if axis else slice(None)] = np.array(value, float)
    if kind.removesuffix(axis) == "scale":
        return np.diag([*numbers, 1.0])
    if kind.removesuffix(axis) == "translate":
        return make_pose(numbers)
    raise ValueError(f"an operation {kind}")


def _triangles(prim: Any) -> tuple[Array, Array]:
    """Return the vertices (n, 3) and triangles (m, 3) of a mesh."""
    names = ("points", "faceVertexCounts", "faceVertexIndices")
    points, counts, corners = (np.array(prim.GetAttribute(name).Get()) for name in names)
    starts = np.cumsum(counts) - counts
    fans = [(s, s + k, s + k + 1) for s, count in zip(starts, counts, strict=True) for k in range(1, count - 1)]
    return points, corners[np.array(fans)]


def _open_volume(stage: Stage, prim: Any) -> str:
    """Return why the schema leaves the volume of a mesh open; "" for a closed convex one and for other shapes."""
    if prim.GetTypeName() != "Mesh":
        return ""
    points, triangles = _triangles(prim)
    # Every side of a closed surface is there once in each direction, by the places of its ends.
    places = np.unique(points, axis=0, return_inverse=True)[1].ravel()[triangles]
    sides = Counter((int(face[k]), int(face[(k + 1) % 3])) for face in places for k in range(3))
    sides = Counter({side: count for side, count in sides.items() if side[0] != side[1]})
    if any(sides[b, a] != count for (a, b), count in list(sides.items())):
        return f"{prim.GetPath()} is a mesh that is not closed, so its volume is not defined"
    approximation = prim.GetAttribute("physics:approximation")
    wanted = (approximation.Get() if prim.HasAPI(stage.physics.MeshCollisionAPI) else None) or "none"
    try:
        convex = stage.form(prim, np.eye(4), 1.0).mass > ConvexHull(points).volume * (1 - 1e-6)
    except ValueError:  # it is flat
        convex = False
    if convex and wanted in ("none", "convexHull", "convexDecomposition"):
        return ""
    if wanted != "none":
        return f"{prim.GetPath()} asks for the approximation {wanted!r}, whose volume differs"
    return f"{prim.GetPath()} is a mesh that is not convex, and UsdPhysics leaves its volume to engines"


def read_usd(path: Path, search: Sequence[Path], reading: Reading) -> list[Link]:
    """Return the links of a file from its attributes, and note attributes that are not read.

    The inertia of shapes is not moved to a centre of mass that the file has for itself. OpenUSD moves it, Newton does not.
    """
    stage = Stage(path)
    bodies, joints = stage.bodies, stage.joints
    if not bodies or len(joints) != len(bodies) - 1 or not all(joint.IsA(stage.physics.FixedJoint) for joint in joints):
        raise refuse(path, f"{len(bodies)} rigid bodies and the joints {[joint.GetName() for joint in joints]}", ONE)
    reading.doubts.extend(filter(None, map(stage.apart, joints)))
    return [link_of(stage, body, reading) for body in bodies]


def link_of(stage: Stage, body: Any, reading: Reading) -> Link:
    """Return mass and inertia of a body by its attributes and its colliders. Raise `BadInput` for an unknown volume."""
    forms, (pose, scale), colliders = [], stage.pose(body), stage.colliders(body)
    for attribute in [authored for prim in dict.fromkeys([body, *colliders]) for authored in prim.GetAuthoredAttributes()]:
        space, colon, name = attribute.GetName().partition(":")
        if colon and space in ASKS:
            text = f"{attribute.GetPath()} = {attribute.Get()}"
            reading.ask(ASKS[space], name, str(attribute.Get()).lower(), text)
        elif colon and space not in ("physics", "xformOp", "primvars", "material"):
            reading.notes.append(f"{attribute.GetPath()} is an attribute of a vendor, which is not read here")
    for name in ("kinematicEnabled", "startsAsleep"):
        if (held := body.GetAttribute(f"physics:{name}")) and held.Get():
            reading.doubts.append(f"{held.GetPath()} is true, so that forces do not move the body")
    mass, density, com, inertia = stage.authored(body)
    moments = () if inertia is None else body.GetAttribute("physics:diagonalInertia").Get()
    complete = mass and mass > 0 and com is not None and inertia is not None
    doubts = [stage.unclear(body, True)]
    for prim in colliders:
        own, its_density, its_com, its_inertia = (None,) * 4 if prim == body else stage.authored(prim)
        place, its_scale = stage.pose(prim)
        heavy = its_density or density or stage.density_of_material(prim) or DENSITY
        try:
            part = stage.form(prim, make_pose(R=stage.metre * its_scale), heavy)
        except BadInput:
            if complete:
                continue
            raise
        if not complete:
            doubts.append(stage.unclear(prim, False))
        if not complete and not (own and own > 0 and its_inertia is not None and its_com is not None):
            doubts.append(_open_volume(stage, prim))
        part = part.scale(own / part.mass) if own and own > 0 else part
        centre = part.com if its_com is None else its_scale @ its_com
        tensor = part.inertia if its_inertia is None else its_inertia
        forms.append(Piece(part.mass, centre, tensor).place(np.linalg.inv(pose) @ place))
    reading.doubts.extend(dict.fromkeys(filter(None, doubts)))
    whole = join(forms)
    mass = None if whole.mass and mass and mass < 0 else mass
    whole = whole.scale(mass / whole.mass) if mass and whole.mass else whole
    link = Link(pose, geometry=whole, name=str(body.GetPath())).filled(whole)
    frame = link.frame if com is None else make_pose(scale @ com)
    rounding = rounding_of(map(np.float32, moments)) * stage.kilogram * stage.metre**2
    tensor = link.inertia if inertia is None else inertia
    return replace(link, mass=mass or link.mass, frame=frame, inertia=tensor, rounding=rounding)
