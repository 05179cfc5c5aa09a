"""Bodies out of model files, read by the engines' own parsers: MJCF by MuJoCo, URDF by Pinocchio.

A body turns about its joint. Bodies welded to it are included; bodies on further joints are not. A free body turns about its
centre of mass. Body axes are those of the MJCF body or of the URDF link. Another process with limits reads the file, because an
MJCF file of one line can contain 10^5 copies of a body, and 10^5 copies of each copy.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from conservative.attitude import Array
from conservative.check import describe, printable_text
from conservative.errors import BadInput, MissingEngine, nearest
from conservative.shapes import MassDistribution

from ..engine import load, version
from ..worker.calls import python_worker
from ..worker.client import EngineCrashed, EngineTimeout, time_limit
from .files import parse
from .pieces import Piece

SECONDS = 60.0
"""Time in seconds that reading a file may take."""
MEMORY = 2 * 2**30
"""Memory in bytes that reading a file may take, including the engine, where the system supports a limit."""
ENGINES = {"mjcf": ("mujoco", "mujoco", "MuJoCo"), "urdf": ("pinocchio", "pin", "Pinocchio")}
"""Module, package and name of the engine that reads a kind of file."""

# Anchors of several joints of a body agree to this, relative to their distance from its origin, or the body has no fixed point.
_SAME_POINT = 1e-9


def body_from_mjcf(path: str | PathLike[str], name: str) -> MassDistribution:
    """Return mass, centre of mass and inertia of a body of an MJCF file, as MuJoCo compiles it.

    Parameters
    ----------
    path
        The file.
    name
        A body with a ball joint, or hinges through one point, which becomes the fixed point; or a body with a free joint, whose
        centre of mass becomes the fixed point.

    Raises
    ------
    BadInput
        The file cannot be read or compiled, has no such body, or its joints do not let it turn about a point.
    MissingEngine
        MuJoCo is not installed.
    """
    return _read("mjcf", path, name)


def body_from_urdf(path: str | PathLike[str], name: str) -> MassDistribution:
    """Return mass, centre of mass and inertia of a link of a URDF file, as Pinocchio reads it.

    Parameters
    ----------
    path
        The file.
    name
        A link moved by a revolute, continuous or spherical joint, whose origin becomes the fixed point; or the root link, which
        is free, so that its centre of mass becomes the fixed point.

    Raises
    ------
    BadInput
        The file cannot be read, has no such link, the link is welded to another, slides, or has no mass.
    MissingEngine
        Pinocchio is not installed.
    """
    return _read("urdf", path, name)


def _read(kind: str, path: object, name: object) -> MassDistribution:
    """Return the body that another process reads. Raise its errors here, and `BadInput` if it exceeds its limits."""
    _, package, engine = ENGINES[kind]
    version(package, engine)
    try:
        text = os.fsdecode(path)  # type: ignore[arg-type]
    except TypeError:
        raise BadInput("path", describe(path), "the path of a file") from None
    if "\0" in text:
        raise BadInput("path", describe(text), "the path of a file, without NUL")
    request = {"kind": kind, "path": text, "name": printable_text("name", name, "the name of a body, a text")}
    worker = python_worker({"OPENBLAS_NUM_THREADS": "1"}, MEMORY)
    try:
        with time_limit(SECONDS):
            answer = worker.ask("call", adapter=__name__, function="read_here", **request)
    except (EngineCrashed, EngineTimeout) as failure:
        allowed = f"a file that {engine} reads within {SECONDS:g} s and {MEMORY / 2**30:g} GiB"
        raise BadInput("path", f"{text!r}, whose reading ended: {failure.outcome}", allowed) from None
    finally:
        worker.close()
    if "bad" in answer:
        raise BadInput(*answer["bad"])
    if "missing" in answer:
        raise MissingEngine(*answer["missing"])
    return MassDistribution(answer["mass"], answer["com_B"], answer["inertia_com"])


# ------------------------------------------------------------------------------------------------ in the other process


def read_here(kind: str, path: str, name: str) -> dict[str, Any]:
    """Return mass, kg, centre, m, and inertia about it, kg m^2, of a body, or the arguments of the exception to raise."""
    try:
        body = {"mjcf": read_mjcf, "urdf": read_urdf}[kind](path, name)
    except BadInput as error:
        return {"bad": [error.argument, str(error.got), error.allowed]}
    except MissingEngine as error:
        return {"missing": [error.engine, error.package]}
    except Exception as error:  # of the engine, or out of memory
        return {"bad": ["path", f"{path!r}: {type(error).__name__}: {error}", f"a file that {ENGINES[kind][2]} reads"]}
    return {"mass": body.mass, "com_B": body.com_B, "inertia_com": body.inertia_com}


def read_mjcf(path: str, name: str) -> MassDistribution:
    """Return the body of an MJCF file, as `body_from_mjcf`."""
    mj = load(*ENGINES["mjcf"])
    _require_xml(path, "mujoco")
    try:
        model = mj.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise _unusable(path, error, "an MJCF file that MuJoCo compiles") from None
    names = [model.body(number).name for number in range(1, model.nbody)]
    _require_name(path, name, names)
    data = mj.MjData(model)  # in the reference configuration
    mj.mj_kinematics(model, data)
    body = model.body(name).id
    origin, R_WB = data.xpos[body], data.xmat[body].reshape(3, 3)
    welded = model.body_weldid == body
    masses, R_BI = model.body_mass[welded], R_WB.T @ data.ximat[welded].reshape(-1, 3, 3)
    mass, places = masses.sum(), (data.xipos[welded] - origin) @ R_WB
    com = masses @ places / mass
    d = places - com
    inertia = ((R_BI * model.body_inertia[welded][:, None]) @ R_BI.swapaxes(1, 2)).sum(axis=0)
    inertia += np.einsum("n,ni,ni", masses, d, d) * np.eye(3) - (d.T * masses) @ d
    fixed_point = _mujoco_fixed_point(mj, model, data, body)
    lever = np.zeros(3) if fixed_point is None else com - R_WB.T @ (fixed_point - origin)
    return MassDistribution(mass, lever, inertia)


def _mujoco_fixed_point(mj: Any, model: Any, data: Any, body: int) -> Array | None:
    """Return the fixed point of the body's joints (3,), m, world axes; None if the body is free."""
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    joints = range(first, first + count)
    if any(model.jnt_type[joint] == int(mj.mjtJoint.mjJNT_FREE) for joint in joints):
        return None
    turning = (int(mj.mjtJoint.mjJNT_BALL), int(mj.mjtJoint.mjJNT_HINGE))  # NumPy's integers never equal the enumeration's
    anchors = np.array([data.xanchor[joint] for joint in joints if model.jnt_type[joint] in turning])
    if not len(anchors):
        owners = model.jnt_bodyid[np.isin(model.jnt_type, turning)]
        raise _not_turning(model.body(body).name, [model.body(owner).name for owner in np.unique(owners)])
    spread = np.abs(anchors - anchors[0]).max()
    if spread > _SAME_POINT * max(1.0, float(np.abs(anchors - data.xpos[body]).max())):
        allowed = "a body whose ball joint or hinges go through one point"
        raise BadInput("name", f"{model.body(body).name!r}, whose joints turn about points {spread:.3g} m apart", allowed)
    return anchors[0]


def read_urdf(path: str, name: str) -> MassDistribution:
    """Return the link of a URDF file, as `body_from_urdf`."""
    bodies = urdf_bodies(path)
    pin = load(*ENGINES["urdf"])
    _require_name(path, name, [frame.name for frame in _build(pin, path).frames if frame.type == pin.FrameType.BODY])
    able = [each for each, (_, kind) in bodies.items() if kind.startswith(_TURNING)]
    if name not in able:
        raise _not_turning(name, sorted(able))
    part, kind = bodies[name]
    if not part.mass > 0:
        raise BadInput("name", f"{name!r}, which has no mass", "a link with mass and inertia")
    return MassDistribution(part.mass, np.zeros(3) if kind == _FREE else part.com, part.inertia)


_FREE = "JointModelFreeFlyer"
_TURNING = ("JointModelR", "JointModelSpherical", _FREE)


def urdf_bodies(path: str) -> dict[str, tuple[Piece, str]]:
    """Return the bodies of a URDF file as urdfdom reads it, by the names of their links, and the joint that moves each.

    A link and those welded to it are one body, in the axes of the link. Raise `BadInput` and `MissingEngine`.
    """
    pin = load(*ENGINES["urdf"])
    _require_xml(path, "robot")
    model = _build(pin, path)
    owners = [
        frame
        for frame in model.frames
        if frame.type == pin.FrameType.BODY and model.frames[frame.parentFrame].type == pin.FrameType.JOINT
    ]
    inertias = [(frame, model.inertias[frame.parentJoint]) for frame in owners]
    return {
        frame.name: (Piece(of.mass, np.array(of.lever), np.array(of.inertia)), model.joints[frame.parentJoint].shortname())
        for frame, of in inertias
    }


def _build(pin: Any, path: str) -> Any:
    try:
        return pin.buildModelFromUrdf(path, pin.JointModelFreeFlyer())
    except ValueError as error:
        raise _unusable(path, error, "a URDF file that Pinocchio reads") from None


def _require_xml(path: str, root: str) -> None:
    """Raise `BadInput` unless a file is safe XML with the right root. The engines' own messages say less."""
    try:
        parse(Path(path), root)
    except BadInput as error:
        raise BadInput("path", error.got, error.allowed) from None


def _unusable(path: str, reason: object, allowed: str) -> BadInput:
    return BadInput("path", f"{str(path)!r}: {' '.join(str(reason).split())}", allowed)


def _require_name(path: str, name: str, known: Iterable[str]) -> None:
    if name not in known:
        raise BadInput("name", f"{name!r}, which is not in {str(path)!r}", nearest(name, known))


def _not_turning(name: str, others: list[str]) -> BadInput:
    allowed = "one that a joint turns" + (": " + ", ".join(others) if others else "; this file has none")
    return BadInput("name", f"{name!r}, which no joint turns", allowed)
