"""Rigid bodies of USD files, twice: as usd-core computes them, and from the attributes by the rules of UsdPhysics.

usd-core opens the stage in both, after a look at what its layers refer to. Volumes of shapes are those of `weigh` in both; a
round shape whose scale differs by axis is an ellipsoid in one, as it is drawn, and has the largest scale in the other, as in
the schema's parser.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from conservative.attitude import Array
from conservative.errors import BadInput, require_extra

from .files import find, refuse
from .pieces import DENSITY, ONE, Link, Piece, Reading, join, make_pose, rounding_of, weigh

ASKS = {"newton": "newton", "mjc": "newton"}
"""Namespaces of attributes that ask an engine for something."""


def open_stage(path: Path, search: Sequence[Path] = ()) -> Any:
    """Return the stage of a file. Raise `BadInput` if it cannot be opened, or refers to a file outside the folders."""
    require_extra("a USD file", "models", "pxr")
    from pxr import Sdf, Tf, Usd, UsdGeom

    allowed = "a stage that usd-core opens, of layers in the folder of the file or in one of --search"

    def look(place: Path, seen: set[Path]) -> None:
        layer = Sdf.Layer.FindOrOpen(str(place))
        for name in layer.GetCompositionAssetDependencies() if layer else []:
            found = find(place, name, (path.parent, *search))
            if found not in seen:
                seen.add(found)
                look(found, seen)

    try:
        look(path, {path})
        stage = Usd.Stage.Open(str(path))
    except (Tf.ErrorException, ValueError) as error:
        raise refuse(path, f"an error ({' '.join(str(error).split())[:200]})", allowed) from None
    if not UsdGeom.StageHasAuthoredMetersPerUnit(stage):
        raise refuse(path, "no unit of length", "metersPerUnit in the metadata of the stage")
    return stage


@dataclass(frozen=True, eq=False)
class Stage:
    """A stage and its units. Poses are in m."""

    path: Path
    stage: Any

    @cached_property
    def metre(self) -> float:
        """One unit of length in m."""
        from pxr import UsdGeom

        return float(UsdGeom.GetStageMetersPerUnit(self.stage))

    @cached_property
    def kilogram(self) -> float:
        """One unit of mass in kg."""
        from pxr import UsdPhysics

        return float(UsdPhysics.GetStageKilogramsPerUnit(self.stage))

    @cached_property
    def bodies(self) -> list[Any]:
        """Prims of the enabled rigid bodies."""
        from pxr import UsdPhysics

        prims = [prim for prim in self.stage.Traverse() if prim.HasAPI(UsdPhysics.RigidBodyAPI)]
        return [prim for prim in prims if UsdPhysics.RigidBodyAPI(prim).GetRigidBodyEnabledAttr().Get() is not False]

    @cached_property
    def joints(self) -> list[Any]:
        """Prims of the joints."""
        from pxr import UsdPhysics

        return [prim for prim in self.stage.Traverse() if prim.IsA(UsdPhysics.Joint)]

    def pose(self, prim: Any) -> tuple[Array, Array]:
        """Return the pose (4, 4) of a prim, m, and its linear map (3, 3) in these axes, the scale. A body has no shear."""
        from pxr import UsdGeom

        world = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim)).T
        sizes = np.linalg.norm(world[:3, :3], axis=0)
        R = world[:3, :3] / sizes
        if np.abs(R.T @ R - np.eye(3)).max() > 1e-5 or np.linalg.det(R) < 0:
            u, _, vt = np.linalg.svd(world[:3, :3])
            R = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
        return make_pose(self.metre * world[:3, 3], R), R.T @ world[:3, :3]

    def colliders(self, body: Any) -> list[Any]:
        """Return the enabled colliders of a body, without those of bodies below it."""
        from pxr import Usd, UsdPhysics

        found, prims = [], iter(Usd.PrimRange(body))
        for prim in prims:
            if prim != body and prim.HasAPI(UsdPhysics.RigidBodyAPI):
                prims.PruneChildren()
            elif (
                prim.HasAPI(UsdPhysics.CollisionAPI)
                and UsdPhysics.CollisionAPI(prim).GetCollisionEnabledAttr().Get() is not False
            ):
                found.append(prim)
        return found

    def form(self, prim: Any, pose: Array, density: float, stay_round: bool = False) -> Piece:
        """Return the part of a collider after a map `pose` (4, 4), with lengths in the units of the stage before it.

        With `stay_round`, a round shape is scaled by the largest scale across its axis.
        """
        kind = prim.GetTypeName().lower()
        if kind == "mesh":
            points, counts, corners = (
                np.array(prim.GetAttribute(name).Get()) for name in ("points", "faceVertexCounts", "faceVertexIndices")
            )
            starts = np.cumsum(counts) - counts
            fans = [(s, s + k, s + k + 1) for s, count in zip(starts, counts, strict=True) for k in range(1, count - 1)]
            (part,) = weigh(kind, [points, corners[np.array(fans)]], pose, density)
            return part
        shapes = {"cube": ("box", "size"), "sphere": ("sphere", "radius")} | {
            each: (each, "radius", "height") for each in ("cylinder", "capsule", "cone")
        }
        if kind not in shapes:
            allowed = f"colliders whose volume is known: mesh, {', '.join(shapes)}"
            raise refuse(self.path, f"the collider {str(prim.GetPath())!r} of type {prim.GetTypeName()!r}", allowed)
        name, *keys = shapes[kind]
        sizes = [prim.GetAttribute(key).Get() for key in keys]
        axis = "XYZ".index(prim.GetAttribute("axis").Get()) if len(sizes) == 2 else 2
        turn = make_pose(R=np.roll(np.eye(3), axis - 2, axis=0))
        if stay_round and name != "box":
            scales = np.linalg.norm(pose[:3, :3], axis=0)
            across = np.arange(3) != (axis if len(sizes) == 2 else 3)
            sizes = list(np.multiply(sizes, [scales[across].max(), scales[axis]][: len(sizes)]))
            pose = pose @ np.diag([*1 / scales, 1])
        (part,) = weigh(name, sizes if len(sizes) == 2 else sizes[0], pose @ turn, density)
        return part


def compute(stage: Stage, body: Any) -> Piece:
    """Return the part that usd-core computes for a body, in the body's axes."""
    from pxr import Gf, UsdPhysics

    base, failed = np.linalg.inv(stage.pose(body)[0]), list[BadInput]()

    def weigh_collider(prim: Any) -> Any:
        info, (pose, scale) = UsdPhysics.RigidBodyAPI.MassInformation(), stage.pose(prim)
        place = base @ pose
        try:
            part = stage.form(prim, make_pose(R=scale), 1.0)
        except BadInput as error:
            failed.append(error)
            return info
        info.volume, info.centerOfMass, info.inertia = (
            part.mass,
            Gf.Vec3f(*part.com),
            Gf.Matrix3f(*part.inertia.ravel().tolist()),
        )
        q = Rotation.from_matrix(place[:3, :3]).as_quat(scalar_first=True).tolist()
        info.localPos, info.localRot = Gf.Vec3f(*(place[:3, 3] / stage.metre).tolist()), Gf.Quatf(*q)
        return info

    mass, moments, com, q = UsdPhysics.RigidBodyAPI(body).ComputeMassProperties(weigh_collider)
    if failed:
        raise failed[0]
    axes = Rotation.from_quat([*q.GetImaginary(), q.GetReal()]).as_matrix() if q.GetLength() > 1e-6 else np.eye(3)
    inertia = (axes * np.array(moments, float)) @ axes.T * stage.kilogram * stage.metre**2
    return Piece(mass * stage.kilogram, stage.metre * np.array(com, float), inertia)


def reference_usd(path: Path, search: Sequence[Path] = ()) -> Piece:
    """Return the body of a file by usd-core, in the axes of the first rigid body, whose scale is left out."""
    stage = Stage(path, open_stage(path, search))
    base = np.linalg.inv(stage.pose(stage.bodies[0])[0])
    return join(compute(stage, body).place(base @ stage.pose(body)[0]) for body in stage.bodies)


def read_usd(path: Path, search: Sequence[Path], reading: Reading) -> list[Link]:
    """Return the links of a file from its attributes, and note attributes that are not read.

    The inertia of shapes is not moved to a centre of mass that the file has for itself. OpenUSD moves it, Newton does not.
    """
    from pxr import UsdPhysics

    stage = Stage(path, open_stage(path, search))
    bodies, joints = stage.bodies, stage.joints
    if not bodies or len(joints) != len(bodies) - 1 or not all(joint.IsA(UsdPhysics.FixedJoint) for joint in joints):
        raise refuse(path, f"{len(bodies)} rigid bodies and the joints {[joint.GetName() for joint in joints]}", ONE)
    return [_link(stage, body, reading) for body in bodies]


def _link(stage: Stage, body: Any, reading: Reading) -> Link:
    forms = []
    pose, scale = stage.pose(body)
    colliders = stage.colliders(body)
    for prim in {body.GetPath(): body, **{each.GetPath(): each for each in colliders}}.values():
        for attribute in prim.GetAuthoredAttributes():
            space, colon, name = attribute.GetName().partition(":")
            if colon and space not in ("physics", "xformOp", "primvars", "material"):
                said = f"{prim.GetPath()}.{attribute.GetName()}"
                if space in ASKS:
                    reading.ask(ASKS[space], name, str(attribute.Get()).lower(), f"{said} = {attribute.Get()}")
                else:
                    reading.notes.append(f"{said} is an attribute of a vendor, which is not read here")
    mass, density, com, inertia = _authored(stage, body)
    moments = body.GetAttribute("physics:diagonalInertia").Get() if inertia is not None else ()
    rounding = rounding_of(map(np.float32, moments)) * stage.kilogram * stage.metre**2
    for prim in colliders:
        own, its_density, its_com, its_inertia = _authored(stage, prim) if prim != body else (None, None, None, None)
        place, its_scale = stage.pose(prim)
        place = np.linalg.inv(pose) @ place
        try:
            part = stage.form(
                prim,
                make_pose(R=stage.metre * its_scale),
                its_density or density or _of_material(stage, prim) or DENSITY,
                stay_round=True,
            )
        except BadInput:
            if mass and com is not None and inertia is not None:
                continue
            raise
        approximation = prim.GetAttribute("physics:approximation")
        wanted = approximation.Get() if approximation else None
        points = prim.GetAttribute("points").Get() if wanted == "convexHull" else None
        convex = points is not None and stage.form(prim, np.eye(4), 1.0).mass > ConvexHull(np.array(points)).volume * (1 - 1e-6)
        if wanted not in (None, "none") and not convex and not (own and its_inertia is not None):
            reading.doubts.append(f"{prim.GetPath()} asks for the approximation {wanted!r}, whose volume differs")
        part = part.scale(own / part.mass) if own else part
        centre = part.com if its_com is None else its_scale @ its_com
        forms.append(Piece(part.mass, centre, part.inertia if its_inertia is None else its_inertia).place(place))
    whole = join(forms)
    whole = whole.scale(mass / whole.mass) if mass and whole.mass else whole
    link = Link(pose, geometry=whole, name=str(body.GetPath())).filled(whole)
    if com is not None:
        link = replace(link, frame=make_pose(scale @ com))
    return replace(link, mass=mass or link.mass, inertia=link.inertia if inertia is None else inertia, rounding=rounding)


def _authored(stage: Stage, prim: Any) -> tuple[float | None, float | None, Array | None, Array | None]:
    """Return mass, density, centre of mass, unscaled, and inertia of a prim in SI units; None for what it does not have."""
    names = ("mass", "density", "centerOfMass", "diagonalInertia", "principalAxes")
    attributes = [prim.GetAttribute(f"physics:{name}") for name in names]
    mass, density, com, moments, q = (each.Get() if each and each.HasAuthoredValue() else None for each in attributes)
    inertia = None
    if moments and any(moments):
        axes = Rotation.from_quat([*q.GetImaginary(), q.GetReal()]).as_matrix() if q and q.GetLength() else np.eye(3)
        inertia = (axes * np.array(moments, float)) @ axes.T * stage.kilogram * stage.metre**2
    com = None if com is None or not np.isfinite(com).all() else stage.metre * np.array(com, float)
    return mass and mass * stage.kilogram, density and density * stage.kilogram / stage.metre**3, com, inertia


def _of_material(stage: Stage, prim: Any) -> float | None:
    from pxr import UsdShade

    bound, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")
    value = bound.GetPrim().GetAttribute("physics:density").Get() if bound else None
    return value and float(value) * stage.kilogram / stage.metre**3
