"""Bodies out of model files, read by the engines' own parsers: MJCF by MuJoCo, URDF by Pinocchio.

A body turns about its joint. What is welded to it moves with it and counts; what hangs on further joints does not. A body that
is free turns about its centre of mass. Body axes are the file's own: those of the MJCF body or of the URDF link. Source: the
two formats' documentation.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from conservative.attitude import Array
from conservative.errors import BadInput, nearest
from conservative.shapes import MassDistribution

from ..engine import load

# Anchors of several joints of a body agree to this, relative to their distance from its origin, or the body has no fixed point.
_SAME_POINT = 1e-9


def body_from_mjcf(path: str | PathLike[str], name: str) -> MassDistribution:
    """Return mass, centre of mass and inertia of a body of an MJCF file, as MuJoCo compiles it.

    Parameters
    ----------
    path
        The file.
    name
        Of a body with a ball joint or hinges through one point, which becomes the fixed point, or with a free joint: then its
        centre of mass does.

    Raises
    ------
    BadInput
        The file cannot be read or compiled, has no such body, or its joints do not let it turn about a point.
    MissingEngine
        MuJoCo is not installed.
    """
    mj = load("mujoco", "mujoco", "MuJoCo")
    _require_xml(path, "mujoco")
    try:
        model = mj.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise _unusable(path, error, "an MJCF file that MuJoCo compiles") from None
    names = [model.body(number).name for number in range(1, model.nbody)]
    _require_name(path, name, names)
    data = mj.MjData(model)
    mj.mj_kinematics(model, data)
    return _mujoco_body(mj, model, data, model.body(name).id)


def _mujoco_body(mj: Any, model: Any, data: Any, body: int) -> MassDistribution:
    """Return the body with all that is welded to it; poses are those of the model's reference configuration."""
    origin, R_WB = data.xpos[body], data.xmat[body].reshape(3, 3)
    parts = []
    for part in np.flatnonzero(model.body_weldid == body):
        R_BI = R_WB.T @ data.ximat[part].reshape(3, 3)
        inertia = R_BI @ np.diag(model.body_inertia[part]) @ R_BI.T
        parts.append((float(model.body_mass[part]), R_WB.T @ (data.xipos[part] - origin), inertia))
    fixed_point = _mujoco_fixed_point(mj, model, data, body)
    return _combine(parts, None if fixed_point is None else R_WB.T @ (fixed_point - origin))


def _mujoco_fixed_point(mj: Any, model: Any, data: Any, body: int) -> Array | None:
    """Return where the body's joints hold it (3,), m, world axes; None if it is free."""
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    joints = range(first, first + count)
    if any(model.jnt_type[joint] == int(mj.mjtJoint.mjJNT_FREE) for joint in joints):
        return None
    turning = (int(mj.mjtJoint.mjJNT_BALL), int(mj.mjtJoint.mjJNT_HINGE))  # NumPy's integers never equal the enumeration's
    anchors = np.array([data.xanchor[joint] for joint in joints if model.jnt_type[joint] in turning])
    if not len(anchors):
        others = [
            model.body(b).name for b in range(1, model.nbody) if np.isin(model.jnt_type[_joints(model, b)], turning).any()
        ]
        raise _not_turning(model.body(body).name, others)
    spread = np.abs(anchors - anchors[0]).max()
    if spread > _SAME_POINT * max(1.0, float(np.abs(anchors - data.xpos[body]).max())):
        allowed = "a body whose ball joint or hinges go through one point"
        raise BadInput("name", f"{model.body(body).name!r}, whose joints turn about points {spread:.3g} m apart", allowed)
    fixed_point: Array = anchors[0]
    return fixed_point


def _joints(model: Any, body: int) -> slice:
    first = int(model.body_jntadr[body])
    return slice(first, first + int(model.body_jntnum[body]))


def body_from_urdf(path: str | PathLike[str], name: str) -> MassDistribution:
    """Return mass, centre of mass and inertia of a link of a URDF file, as Pinocchio reads it.

    Parameters
    ----------
    path
        The file.
    name
        Of a link moved by a revolute, continuous or spherical joint, whose origin becomes the fixed point, or of the root link,
        which is taken as free: then its centre of mass does.

    Raises
    ------
    BadInput
        The file cannot be read, has no such link, the link is welded to another, slides, or has no mass.
    MissingEngine
        Pinocchio is not installed.
    """
    pin = load("pinocchio", "pin", "Pinocchio")
    _require_xml(path, "robot")
    try:
        model = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
    except ValueError as error:
        raise _unusable(path, error, "a URDF file that Pinocchio reads") from None
    return _pinocchio_link(pin, model, path, name)


def _pinocchio_link(pin: Any, model: Any, path: str | PathLike[str], name: str) -> MassDistribution:
    """Return the link with all that is welded to it, which Pinocchio has as one; the link's axes are those of its joint."""
    links = {frame.name: frame for frame in model.frames if frame.type == pin.FrameType.BODY}
    _require_name(path, name, links)
    owners = {link for link, frame in links.items() if model.frames[frame.parentFrame].type == pin.FrameType.JOINT}
    kinds = {link: model.joints[links[link].parentJoint].shortname() for link in owners}
    able = {
        link for link, kind in kinds.items() if kind.startswith(("JointModelR", "JointModelSpherical", "JointModelFreeFlyer"))
    }
    if name not in able:
        raise _not_turning(name, sorted(able))
    inertia = model.inertias[links[name].parentJoint]
    if not inertia.mass > 0:
        raise BadInput("name", f"{name!r}, which has no mass", "a link with mass and inertia")
    com = np.zeros(3) if kinds[name] == "JointModelFreeFlyer" else inertia.lever
    return MassDistribution(inertia.mass, com, inertia.inertia)


def _require_xml(path: str | PathLike[str], root: str) -> None:
    """Raise `BadInput` unless a file can be read and is XML with the right root; the engines' parsers say less, or print it."""
    allowed = f"a file of XML with the root element <{root}>"
    try:
        found = ElementTree.fromstring(Path(path).read_bytes()).tag
    except OSError as error:
        raise _unusable(path, error.strerror or error, allowed) from None
    except ElementTree.ParseError as error:
        raise _unusable(path, error, allowed) from None
    if found != root:
        raise _unusable(path, f"root element <{found}>", allowed)


def _unusable(path: str | PathLike[str], reason: object, allowed: str) -> BadInput:
    return BadInput("path", f"{str(path)!r}: {' '.join(str(reason).split())}", allowed)


def _require_name(path: str | PathLike[str], name: str, known: Iterable[str]) -> None:
    if name not in known:
        raise BadInput("name", f"{name!r}, which is not in {str(path)!r}", nearest(name, known))


def _not_turning(name: str, others: list[str]) -> BadInput:
    allowed = "one that a joint turns" + (": " + ", ".join(others) if others else "; this file has none")
    return BadInput("name", f"{name!r}, which no joint turns", allowed)


def _combine(parts: list[tuple[float, Array, Array]], fixed_point: Array | None) -> MassDistribution:
    """Return bodies of given mass, centre (3,) and inertia (3, 3) about it as one; without a fixed point about its centre."""
    mass = sum(m for m, _, _ in parts)
    com = sum((m * c for m, c, _ in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for m, c, J in parts:
        d = c - com
        inertia += J + m * (d @ d * np.eye(3) - np.outer(d, d))
    return MassDistribution(mass, np.zeros(3) if fixed_point is None else com - fixed_point, inertia)
