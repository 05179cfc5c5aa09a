"""Bodies out of model files, read by the engines' own parsers: MJCF by MuJoCo, URDF by Pinocchio.

A body turns about its joint. What is welded to it moves with it and counts; what hangs on further joints does not. A body that
is free turns about its centre of mass. Body axes are the file's own: those of the MJCF body or of the URDF link. A file is read
in a process of its own, which has limits: an MJCF file of one line can ask for 10^5 copies of a body, and of those again.
Source: the two formats' documentation.
"""

from __future__ import annotations

import json
import os
import subprocess
from os import PathLike
from typing import Any

from conservative.check import describe, printable_text
from conservative.errors import BadInput, MissingEngine
from conservative.shapes import MassDistribution

from ..engine import version
from ..worker import python_command
from . import model_reader
from .model_reader import CPU_SECONDS, ENGINES, MEMORY

SECONDS = 60.0
"""Time, s, after which a reader is ended, whatever it does: three times `CPU_SECONDS`, for busy machines."""


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
    return _read("mjcf", path, name)


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
    return _read("urdf", path, name)


def _read(kind: str, path: object, name: object) -> MassDistribution:
    """Return the body that a reader in a process of its own finds; raise what it says, here."""
    _, package, engine = ENGINES[kind]
    version(package, engine)
    request = {"kind": kind, "path": _text_of(path), "name": printable_text("name", name, "the name of a body, a text")}
    found = _ask({**request, "cpu_seconds": CPU_SECONDS})
    if "bad" in found:
        raise BadInput(*found["bad"])
    if "missing" in found:
        raise MissingEngine(*found["missing"])
    return MassDistribution(found["mass"], found["com_B"], found["inertia_com"])


def _text_of(path: object) -> str:
    try:
        text = os.fsdecode(path)  # type: ignore[arg-type]
    except TypeError:
        raise BadInput("path", describe(path), "the path of a file") from None
    if "\0" in text:
        raise BadInput("path", describe(text), "the path of a file, without NUL")
    return text


def _ask(request: dict[str, Any]) -> dict[str, Any]:
    """Return the answer of a reader; raise `BadInput` where its limits end it."""
    command = python_command(f"from {model_reader.__name__} import main; main()")
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    try:
        done = subprocess.run(
            command, input=json.dumps(request).encode(), capture_output=True, timeout=SECONDS, env=environment, check=False
        )
    except subprocess.TimeoutExpired:
        raise _unreadable(request, f"{SECONDS:g} s") from None
    except OSError as error:  # no memory for a process, or no Python where one is embedded
        raise _unreadable(request, f"a reader that does not start: {error}") from None
    if done.returncode != 0:
        raise _unreadable(request, f"exit status {done.returncode} of the reader")
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def _unreadable(request: dict[str, Any], end: str) -> BadInput:
    allowed = f"a file that {ENGINES[request['kind']][2]} reads within {CPU_SECONDS} s and {MEMORY / 2**30:g} GiB"
    return BadInput("path", f"{request['path']!r}, whose reading ended after {end}", allowed)
