"""Rigid bodies of USD files, twice: as usd-core computes them, and from the attributes by the rules of UsdPhysics.

usd-core opens the stage in both, after a look at the references of its layers. Volumes of shapes are from `weigh` in both; a
round shape whose scale differs by axis is an ellipsoid in one, as it is drawn, and has the largest scale in the other, as in
the schema's parser.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
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
_SHAPES = {"cube": ("box", "size"), "sphere": ("sphere", "radius")} | {
    name: (name, "radius", "height") for name in ("cylinder", "capsule", "cone")
}


class Stage:
    """A stage with its units in m and kg, its enabled rigid bodies and its joints. Poses are in m.

    Raise `BadInput` if it cannot be opened, has no unit of length, or refers to a file outside the folders.
    """

    def __init__(self, path: Path, search: Sequence[Path] = ()) -> None:
        require_extra("a USD file", "models", "pxr")
        from pxr import Sdf, Tf, Usd, UsdGeom, UsdPhysics

        def look(place: Path, seen: set[Path]) -> None:
            layer = Sdf.Layer.FindOrOpen(str(place))
            for name in filter(None, layer.GetCompositionAssetDependencies() if layer else []):  # none within the file
                file = find(place, name, (path.parent, *search))
                if file not in seen:
                    seen.add(file)
                    look(file, seen)

        self.path, self.physics = path, UsdPhysics
        try:
            look(path, {path})
            self.stage = Usd.Stage.Open(str(path))
        except (Tf.ErrorException, ValueError) as error:
            allowed = "a stage that usd-core opens, of layers in the folder of the file or in one of --search"
            raise refuse(path, f"an error ({' '.join(str(error).split())[:200]})", allowed) from None
        if not UsdGeom.StageHasAuthoredMetersPerUnit(self.stage):
            raise refuse(path, "no unit of length", "metersPerUnit in the metadata of the stage")
        self.metre = float(UsdGeom.GetStageMetersPerUnit(self.stage))
        self.kilogram = float(UsdPhysics.GetStageKilogramsPerUnit(self.stage))
        prims = list(Usd.PrimRange.Stage(self.stage, Usd.TraverseInstanceProxies()))
        apis = [(prim, UsdPhysics.RigidBodyAPI(prim)) for prim in prims if prim.HasAPI(UsdPhysics.RigidBodyAPI)]
        self.bodies = [prim for prim, api in apis if api.GetRigidBodyEnabledAttr().Get() is not False]
        joints = [prim for prim in prims if prim.IsA(UsdPhysics.Joint)]
        self.joints = [prim for prim in joints if UsdPhysics.Joint(prim).GetJointEnabledAttr().Get() is not False]
        children = [target for prim in self.joints for target in UsdPhysics.Joint(prim).GetBody1Rel().GetTargets()]
        self.bodies.sort(key=lambda prim: prim.GetPath() in children)  # axes are the root's

    def pose(self, prim: Any) -> tuple[Array, Array]:
        """Return the pose (4, 4) of a prim, m, and its linear map (3, 3) in these axes, the scale. A body has no shear."""
        from pxr import UsdGeom

        world = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim)).T
        R = world[:3, :3] / np.linalg.norm(world[:3, :3], axis=0)
        # Sheared or mirrored axes: the nearest rotation.
        if np.abs(R.T @ R - np.eye(3)).max() > 1e-5 or np.linalg.det(R) < 0:
            u, _, vt = np.linalg.svd(world[:3, :3])
            R = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
        return make_pose(self.metre * world[:3, 3], R), R.T @ world[:3, :3]

    def colliders(self, body: Any) -> list[Any]:
        """Return the enabled colliders of a body, without the colliders of enabled bodies below it."""
        from pxr import Usd

        colliders, prims, api = [], iter(Usd.PrimRange(body, Usd.TraverseInstanceProxies())), self.physics.CollisionAPI
        for prim in prims:
            if prim != body and prim in self.bodies:
                prims.PruneChildren()
            elif prim.HasAPI(api) and api(prim).GetCollisionEnabledAttr().Get() is not False:
                colliders.append(prim)
        return colliders

    def form(self, prim: Any, pose: Array, density: float, stay_round: bool = False) -> Piece:
        """Return the part of a collider after a map `pose` (4, 4), with lengths in the units of the stage before it.

        With `stay_round`, a round shape is scaled by the largest scale across its axis.
        """
        kind = prim.GetTypeName().lower()
        if kind == "mesh":
            names = ("points", "faceVertexCounts", "faceVertexIndices")
            points, counts, corners = (np.array(prim.GetAttribute(name).Get()) for name in names)
            starts = np.cumsum(counts) - counts
            fans = [(s, s + k, s + k + 1) for s, count in zip(starts, counts, strict=True) for k in range(1, count - 1)]
            return weigh(kind, [points, corners[np.array(fans)]], pose, density)[0]
        if kind not in _SHAPES:
            allowed = f"colliders whose volume is known: mesh, {', '.join(_SHAPES)}"
            raise refuse(self.path, f"the collider {str(prim.GetPath())!r} of type {prim.GetTypeName()!r}", allowed)
        name, *keys = _SHAPES[kind]
        sizes = [prim.GetAttribute(key).Get() for key in keys]
        axis = "XYZ".index(prim.GetAttribute("axis").Get()) if len(sizes) == 2 else 2
        if stay_round and name != "box":
            scales = np.linalg.norm(pose[:3, :3], axis=0)
            across = np.arange(3) != (axis if len(sizes) == 2 else 3)
            sizes = list(np.multiply(sizes, [scales[across].max(), scales[axis]][: len(sizes)]))
            pose = pose @ np.diag([*1 / scales, 1])
        turn = make_pose(R=np.roll(np.eye(3), axis - 2, axis=0))
        return weigh(name, sizes if len(sizes) == 2 else sizes[0], pose @ turn, density)[0]

    def tensor(self, moments: Any, q: Any) -> Array:
        """Return an inertia (3, 3), kg m^2, from moments in units of the stage and the quaternion of their axes."""
        # The default of USD, (0, 0, 0, 0), stands for no axes.
        axes = Rotation.from_quat([*q.GetImaginary(), q.GetReal()]).as_matrix() if q and q.GetLength() > 1e-6 else np.eye(3)
        return (axes * np.array(moments, float)) @ axes.T * self.kilogram * self.metre**2

    def authored(self, prim: Any) -> tuple[float | None, float | None, Array | None, Array | None]:
        """Return mass, density, centre of mass, unscaled, and inertia of a prim in SI units; None for a missing one.

        A density that is not positive is not one, by OpenUSD. Nor is such a mass, if the body has colliders.
        """
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
        value = bound.GetPrim().GetAttribute("physics:density").Get() if bound else None
        return value and float(value) * self.kilogram / self.metre**3


def reference_usd(path: Path, search: Sequence[Path] = ()) -> Piece:
    """Return the body of a file by usd-core, in the axes of the first rigid body, whose scale is left out."""
    stage = Stage(path, search)
    base = np.linalg.inv(stage.pose(stage.bodies[0])[0])
    return join(_compute(stage, body).place(base @ stage.pose(body)[0]) for body in stage.bodies)


def _compute(stage: Stage, body: Any) -> Piece:
    """Return the part that usd-core computes for a body, in the body's axes."""
    from pxr import Gf

    base, failed, api = np.linalg.inv(stage.pose(body)[0]), list[BadInput](), stage.physics.RigidBodyAPI

    def weigh_collider(prim: Any) -> Any:
        info, (pose, scale) = api.MassInformation(), stage.pose(prim)
        place = base @ pose
        try:
            part = stage.form(prim, make_pose(R=scale), 1.0)
        except BadInput as error:
            failed.append(error)
            return info
        info.volume, info.centerOfMass = part.mass, Gf.Vec3f(*part.com)
        info.inertia = Gf.Matrix3f(*part.inertia.ravel().tolist())
        q = Rotation.from_matrix(place[:3, :3]).as_quat(scalar_first=True).tolist()
        info.localPos, info.localRot = Gf.Vec3f(*(place[:3, 3] / stage.metre).tolist()), Gf.Quatf(*q)
        return info

    mass, moments, com, q = api(body).ComputeMassProperties(weigh_collider)
    if failed:
        raise failed[0]
    axes = body.GetAttribute("physics:principalAxes")
    if stage.authored(body)[3] is not None and not (axes and axes.HasAuthoredValue()):
        q = None  # usd-core returns memory that it has not written
    return Piece(mass * stage.kilogram, stage.metre * np.array(com, float), stage.tensor(moments, q))


def read_usd(path: Path, search: Sequence[Path], reading: Reading) -> list[Link]:
    """Return the links of a file from its attributes, and note attributes that are not read.

    The inertia of shapes is not moved to a centre of mass that the file has for itself. OpenUSD moves it, Newton does not.
    """
    stage = Stage(path, search)
    bodies, joints = stage.bodies, stage.joints
    if not bodies or len(joints) != len(bodies) - 1 or not all(joint.IsA(stage.physics.FixedJoint) for joint in joints):
        raise refuse(path, f"{len(bodies)} rigid bodies and the joints {[joint.GetName() for joint in joints]}", ONE)
    return [_link(stage, body, reading) for body in bodies]


def _link(stage: Stage, body: Any, reading: Reading) -> Link:
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
    for prim in colliders:
        own, its_density, its_com, its_inertia = (None,) * 4 if prim == body else stage.authored(prim)
        place, its_scale = stage.pose(prim)
        heavy = its_density or density or stage.density_of_material(prim) or DENSITY
        try:
            part = stage.form(prim, make_pose(R=stage.metre * its_scale), heavy, stay_round=True)
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
        part = part.scale(own / part.mass) if own and own > 0 else part
        centre = part.com if its_com is None else its_scale @ its_com
        tensor = part.inertia if its_inertia is None else its_inertia
        forms.append(Piece(part.mass, centre, tensor).place(np.linalg.inv(pose) @ place))
    whole = join(forms)
    mass = None if whole.mass and mass and mass < 0 else mass
    whole = whole.scale(mass / whole.mass) if mass and whole.mass else whole
    link = Link(pose, geometry=whole, name=str(body.GetPath())).filled(whole)
    frame = link.frame if com is None else make_pose(scale @ com)
    rounding = rounding_of(map(np.float32, moments)) * stage.kilogram * stage.metre**2
    tensor = link.inertia if inertia is None else inertia
    return replace(link, mass=mass or link.mass, frame=frame, inertia=tensor, rounding=rounding)
