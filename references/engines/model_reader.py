"""The worker that reads model files: MJCF by MuJoCo, URDF by Pinocchio. It takes a request on stdin and answers on stdout.

A process of its own, as no file must hold up or fill the one that asks: `conservative.references.engines.model_files` starts it
and has what it means for a body to turn. Not one of `conservative.references.worker`: its limits on memory and processor time
last as long as the process, and JSON, whose numbers are the shortest that give the same doubles, needs no extra package.
Source: the two formats' documentation.
"""

from __future__ import annotations

import json
import os
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from conservative.attitude import Array
from conservative.errors import BadInput, MissingEngine, nearest
from conservative.shapes import MassDistribution

from ..engine import load

CPU_SECONDS = 20
"""Processor time, s, that reading a file may take, where the system can tell."""
MEMORY = 2 * 2**30
"""Memory, bytes, that it may take beyond that of the engine itself, where the system can tell."""
ENGINES = {"mjcf": ("mujoco", "mujoco", "MuJoCo"), "urdf": ("pinocchio", "pin", "Pinocchio")}
"""Module, package and name of the engine that reads a kind of file."""

# Anchors of several joints of a body agree to this, relative to their distance from its origin, or the body has no fixed point.
_SAME_POINT = 1e-9


def read_mjcf(path: str, name: str) -> MassDistribution:
    """Return the body of an MJCF file: see `conservative.references.engines.model_files.body_from_mjcf`.

    Raises
    ------
    BadInput
        The file cannot be read or compiled, has no such body, or its joints do not let it turn about a point.
    """
    mj = load(*ENGINES["mjcf"])
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


def read_urdf(path: str, name: str) -> MassDistribution:
    """Return the link of a URDF file: see `conservative.references.engines.model_files.body_from_urdf`.

    Raises
    ------
    BadInput
        The file cannot be read, has no such link, the link is welded to another, slides, or has no mass.
    """
    pin = load(*ENGINES["urdf"])
    _require_xml(path, "robot")
    try:
        model = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
    except ValueError as error:
        raise _unusable(path, error, "a URDF file that Pinocchio reads") from None
    return _pinocchio_link(pin, model, path, name)


def _pinocchio_link(pin: Any, model: Any, path: str, name: str) -> MassDistribution:
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


def _require_xml(path: str, root: str) -> None:
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


def _unusable(path: str, reason: object, allowed: str) -> BadInput:
    return BadInput("path", f"{str(path)!r}: {' '.join(str(reason).split())}", allowed)


def _require_name(path: str, name: str, known: Iterable[str]) -> None:
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


def answer(request: dict[str, Any]) -> dict[str, Any]:
    """Return mass, kg, centre, m, and inertia about it, kg m^2, of the body asked for; or what is wrong, in words."""
    kind, path, name = request["kind"], request["path"], request["name"]
    try:
        load(*ENGINES[kind])
        _limit(request["cpu_seconds"])
        found = {"mjcf": read_mjcf, "urdf": read_urdf}[kind](path, name)
    except BadInput as error:
        return {"bad": [error.argument, str(error.got), error.allowed]}
    except MissingEngine as error:
        return {"missing": [error.engine, error.package]}
    except Exception as error:  # an engine's own, and out of memory
        return {"bad": ["path", f"{path!r}: {type(error).__name__}: {error}", f"a file that {ENGINES[kind][2]} reads"]}
    return {"mass": found.mass, "com_B": found.com_B.tolist(), "inertia_com": found.inertia_com.tolist()}


def _limit(cpu_seconds: int) -> None:
    """Set limits of this process that the engine, loaded already, cannot pass."""
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text().split()[0])
        limits = {
            resource.RLIMIT_AS: pages * resource.getpagesize() + MEMORY,
            resource.RLIMIT_CPU: cpu_seconds,
            resource.RLIMIT_CORE: 0,
        }
        for which, most in limits.items():
            resource.setrlimit(which, (most, resource.getrlimit(which)[1]))
    except (ImportError, OSError, ValueError):  # Windows has none of them, and macOS not all
        return


def main() -> None:
    """Read one request and write its answer, past whatever the engine prints."""
    request = json.loads(sys.stdin.read())
    with os.fdopen(os.dup(1), "w") as stdout, Path(os.devnull).open("w") as nothing:
        os.dup2(nothing.fileno(), 1)
        json.dump(answer(request), stdout)
