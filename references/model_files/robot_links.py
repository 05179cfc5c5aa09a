"""Links of a model file with their shapes and joints, for checks of the file itself. No engine simulates anything.

MJCF needs the package mujoco, because only MuJoCo defines how MJCF is read, and USD needs usd-core. A link keeps its mass and
inertia as they are written in the file. Its shapes, visual and collision, are points that span them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from conservative.attitude import Array
from conservative.errors import BadInput, MissingEngine, MissingExtra

from ..engine import load
from ..worker.calls import python_worker, run_within
from ..worker.client import EngineCrashed, EngineTimeout
from .collada import read_collada
from .description import Description, Joint, is_true, numbers
from .files import Unread, find, guard_layers, inline, kind_of, load_mesh, parse, read_bytes, reason, refuse
from .pieces import Link, Reading, make_pose, rounding_of
from .readers import MEMORY, SECONDS
from .usd import Stage, link_of

ROUND = 24
"""Number of points around a round shape."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A visual or collision shape: corners (n, 3) of its convex hull in the axes of the link, m."""

    points: Array
    visual: bool


@dataclass(frozen=True, eq=False)
class RobotLink:
    """A link of a robot.

    Attributes
    ----------
    link
        Mass, inertial frame and inertia as the file has them. Its pose is the one in the model, with all joints at 0.
    parent, joint
        Name of the link that it is on, and the kind of that joint; "" for a root.
    written
        True if the file has mass or inertia of the link, False if it has neither, or they follow from its shapes.
    shapes
        Visual and collision shapes that could be read.
    unread
        Reasons why shapes could not be read.
    unknown
        Reason why mass and inertia are not known, such as a missing mesh from which they follow; "" if they are.
    assumed
        True if mass and inertia are the default of the format, because the file has none: 1 kg and 1 kg m^2 in SDF.
    """

    link: Link
    parent: str = ""
    joint: str = ""
    written: bool = True
    shapes: Sequence[Shape] = ()
    unread: Sequence[str] = ()
    unknown: str = ""
    assumed: bool = False

    @property
    def name(self) -> str:
        """Name of the link."""
        return self.link.name


@dataclass
class Robot:
    """A model of a file: its links, parents before children, and notes on what was not read.

    `name` is the name of the model if the file has several, and "" otherwise. `broken` has sentences on rules of the format
    that the file breaks, so that parsers refuse it.
    """

    kind: str
    name: str = ""
    links: list[RobotLink] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    broken: list[str] = field(default_factory=list)


def read_robots(
    paths: Sequence[Path], search: Sequence[Path] = (), tell: Callable[[float, str], object] = lambda share, what: None
) -> list[list[Robot] | Exception]:
    """Return the models of each file, or why a file cannot be read: `BadInput`, `MissingEngine` or `MissingExtra`.

    Files are read in a worker with limits.

    `tell` is called with the share that is done and the name of the next file.
    """
    worker, results = python_worker({"OPENBLAS_NUM_THREADS": "1"}, MEMORY), list[list[Robot] | Exception]()
    try:
        for number, path in enumerate(paths):
            tell(number / len(paths), path.name)
            try:
                results.append(run_within(SECONDS, partial(read_robots_here, path, search), process=worker))
            except (BadInput, MissingEngine, MissingExtra) as error:
                results.append(error)
            except (EngineCrashed, EngineTimeout) as failure:
                allowed = f"a file that is read within {SECONDS:g} s and {MEMORY / 2**30:g} GiB"
                results.append(refuse(path, f"a reading that ended: {failure.outcome}", allowed))
    finally:
        worker.close()
    return results


def read_robots_here(path: Path, search: Sequence[Path] = ()) -> list[Robot]:
    """Return the models of a file as `read_robots`, in this process. Raise `BadInput`, `MissingEngine` or `MissingExtra`."""
    kind = kind_of(path)
    allowed = "elements and numbers of its format"
    try:
        if kind == "mjcf":
            robots = [_read_mjcf(path, search)]
        elif kind == "usd":
            robots = [_read_usd(path, search)]
        else:
            robots = _read_xml(path, kind, search)
    except (BadInput, MissingEngine, MissingExtra):
        raise
    except RecursionError:
        raise refuse(path, "frames that refer to each other in a circle", "frames that lead to the model") from None
    except Unread as error:
        raise refuse(path, str(error), allowed) from None
    except KeyError as error:
        raise refuse(path, f"a reference to {error}, which is not there", allowed) from None
    except Exception as error:
        raise refuse(path, f"something that cannot be read ({type(error).__name__})", allowed) from None
    if not any(robot.links for robot in robots):
        raise refuse(path, "no link", "a model with links")
    return robots


# ------------------------------------------------------------------------------------------------------------- URDF and SDF


def _read_xml(path: Path, kind: str, search: Sequence[Path]) -> list[Robot]:
    root = parse(path)
    models = [root] if root.tag == "robot" else [model for model in root.iter("model") if model.getparent().tag != "model"]
    robots = []
    for model in models:
        robot = Robot(kind, model.get("name", "") if len(models) > 1 else "")
        _add_model(path, model, robot, search)
        by_name = {link.name: link for link in robot.links}
        parents = {link.name: link.parent for link in robot.links}
        robot.links = [by_name[name] for name in _from_root(path, list(by_name), parents)]
        robot.notes = list(dict.fromkeys(robot.notes))
        robots.append(robot)
    return robots


def _add_model(
    path: Path,
    model: Any,
    robot: Robot,
    search: Sequence[Path],
    prefix: str = "",
    base: Array | None = None,
    outer: Mapping[str, Joint] = MappingProxyType({}),
) -> None:
    """Add the links of a model, and of the models in it with the names `model::link`, to a robot.

    `prefix` and `base` (4, 4) are the name and the pose of a model within another one, and `outer` has the joints of the outer
    models by the names of their children.
    """
    reading = Reading()
    doubled = _name_apart(model)
    frames = Description(path, model, search, reading)
    names = [link.get("name", "") for link in model.findall("link")]
    robot.broken += doubled if frames.urdf else []
    reading.invalid += [] if frames.urdf else doubled
    if frames.urdf:
        robot.broken += _broken_joints(frames, names)
    joints: dict[str, Joint] = {}
    for joint in frames.joints:
        joints.setdefault(joint.child, joint)  # the others close loops
    for name in _from_root(path, names, {child: joint.parent for child, joint in joints.items()}):
        link = _xml_link(path, frames, name, joints.get(name), robot.links, search)
        if not frames.urdf:
            above = outer.get(prefix + name)
            own = link.link if base is None else replace(link.link, pose=base @ link.link.pose)
            parent = above.parent if above else link.parent and prefix + link.parent
            kind = above.kind if above else link.joint
            link = replace(link, link=replace(own, name=prefix + name), parent=parent, joint=kind)
        robot.links.append(link)
    robot.notes += [*reading.invalid, *reading.doubts]
    all_joints = {**outer, **{prefix + child: joint._replace(parent=prefix + joint.parent) for child, joint in joints.items()}}
    for inner in model.findall("model"):
        element = inner.find("pose")
        place = frames.place("" if element is None else element.get("relative_to", "")) @ frames.pose(element)
        place = place if base is None else base @ place
        _add_model(path, inner, robot, search, f"{prefix}{inner.get('name', '')}::", place, all_joints)


def _broken_joints(frames: Description, names: Sequence[str]) -> list[str]:
    """Return sentences on joints of URDF that parsers refuse: to links that are not there, and a second one to a child."""
    sentences, children = list[str](), set[str]()
    for joint in frames.joints:
        sentences += [
            f"the joint {joint.name!r} is to the link {end!r}, which is not there"
            for end in (joint.parent, joint.child) if end not in names
        ]  # fmt: skip
        if joint.child in children:
            sentences.append(f"the joint {joint.name!r} is the second one to the child {joint.child!r}")
        children.add(joint.child)
    return sentences


def _name_apart(model: Any) -> list[str]:
    """Give links that have the name of an earlier one another name. Return sentences on them."""
    names = [link.get("name", "") for link in model.findall("link")]
    taken, sentences = set[str](), list[str]()
    for link in model.findall("link"):
        old = name = link.get("name", "")
        while name in taken:
            name += " (again)"
        if name != old:
            sentences.append(
                f"{names.count(old)} links have the name {old!r}; joints to it are read as joints to the first one"
            )
            link.set("name", name)
        taken.add(name)
    return list(dict.fromkeys(sentences))


def _from_root(path: Path, names: Sequence[str], parents: dict[str, str]) -> list[str]:
    """Return names with parents before children. Raise `BadInput` for a circle."""
    ordered, left = list[str](), list(names)
    while left:
        ready = [name for name in left if parents.get(name) not in left]
        if not ready:
            raise refuse(path, f"joints that form a circle through {left[0]!r}", "joints that form a tree")
        ordered += ready
        left = [name for name in left if name not in ready]
    return ordered


def _xml_link(
    path: Path, frames: Description, name: str, joint: Any, before: Sequence[RobotLink], search: Sequence[Path]
) -> RobotLink:
    """Return a link of URDF or SDF; the links `before` it have its parent."""
    element, shapes, unread = frames.elements[name], list[Shape](), list[str]()
    inertial = element.find("inertial")
    auto = inertial is not None and is_true(inertial.get("auto"))
    for shape in [*element.findall("visual"), *element.findall("collision")]:
        geometry = shape.find("geometry")
        if geometry is not None and len(geometry):
            try:
                points = _xml_points(path, geometry[0], frames.inside(name, shape), search)
                if len(points):
                    shapes.append(Shape(points, shape.tag == "visual"))
            except (BadInput, Unread) as error:
                unread.append(reason(error) if isinstance(error, BadInput) else str(error))
        if not auto:
            element.remove(shape)  # they are read; `Description.link` has no need of them
    link = frames.link(name)
    pose = frames.place(name)
    if frames.urdf:
        parents = {other.name: other.link.pose for other in before}
        pose = np.eye(4) if joint is None else parents.get(joint.parent, np.eye(4)) @ joint.pose
    link = Link(pose, link.mass, link.frame, link.inertia, name=name, rounding=link.rounding)
    parent, kind = ("", "") if joint is None else (joint.parent, joint.kind)
    static = any(is_true(model.findtext("static")) for model in element.iterancestors("model"))
    assumed = not frames.urdf and not static and not auto and (inertial is None or not len(inertial))
    written = assumed or (inertial is not None and len(inertial) > 0 and not auto)
    return RobotLink(link, parent, kind, written, shapes, list(dict.fromkeys(unread)), assumed=assumed)


def _xml_points(path: Path, form: Any, place: Array, search: Sequence[Path]) -> Array:
    """Return points (n, 3) that span a shape of URDF or SDF at a place (4, 4), m; none for a plane and unknown shapes."""
    values = {**form.attrib, **{child.tag: child.text or "" for child in form}}
    if form.tag == "mesh":
        name = values.get("filename", values.get("uri", ""))
        return _hull(_mesh_points(path, name, search) * numbers(values.get("scale", "1 1 1")), place)
    sizes = [numbers(values[key]) for key in ("size", "radii", "radius", "length") if key in values]
    return _hull(shape_points(form.tag, [number for size in sizes for number in size]), place)


def _mesh_points(path: Path, name: str, search: Sequence[Path]) -> Array:
    if not name.lower().endswith(".dae"):
        return load_mesh(path, name, search)[0]
    try:
        return read_collada(read_bytes(find(path, name, search, "mesh")))
    except (OSError, ValueError) as error:
        raise refuse(path, str(error), "a mesh in the folder of the file or in one of --search") from None


def shape_points(kind: str, sizes: Sequence[float]) -> Array:
    """Return points (n, 3) that span a shape with the sizes of `pieces.weigh`; none for other kinds."""
    turns = 2 * np.pi * np.arange(ROUND) / ROUND
    circle = np.column_stack([np.cos(turns), np.sin(turns)])
    if kind == "box" and len(sizes) == 3:
        return np.array(np.meshgrid(*([-1, 1],) * 3)).reshape(3, -1).T * np.array(sizes) / 2
    if kind == "cylinder" and len(sizes) == 2:
        return np.vstack([np.column_stack([sizes[0] * circle, np.full(ROUND, end)]) for end in (-sizes[1] / 2, sizes[1] / 2)])
    if kind == "cone" and len(sizes) == 2:
        base = np.column_stack([sizes[0] * circle, np.full(ROUND, -sizes[1] / 2)])
        return np.vstack([base, [0, 0, sizes[1] / 2]])
    angles = np.linspace(-np.pi / 2, np.pi / 2, 13)
    ball = np.vstack([np.column_stack([np.cos(a) * circle, np.full(ROUND, np.sin(a))]) for a in angles])
    if kind == "capsule" and len(sizes) == 2:
        return sizes[0] * ball + np.outer(np.sign(ball[:, 2]), [0, 0, sizes[1] / 2])
    if kind in ("sphere", "ellipsoid") and len(sizes) in (1, 3):
        return np.asarray(sizes) * ball
    return np.zeros((0, 3))


def _hull(points: Array, pose: Array) -> Array:
    """Return the corners of the convex hull of points (n, 3) in other axes; all points if they are in one plane."""
    placed = np.asarray(points, float) @ pose[:3, :3].T + pose[:3, 3]
    try:
        return placed[ConvexHull(placed).vertices]
    except (QhullError, ValueError):
        return np.unique(placed, axis=0)[:1000]


# --------------------------------------------------------------------------------------------------------------------- MJCF


def _read_mjcf(path: Path, search: Sequence[Path]) -> Robot:
    """Return the bodies of an MJCF file. MuJoCo compiles a copy in which masses and inertias that it refuses are replaced."""
    mujoco, spec = _parse_mjcf(path, search)
    options, off = spec.compiler, {"balanceinertia": 0, "boundmass": 0, "boundinertia": 0, "settotalmass": -1, "fusestatic": 0}
    changed = [name for name, value in off.items() if name != "fusestatic" and getattr(options, name) not in (0, value)]
    from_geometry = int(options.inertiafromgeom) == int(mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE)
    for name, value in off.items():
        setattr(options, name, value)
    bodies = [body for body in spec.bodies if body != spec.worldbody]
    _name_all(bodies)
    groups = [int(group) for group in options.inertiagrouprange]
    weighing = {geom.parent.name for geom in spec.geoms if _weighs(mujoco, geom, groups) and geom.meshname}
    unread = _drop_missing_meshes(spec, path, search)
    written: dict[int, tuple[float, Array, bool]] = {}
    empty: dict[int, str] = {}
    for number, body in enumerate(bodies):
        if body.explicitinertial and not from_geometry:
            written[number] = _mjcf_inertial(body)
        elif body.name in unread and body.name in weighing:
            empty[number] = f"its mass and inertia follow from its shapes: {unread[body.name][0]}"
        elif any(_weighs(mujoco, geom, groups) for geom in body.geoms):
            continue
        else:
            empty[number] = ""
        body.explicitinertial, body.mass, body.inertia = 1, 1.0, np.ones(3)
        body.fullinertia = np.full(6, np.nan)
    try:
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise _refused(path, error, "compiles") from None
    mujoco.mj_kinematics(model, data := mujoco.MjData(model))
    robot, ids = Robot("mjcf"), [body.id for body in bodies]
    if changed:
        names = ", ".join(changed)
        robot.notes.append(f"MuJoCo changes masses or inertias by {names}, and what it makes of them is not tested")
    for number, body in enumerate(bodies):
        k = body.id
        R = _matrix(mujoco, model.body_iquat[k])
        pose = make_pose(data.xpos[k], data.xmat[k].reshape(3, 3))
        if number in written:
            mass, tensor, is_full = written[number]
            frame = make_pose(model.body_ipos[k], None if is_full else R)
        elif number in empty:
            mass, tensor, frame = 0.0, np.zeros((3, 3)), np.eye(4)
        else:
            mass, tensor, frame = float(model.body_mass[k]), np.diag(model.body_inertia[k]), make_pose(model.body_ipos[k], R)
        link = Link(pose, mass, frame, tensor, name=body.name, rounding=rounding_of(tensor.ravel().tolist()))
        kinds = [mujoco.mjtJoint(joint.type).name.removeprefix("mjJNT_").lower() for joint in body.joints]
        parent = bodies[ids.index(body.parent.id)].name if body.parent.id else ""
        joint = " ".join(kinds) or ("fixed" if parent else "")
        shapes, missing = _mjcf_shapes(mujoco, model, k), unread.get(body.name, [])
        robot.links.append(RobotLink(link, parent, joint, number in written, shapes, missing, empty.get(number, "")))
    return robot


def _mjcf_inertial(body: Any) -> tuple[float, Array, bool]:
    """Return mass and inertia (3, 3) of an <inertial>, and whether it has all six numbers, in the axes of the body."""
    full = np.array(body.fullinertia)
    if not np.isfinite(full[0]):
        return float(body.mass), np.diag(np.array(body.inertia)), False
    return float(body.mass), full[np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])], True


def _name_all(bodies: Sequence[Any]) -> None:
    """Give bodies without a name one that no other body has."""
    taken = {body.name for body in bodies}
    for number, body in enumerate(bodies):
        if not body.name:
            name = f"body {number}"
            while name in taken:
                name += " (unnamed)"
            body.name = name
            taken.add(name)


def _weighs(mujoco: Any, geom: Any, groups: Sequence[int]) -> bool:
    """Return True if a geometry adds to the mass of its body."""
    if geom.type == mujoco.mjtGeom.mjGEOM_PLANE or not groups[0] <= int(geom.group) <= groups[1]:
        return False
    return bool(geom.mass > 0 or (np.isnan(geom.mass) and geom.density > 0))


def _parse_mjcf(path: Path, search: Sequence[Path]) -> tuple[Any, Any]:
    """Return the module mujoco and the elements of a file, an `MjSpec`. Raise `BadInput` and `MissingEngine`."""
    mujoco = load("mujoco", "mujoco", "MuJoCo")
    from lxml.etree import tostring

    try:
        spec = mujoco.MjSpec.from_string(tostring(inline(path, search)[0]).decode())
    except (ValueError, mujoco.FatalError) as error:
        raise _refused(path, error, "reads") from None
    spec.modelfiledir = str(path.parent)
    for part in (spec.compiler, *spec.joints):  # the body keeps the axes of the file
        for name in {"align", "alignfree"}.intersection(dir(part)):
            setattr(part, name, 0)
    return mujoco, spec


def _refused(path: Path, error: Exception, does: str) -> BadInput:
    message = " ".join(str(error).removeprefix("Error: ").split())
    return refuse(path, f"an error ({message})", f"a file that MuJoCo {does}")


def _drop_missing_meshes(spec: Any, path: Path, search: Sequence[Path]) -> dict[str, list[str]]:
    """Remove what is drawn only, and geometries whose mesh is not there. Return why, by the names of their bodies."""
    for geom in spec.geoms:
        geom.material = ""
    for unused in [*spec.skins, *spec.materials, *spec.textures]:
        spec.delete(unused)
    unread: dict[str, list[str]] = {}
    folder = spec.compiler.meshdir
    for mesh in [mesh for mesh in spec.meshes if mesh.file]:
        name = f"{folder}/{mesh.file}" if folder else mesh.file
        try:
            file = find(path, name, search, "mesh")
        except Unread as error:
            named = mesh.name or Path(mesh.file).stem
            for geom in [geom for geom in spec.geoms if geom.meshname == named]:
                unread.setdefault(geom.parent.name, []).append(str(error))
                spec.delete(geom)
            spec.delete(mesh)
        else:
            mesh.name = mesh.name or Path(mesh.file).stem
            mesh.file = str(file.resolve())
    return unread


def _matrix(mujoco: Any, quaternion: Array) -> Array:
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, quaternion)
    return R.reshape(3, 3)


def _mjcf_shapes(mujoco: Any, model: Any, body: int) -> list[Shape]:
    """Return the shapes of a compiled body; geometries that touch nothing are visual."""
    shapes = []
    for g in np.flatnonzero(model.geom_bodyid == body):
        kind = mujoco.mjtGeom(int(model.geom_type[g])).name.removeprefix("mjGEOM_").lower()
        pose = make_pose(model.geom_pos[g], _matrix(mujoco, model.geom_quat[g]))
        if kind == "mesh":
            mesh = model.geom_dataid[g]
            start = model.mesh_vertadr[mesh]
            points = np.array(model.mesh_vert[start : start + model.mesh_vertnum[mesh]], float)
        else:
            half = {"box": (2, 2, 2), "sphere": (1,), "ellipsoid": (1, 1, 1), "capsule": (1, 2), "cylinder": (1, 2)}.get(
                kind, ()
            )
            points = shape_points(kind, [size * factor for size, factor in zip(model.geom_size[g], half, strict=False)])
        if len(points):
            shapes.append(Shape(_hull(points, pose), not (model.geom_contype[g] or model.geom_conaffinity[g])))
    return shapes


# ---------------------------------------------------------------------------------------------------------------------- USD


def _read_usd(path: Path, search: Sequence[Path]) -> Robot:
    """Return the rigid bodies of a USD file. A body without its own mass and inertia has those of its shapes."""
    guard_layers(path, search)
    stage = Stage(path)
    names = {str(body.GetPath()): body for body in stage.bodies}
    parents: dict[str, tuple[str, str]] = {}
    for joint in stage.joints:
        api = stage.physics.Joint(joint)
        ends = [[str(target) for target in end.GetTargets()] for end in (api.GetBody0Rel(), api.GetBody1Rel())]
        if all(ends) and ends[0][0] in names and ends[1][0] in names and ends[1][0] not in parents:
            kind = joint.GetTypeName().removeprefix("Physics").removesuffix("Joint").lower()
            parents[ends[1][0]] = ends[0][0], kind
    robot = Robot("usd")
    for name in _from_root(path, list(names), {child: parent for child, (parent, _) in parents.items()}):
        body = names[name]
        shapes, unread = _usd_shapes(stage, body)
        link, written, unknown = _usd_link(stage, body)
        parent, kind = parents.get(name, ("", ""))
        robot.links.append(RobotLink(link, parent, kind, written, shapes, unread, unknown))
    return robot


def _usd_link(stage: Stage, body: Any) -> tuple[Link, bool, str]:
    """Return mass and inertia of a body, whether the file has a part of them, and why they are not known.

    What the file does not have follows from the colliders by the rules of `ComputeMassProperties`. Their volumes have to be
    known.
    """
    pose, scale = stage.pose(body)
    empty, (mass, _, com, inertia) = Link(pose, name=str(body.GetPath())), stage.authored(body)
    colliders = stage.colliders(body)
    if mass and mass > 0 and inertia is not None:
        moments = body.GetAttribute("physics:diagonalInertia").Get()
        rounding = rounding_of(map(np.float32, moments)) * stage.kilogram * stage.metre**2
        frame = make_pose(np.zeros(3) if com is None else scale @ com)
        return replace(empty, mass=float(mass), frame=frame, inertia=np.array(inertia), rounding=rounding), True, ""
    if not colliders:
        parts = [name for name, value in (("mass", mass), ("inertia", inertia)) if value is not None]
        return empty, False, f"it has {' and '.join(parts) or 'neither mass nor inertia'}, and no collider for the others"
    reading = Reading()
    try:
        link = link_of(stage, body, reading)
    except (BadInput, ValueError, TypeError, IndexError, ArithmeticError) as error:
        text = reason(error) if isinstance(error, BadInput) else str(error)
        return empty, False, f"its mass and inertia follow from its colliders: {text}"
    if reading.doubts:
        return empty, False, f"its mass and inertia follow from its colliders: {reading.doubts[0]}"
    values = [value for prim in (body, *colliders) for value in stage.authored(prim)]
    return link, any(value is not None for value in values), ""


def _usd_shapes(stage: Stage, body: Any) -> tuple[list[Shape], list[str]]:
    """Return the shapes below a body that are not of another body, and why others are not read."""
    from pxr import Usd, UsdGeom

    base, shapes, unread = np.linalg.inv(stage.pose(body)[0]), list[Shape](), list[str]()
    prims = iter(Usd.PrimRange(body, Usd.TraverseInstanceProxies()))
    for prim in prims:
        if prim != body and prim in stage.bodies:
            prims.PruneChildren()
        elif prim.IsA(UsdGeom.Gprim):
            kind = prim.GetTypeName().lower()
            pose, scale = stage.pose(prim)
            if kind == "mesh":
                points = np.array(prim.GetAttribute("points").Get() or np.zeros((0, 3)), float)
            else:
                keys = {"cube": ("size",), "sphere": ("radius",)}.get(kind, ("radius", "height"))
                sizes = [prim.GetAttribute(key).Get() for key in keys]
                points = shape_points({"cube": "box"}.get(kind, kind), sizes * (3 if kind == "cube" else 1))
                if len(sizes) == 2 and None not in sizes:
                    points = points @ np.roll(np.eye(3), "XYZ".index(prim.GetAttribute("axis").Get()) - 2, axis=0).T
            if len(points) > 3:
                placed = stage.metre * points @ scale.T
                shapes.append(Shape(_hull(placed, base @ pose), not prim.HasAPI(stage.physics.CollisionAPI)))
            else:
                unread.append(f"the shape {str(prim.GetPath())!r} of type {prim.GetTypeName()!r}")
    return shapes, unread
