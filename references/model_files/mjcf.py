"""The body of an MJCF file as MuJoCo compiles it, and as this package computes it from the elements that MuJoCo parses.

Only MuJoCo's parser knows classes, copies, frames and files within files. The mass, centre of mass and inertia that follow from
the elements are computed here by the rules of https://mujoco.readthedocs.io/en/stable/XMLreference.html. What has no rule here
raises `NotRead` instead of a guess.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from conservative.attitude import Array
from conservative.errors import BadInput

from ..engine import load
from .files import inline, load_mesh, refuse
from .pieces import ONE, Link, Piece, Reading, join, join_links, make_pose, rounding_of, weigh

_HALF = {"capsule": (1, 2), "cylinder": (1, 2), "box": (2, 2, 2), "ellipsoid": (1, 1, 1), "sphere": (1,)}
"""Shapes, and the factors from sizes in MJCF, which are half lengths, to the sizes of `weigh`."""


class NotRead(Exception):
    """The file has something for which there is no rule here. The message names it."""


def parse_mjcf(path: Path, search: Sequence[Path] = ()) -> tuple[Any, Any, list[str]]:
    """Return the module mujoco, the elements of a file, an `MjSpec`, and doubts. Raise `BadInput` and `MissingEngine`."""
    mujoco = load("mujoco", "mujoco", "MuJoCo")
    from lxml.etree import tostring

    try:
        spec = mujoco.MjSpec.from_string(tostring(inline(path, search)[0]).decode())
    except (ValueError, mujoco.FatalError) as error:
        raise _refuse(path, error, "reads") from None
    spec.modelfiledir = str(path.parent)
    aligned = 0
    for part in (spec.compiler, *spec.joints):  # the same body in other axes
        for name in {"align", "alignfree"}.intersection(dir(part)):
            aligned |= int(getattr(part, name)) == 1
            setattr(part, name, 0)
    return mujoco, spec, ["the axes of the body are its principal axes by an option of the file"] * aligned


def _refuse(path: Path, error: Exception, does: str) -> BadInput:
    message = " ".join(str(error).removeprefix("Error: ").split())
    return refuse(path, f"an error ({message})", f"a file that MuJoCo {does}")


def compile_mjcf(path: Path, search: Sequence[Path], reading: Reading) -> Piece:
    """Return the body that MuJoCo compiles of a file with one free body, in its axes. Warnings become notes.

    Raise `BadInput` for a file that it does not compile, and for several bodies.
    """
    mujoco, spec, _ = parse_mjcf(path, search)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            model = spec.compile()
        except (ValueError, mujoco.FatalError) as error:
            raise _refuse(path, error, "compiles") from None
    reading.notes.extend(f"MuJoCo warns: {warning.message}" for warning in caught)
    if model.njnt > (model.nq == 7):
        raise refuse(path, f"the joint {model.jnt(model.njnt - 1).name!r}, which moves", ONE)
    if (roots := (model.body_parentid[1:] == 0).sum()) != 1:
        raise refuse(path, f"{roots} bodies in the world", ONE)
    mujoco.mj_kinematics(model, data := mujoco.MjData(model))
    parts = [Piece(float(model.body_mass[k]), np.zeros(3), np.diag(model.body_inertia[k])) for k in range(1, model.nbody)]
    poses = [make_pose(*pose) for pose in zip(data.xipos[1:], data.ximat[1:].reshape(-1, 3, 3), strict=True)]
    base = np.linalg.inv(make_pose(data.xpos[1], data.xmat[1].reshape(3, 3)))
    return join(part.place(base @ pose) for part, pose in zip(parts, poses, strict=True))


def read_mjcf(path: Path, search: Sequence[Path], reading: Reading) -> list[Link]:
    """Return the links of a file with one body in the world, in its axes. Raise `NotRead` and `BadInput`."""
    mujoco, spec, doubts = parse_mjcf(path, search)
    reading.doubts.extend(doubts)
    options = spec.compiler
    if len(spec.worldbody.bodies) != 1 or len(getattr(spec, "flexes", ())):
        raise NotRead(f"{len(spec.worldbody.bodies)} bodies in the world, or flexible ones")

    def weigh_geom(geom: Any) -> list[Piece]:
        kind = mujoco.mjtGeom(geom.type).name.removeprefix("mjGEOM_").lower()
        place, sizes = _pose(geom, options), geom.size
        if kind in ("plane", "hfield") or geom.mass == 0:
            return []
        if geom.meshname:
            shape: Any = _mesh(mujoco, spec, geom, kind, path, search)
        elif kind in _HALF:
            if np.isfinite(geom.fromto[0]):
                ends = geom.fromto.reshape(2, 3)
                place = _pose(geom, options, make_pose(ends.mean(axis=0), _from_z(ends[0] - ends[1])))
                half = np.linalg.norm(ends[1] - ends[0]) / 2
                sizes = [sizes[0]] * (len(_HALF[kind]) - 1) + [half]
            shape = np.multiply(sizes[: len(_HALF[kind])], _HALF[kind])
            shape = shape[0] if kind == "sphere" else shape
        else:
            raise NotRead(f"a geometry of type {kind!r}")
        (part,) = (_shell if int(geom.typeinertia) else weigh)(kind, shape, place, float(geom.density))
        return [part] if np.isnan(geom.mass) else [part.scale(geom.mass / part.mass)]

    def read(body: Any, pose: Array) -> list[Link]:
        counted = [geom for geom in body.geoms if options.inertiagrouprange[0] <= geom.group <= options.inertiagrouprange[1]]
        geometry = join(part for geom in counted for part in weigh_geom(geom))
        link = Link(pose, name=body.name, geometry=geometry)
        if body.explicitinertial and options.inertiafromgeom != mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
            full = body.fullinertia
            numbers = body.inertia if np.isnan(full[0]) else full
            inertia = np.array([[full[0], full[3], full[4]], [full[3], full[1], full[5]], [full[4], full[5], full[2]]])
            inertia = np.diag(numbers) if len(numbers) == 3 else inertia
            frame = make_pose(body.ipos, _turn(body.iquat, body.ialt, options))
            link = replace(link, mass=float(body.mass), frame=frame, inertia=inertia, rounding=rounding_of(numbers))
        elif options.inertiafromgeom != mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE:
            link = link.filled(geometry)
        moments, axes = np.linalg.eigh(link.inertia)
        raised = np.maximum(moments, options.boundinertia)
        if options.balanceinertia and raised[2] > raised[0] + raised[1]:
            raised[:] = raised.mean()
        link = link if (raised == moments).all() else replace(link, inertia=(axes * raised) @ axes.T)
        links = [replace(link, mass=max(link.mass, options.boundmass))]
        return links + [link for child in body.bodies for link in read(child, pose @ _pose(child, options))]

    links = read(spec.worldbody.bodies[0], np.eye(4))
    if options.settotalmass > 0:
        factor = options.settotalmass / join_links(links).mass
        return [replace(k, mass=factor * k.mass, inertia=factor * k.inertia, geometry=k.geometry.scale(factor)) for k in links]
    return links


def _shell(kind: str, sizes: Any, pose: Array, density: float) -> list[Piece]:
    """Return the surface of a box or a sphere as `weigh`, with a density in kg/m^2. MuJoCo approximates other shells."""
    if kind not in ("box", "sphere"):
        raise NotRead(f"shellinertia='true' of a geometry of type {kind!r}")
    sides = np.broadcast_to(sizes, 3)
    if kind == "sphere":
        mass, second = density * 4 * math.pi * sides[0] ** 2, sides**2 / 3
    else:
        areas = 2 * np.prod(sides) / sides  # both faces normal to each axis
        mass, second = density * areas.sum(), (areas.sum() / 12 + areas / 6) / areas.sum() * sides**2
    return [Piece(mass, np.zeros(3), mass * (second.sum() * np.eye(3) - np.diag(second))).place(pose)]


def _mesh(mujoco: Any, spec: Any, geom: Any, kind: str, path: Path, search: Sequence[Path]) -> list[Array]:
    """Return vertices and triangles of a mesh whose volume is the same by all rules of MuJoCo, as it is convex."""
    mesh = next((asset for asset in spec.meshes if (asset.name or Path(asset.file).stem) == geom.meshname), None)
    if mesh is None or kind != "mesh" or not mesh.file or np.any(mesh.refpos) or abs(mesh.refquat[0]) != 1:
        raise NotRead(f"the mesh {geom.meshname!r} of a geometry of type {kind!r}")
    if mesh.inertia == mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL:
        raise NotRead(f"the mesh {geom.meshname!r}, which is a shell")
    vertices, faces = load_mesh(path, "/".join(filter(None, [spec.compiler.meshdir, mesh.file])), search)
    shape = [vertices * mesh.scale, faces]
    if weigh("mesh", shape, np.eye(4), 1.0)[0].mass < ConvexHull(shape[0]).volume * (1 - 1e-6):
        raise NotRead(f"the mesh {geom.meshname!r}: it is not convex, and its volume depends on the version of MuJoCo")
    return shape


def _pose(element: Any, options: Any, own: Array | None = None) -> Array:
    """Return the pose (4, 4) of an element in its body from its `own` and the poses of the frames around it."""
    own = make_pose(element.pos, _turn(element.quat, element.alt, options)) if own is None else own
    return own if element.frame is None else _pose(element.frame, options) @ own


def _turn(quaternion: Array, other: Any, options: Any) -> Rotation:
    """Return the rotation of a quaternion, scalar first, or of what stands for it."""
    unit, kind = math.pi / 180 if options.degree else 1.0, other.type.name.removeprefix("mjORIENTATION_")
    if kind == "AXISANGLE":
        axis = np.array(other.axisangle[:3])
        return Rotation.from_rotvec(unit * other.axisangle[3] * axis / np.linalg.norm(axis))
    if kind == "EULER":  # small letters turn about axes that move along, which scipy writes in capitals
        sequence = "".join(options.eulerseq[number] for number in range(3))
        return Rotation.from_euler(sequence.swapcase(), unit * np.array(other.euler))
    if kind == "XYAXES":
        x, y = np.reshape(other.xyaxes, (2, 3))
        x = x / np.linalg.norm(x)
        y = y - x * (x @ y)
        y /= np.linalg.norm(y)
        return Rotation.from_matrix(np.transpose([x, y, np.cross(x, y)]))
    return _from_z(np.array(other.zaxis)) if kind == "ZAXIS" else Rotation.from_quat(quaternion, scalar_first=True)


def _from_z(z: Array) -> Rotation:
    """Return the smallest rotation that turns the third axis to z (3,)."""
    z = z / np.linalg.norm(z)
    axis = np.array([-z[1], z[0], 0.0])
    length = np.linalg.norm(axis)
    return Rotation.from_rotvec(axis / length * math.atan2(length, z[2]) if length else (math.pi * (z[2] < 0), 0, 0))
