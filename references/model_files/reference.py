"""The reference readings of model files: the body by the implementation of its format. SDF is read by libsdformat in Drake.

Nothing here uses a function of this package outside this file, and the second readings (`description`, `mjcf`, `usd`) use
nothing of this file. A test traces both. The files that a model refers to are checked before (`robots.split`).

* URDF: urdfdom in Pinocchio, which adds up fixed links.
* MJCF: MuJoCo parses and compiles the file. The sum over fixed bodies is computed here.
* USD: usd-core opens the stage, finds bodies, joints and colliders with their sizes and poses (`UsdPhysics`, `UsdGeom`, `Gf`),
  and adds up the mass (`ComputeMassProperties`). It has no volumes: volumes of shapes are computed here by quadrature over
  slices, and volumes of meshes by trimesh.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from conservative.attitude import Array

from .pieces import Piece


class Refused(Exception):
    """The implementation of a format does not read a file. The message is a part of a sentence."""


def by_urdfdom(path: Path) -> tuple[Piece, list[str]]:
    """Return the body of a URDF file with one body, and no warnings. Raise `Refused`."""
    import pinocchio as pin

    try:
        model = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
    except ValueError as error:
        raise Refused(f"an error ({' '.join(str(error).split())})") from None
    bodies = [inertia for inertia in model.inertias if inertia.mass]
    if len(bodies) != 1:
        raise Refused(f"{len(bodies)} bodies that have a mass")
    return Piece(bodies[0].mass, np.array(bodies[0].lever), np.array(bodies[0].inertia)), []


def by_mujoco(path: Path) -> tuple[Piece, list[str]]:
    """Return the body that MuJoCo compiles of a file with one free body, in its axes, and the warnings. Raise `Refused`."""
    import mujoco

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            if path.suffix == ".xml":
                spec = mujoco.MjSpec.from_file(str(path))
            else:  # it does not take other names
                text = path.read_text()
                spec = mujoco.MjSpec.from_string(text, include=_included(text, path.parent))
                spec.modelfiledir = str(path.parent)
            for part in (spec.compiler, *spec.joints):  # the body keeps the axes of the file
                for name in {"align", "alignfree"}.intersection(dir(part)):
                    setattr(part, name, 0)
            model = spec.compile()
        except (ValueError, mujoco.FatalError) as error:
            raise Refused(f"an error ({' '.join(str(error).removeprefix('Error: ').split())})") from None
    if model.njnt > (model.nq == 7):
        raise Refused(f"the joint {model.jnt(model.njnt - 1).name!r}, which moves")
    if (roots := (model.body_parentid[1:] == 0).sum()) != 1:
        raise Refused(f"{roots} bodies in the world")
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    base = data.xmat[1].reshape(3, 3)
    turned = [base.T @ data.ximat[k].reshape(3, 3) for k in range(1, model.nbody)]
    tensors = [(R * moments) @ R.T for R, moments in zip(turned, model.body_inertia[1:], strict=True)]
    part = add_up(model.body_mass[1:], (data.xipos[1:] - data.xpos[1]) @ base, tensors)
    return part, [f"MuJoCo warns: {warning.message}" for warning in caught]


def _included(text: str, folder: Path) -> dict[str, bytes]:
    """Return the content of the files that a text of MJCF includes, and of those that they include, by name."""
    files: dict[str, bytes] = {}
    for name in re.findall(r"""<include\s+file\s*=\s*["']([^"']*)["']""", text):
        data = (folder / name).read_bytes()
        files |= {name: data, **_included(data.decode(), folder)}
    return files


def add_up(masses: Any, centres: Any, tensors: Any) -> Piece:
    """Return the whole of parts in the same axes, from masses (n,), centres of mass (n, 3) and inertias about them (n, 3, 3).

    The second moments C = tr(J)/2 1 - J of parts add up, each with m d d' for its distance d from the common centre.
    """
    masses, centres, tensors = np.array(masses, float), np.array(centres, float), np.array(tensors, float)
    mass = masses.sum()
    com = masses @ centres / (mass or 1.0)
    away = centres - com
    second = np.einsum("nii->", tensors) / 2 * np.eye(3) - tensors.sum(axis=0) + (away.T * masses) @ away
    return Piece(float(mass), com, np.trace(second) * np.eye(3) - second)


def by_usd_core(path: Path) -> tuple[Piece, list[str]]:
    """Return the body of a USD file in the axes of its root, without their scale, and no warnings. Raise `Refused`.

    A frame without shear and reflection is a rotation and a scale by axis. Any other one is what usd-core's parser makes of it:
    `Gf.Transform` takes the orthogonal factor of the polar decomposition, with the sign that makes it a rotation.
    """
    from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdPhysics

    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        raise Refused(f"an error ({' '.join(str(error).split())[:200]})") from None
    metre, kilogram = UsdGeom.GetStageMetersPerUnit(stage), UsdPhysics.GetStageKilogramsPerUnit(stage)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the newer name is not in all versions
        found = UsdPhysics.LoadUsdPhysicsFromRange(stage, [Sdf.Path.absoluteRootPath])
    described = {str(path): desc for paths, descs in found.values() for path, desc in zip(paths, descs, strict=True)}
    bodies = [desc for desc in described.values() if desc.type == UsdPhysics.ObjectType.RigidBody and desc.rigidBodyEnabled]
    joints = [desc for desc in described.values() if desc.type == UsdPhysics.ObjectType.FixedJoint and desc.jointEnabled]
    children = {joint.body1 for joint in joints}
    bodies.sort(key=lambda desc: desc.primPath in children)
    if not bodies:
        raise Refused("no rigid body")
    cache, parts, refusals = UsdGeom.XformCache(), [], []
    for body in bodies:
        prim, used = stage.GetPrimAtPath(body.primPath), list[Any]()

        def weigh_collider(collider: Any, used: list[Any] = used) -> Any:
            info = UsdPhysics.RigidBodyAPI.MassInformation()
            used.append(collider)
            try:
                desc = described[str(collider.GetPath())]
                volume, centre, inertia = _weigh(desc, collider)
            except (Refused, KeyError) as error:
                refusals.append(str(error) if isinstance(error, Refused) else f"the collider {error} of an unknown type")
                info.volume = -1.0
                return info
            info.volume, info.centerOfMass, info.inertia = volume, Gf.Vec3f(*centre), Gf.Matrix3f(*inertia.ravel().tolist())
            info.localPos, info.localRot = desc.localPos, desc.localRot
            return info

        mass, moments, com, q = UsdPhysics.RigidBodyAPI(prim).ComputeMassProperties(weigh_collider)
        if refusals:
            raise Refused(refusals[0])
        given = UsdPhysics.MassAPI(prim).GetPrincipalAxesAttr()
        if not used and not (given and given.HasAuthoredValue() and given.Get().GetLength()):
            q = Gf.Quatf(1)  # usd-core returns memory that it has not written
        place = Gf.Transform(cache.GetLocalToWorldTransform(prim))
        # Gf multiplies rows from the left, so its matrices are transposed.
        axes = np.array(Gf.Matrix3d(Gf.Quatd(q).GetNormalized() if Gf.Quatd(q).GetLength() > 1e-6 else Gf.Quatd(1))).T
        R = np.array(Gf.Matrix3d(place.GetRotation())).T
        tensor = (axes * np.array(moments, float)) @ axes.T
        parts.append((mass, np.array(place.GetTranslation()), R, np.array(com, float), tensor))
    _, origin, base, _, _ = parts[0]
    whole = add_up(
        [mass for mass, *_ in parts],
        [base.T @ (place + R @ com - origin) for _, place, R, com, _ in parts],
        [base.T @ R @ tensor @ R.T @ base for _, _, R, _, tensor in parts],
    )
    return Piece(whole.mass * kilogram, whole.com * metre, whole.inertia * kilogram * metre**2), []


def _weigh(desc: Any, prim: Any) -> tuple[float, Array, Array]:
    """Return volume, centroid (3,) and inertia (3, 3) about it, at density 1, of a collider that usd-core describes."""
    from pxr import UsdPhysics

    kinds, kind = UsdPhysics.ObjectType, desc.type
    if kind == kinds.MeshShape:
        return _weigh_mesh(np.array(prim.GetAttribute("points").Get()) * np.array(desc.meshScale, float), prim)
    if kind == kinds.CubeShape:
        a, b, c = np.abs(desc.halfExtents)
        return _stack(c, lambda z: (a + 0 * z, b + 0 * z), rectangles=True)
    if kind == kinds.SphereShape:
        return _stack(desc.radius, lambda z: 2 * (np.sqrt(np.maximum(desc.radius**2 - z * z, 0)),))
    if kind not in (kinds.CylinderShape, kinds.CapsuleShape, kinds.ConeShape):
        raise Refused(f"the collider {str(prim.GetPath())!r} of type {prim.GetTypeName()!r}")
    r, h = desc.radius, desc.halfHeight
    if kind == kinds.CylinderShape:
        volume, centre, inertia = _stack(h, lambda z: 2 * (r + 0 * z,))
    elif kind == kinds.ConeShape:
        volume, centre, inertia = _stack(h, lambda z: 2 * (r * (h - z) / (2 * h),))
    else:
        volume, centre, inertia = _stack(
            h + r, lambda z: 2 * (np.sqrt(np.maximum(r * r - np.maximum(np.abs(z) - h, 0) ** 2, 0)),), breaks=(-h, h)
        )
    order = {"X": (2, 0, 1), "Y": (1, 2, 0), "Z": (0, 1, 2)}[prim.GetAttribute("axis").Get()]  # z becomes the axis of the shape
    return volume, centre[list(order)], inertia[np.ix_(order, order)]


def _stack(
    half: float,
    widths: Callable[[Array], tuple[Array, ...]],
    rectangles: bool = False,
    breaks: tuple[float, ...] = (),
) -> tuple[float, Array, Array]:
    """Return volume, centroid and inertia of a stack of slices between -half and half along z.

    Slices are ellipses, or rectangles, with two half widths at z. The integrands are polynomials of a degree up to 4 between
    the `breaks`, so the quadrature is exact.
    """
    nodes, weights = np.polynomial.legendre.leggauss(8)
    edges = [-half, *breaks, half]
    z = np.concatenate([(low + high) / 2 + (high - low) / 2 * nodes for low, high in pairwise(edges)])
    w = np.concatenate([(high - low) / 2 * weights for low, high in pairwise(edges)])
    area, share = (4, 3) if rectangles else (np.pi, 4)
    a, b = widths(z)
    dV = w * area * a * b
    volume = dV.sum()
    centre = (dV * z).sum() / volume
    xx, yy, zz = (dV * a**2 / share).sum(), (dV * b**2 / share).sum(), (dV * (z - centre) ** 2).sum()
    return volume, np.array([0, 0, centre]), np.diag([yy + zz, xx + zz, xx + yy])


def _weigh_mesh(points: Array, prim: Any) -> tuple[float, Array, Array]:
    """Return volume, centroid and inertia of the mesh of a prim with other points (n, 3)."""
    from trimesh.triangles import mass_properties

    counts, corners = (np.array(prim.GetAttribute(f"faceVertex{name}").Get()) for name in ("Counts", "Indices"))
    faces = np.split(corners, np.cumsum(counts)[:-1])
    triangles = np.array([(face[0], face[k], face[k + 1]) for face in faces for k in range(1, len(face) - 1)])
    found = mass_properties(points[triangles], density=1.0)
    if not found["volume"]:
        raise Refused(f"the collider {str(prim.GetPath())!r}, a mesh without a volume")
    sign = np.sign(found["volume"])  # it may be inside out
    return float(sign * found["volume"]), np.array(found["center_mass"]), sign * np.array(found["inertia"])
