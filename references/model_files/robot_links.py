"""Links of a model file with their shapes and joints, for checks of the file itself. No engine is needed for URDF, SDF and USD.

A link keeps its mass and inertia as they are written in the file. Its shapes, visual and collision, are points that span them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from conservative.attitude import Array
from conservative.errors import BadInput

from ..worker.calls import python_worker, run_within
from ..worker.client import EngineCrashed, EngineTimeout
from .collada import read_collada
from .description import Description, is_true, numbers
from .files import Unread, find, kind_of, load_mesh, parse, read_bytes, reason, refuse
from .pieces import Link, Reading, make_pose
from .readers import MEMORY, SECONDS

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
    """

    link: Link
    parent: str = ""
    joint: str = ""
    written: bool = True
    shapes: Sequence[Shape] = ()
    unread: Sequence[str] = ()

    @property
    def name(self) -> str:
        """Name of the link."""
        return self.link.name


@dataclass
class Robot:
    """A model of a file: its links, parents before children, and notes on what was not read."""

    file: str
    kind: str
    links: list[RobotLink] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def read_robots(
    paths: Sequence[Path], search: Sequence[Path] = (), tell: Callable[[float, str], object] = lambda share, what: None
) -> list[list[Robot] | BadInput]:
    """Return the models of each file, or why a file cannot be read. Files are read in a worker with limits.

    `tell` is called with the share that is done and the name of the next file.
    """
    worker, results = python_worker({"OPENBLAS_NUM_THREADS": "1"}, MEMORY), list[list[Robot] | BadInput]()
    unique = len({path.name for path in paths}) == len(paths)
    try:
        for number, path in enumerate(paths):
            label = path.name if unique else str(path)
            tell(number / len(paths), label)
            try:
                results.append(run_within(SECONDS, partial(read_robots_here, path, label, search), process=worker))
            except BadInput as error:
                results.append(error)
            except (EngineCrashed, EngineTimeout) as failure:
                allowed = f"a file that is read within {SECONDS:g} s and {MEMORY / 2**30:g} GiB"
                results.append(refuse(path, f"a reading that ended: {failure.outcome}", allowed))
    finally:
        worker.close()
    return results


def read_robots_here(path: Path, label: str, search: Sequence[Path] = ()) -> list[Robot]:
    """Return the models of a file as `read_robots`, in this process. Raise `BadInput`."""
    kind = kind_of(path)
    allowed = "elements and numbers of its format"
    try:
        robots = _read_xml(path, label, kind, search)
    except BadInput:
        raise
    except RecursionError:
        raise refuse(path, "frames that refer to each other in a circle", "frames that lead to the model") from None
    except Unread as error:
        raise refuse(path, str(error), allowed) from None
    except KeyError as error:
        raise refuse(path, f"a reference to {error}, which is not there", allowed) from None
    if not any(robot.links for robot in robots):
        raise refuse(path, "no link", "a model with links")
    return robots


# ------------------------------------------------------------------------------------------------------------- URDF and SDF


def _read_xml(path: Path, label: str, kind: str, search: Sequence[Path]) -> list[Robot]:
    root = parse(path)
    models = [root] if root.tag == "robot" else [*root.iter("model")]
    robots = []
    for model in models:
        robot, reading = Robot(label if len(models) == 1 else f"{label}: {model.get('name')}", kind), Reading()
        frames = Description(path, model, search, reading)
        joints = {joint.child: joint for joint in frames.joints}
        names = [link.get("name", "") for link in model.findall("link")]
        for name in _from_root(path, names, {child: joint.parent for child, joint in joints.items()}):
            robot.links.append(_xml_link(path, frames, name, joints.get(name), robot.links, search))
        robot.notes = list(dict.fromkeys([*reading.invalid, *reading.doubts]))
        robots.append(robot)
    return robots


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
    written = inertial is not None and len(inertial) > 0 and not auto
    return RobotLink(link, parent, kind, written, shapes, list(dict.fromkeys(unread)))


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
