"""Bodies out of model files (URDF, SDF, MJCF, USD) for scene files, by the readers of `conservative verify`.

A body turns about its joint. Bodies welded to it are included; bodies on further joints are not. A free body turns about its
centre of mass. Body axes are the axes of the link, or of the body of MJCF or USD.
"""

from __future__ import annotations

import os
from functools import partial
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from conservative.attitude import Array
from conservative.check import describe, printable_text
from conservative.errors import BadInput, nearest
from conservative.shapes import MassDistribution

from .files import ROOTS
from .readers import Model, read_files

FREE = ("free", "floating")
TURNING = ("revolute", "continuous", "ball", "spherical", "universal", "hinge", "revolute2")
"""Kinds of joints with a fixed point, in the formats' words."""

# Anchors of several joints of a body agree to this, relative to their distance from its origin, or the body has no fixed point.
_SAME_POINT = 1e-9


def body_from_file(path: str | PathLike[str], name: str, kind: str) -> MassDistribution:
    """Return mass, centre of mass and inertia of a body of a model file.

    Parameters
    ----------
    path
        The file.
    name
        A link or body whose joints turn about one point, which becomes the fixed point. For a free one, the centre of mass
        becomes the fixed point. In USD, the path of a prim.
    kind
        "urdf", "mjcf", "sdf" or "usd".

    Raises
    ------
    BadInput
        The file is of another kind or cannot be read, has no such body, its readers disagree about it, no body has its mass and
        inertia, or its joints do not let it turn about a point.
    MissingExtra
        lxml, trimesh or usd-core is not installed.
    """
    try:
        text = os.fsdecode(path)
    except TypeError:
        raise BadInput("path", describe(path), "the path of a file") from None
    if "\0" in text:
        raise BadInput("path", describe(text), "the path of a file, without NUL")
    printable_text("name", name, "the name of a body, a text")
    try:
        with TemporaryDirectory() as folder:
            models = read_files([Path(text)], Path(folder))
    except BadInput as error:
        raise BadInput("path", error.got, error.allowed) from None
    roots = {kind_of_root: f"root element <{tag}>" for tag, kind_of_root in ROOTS.items()} | {"usd": "USD"}
    if models[0].kind != kind:
        raise BadInput("path", f"{text!r}: {roots[models[0].kind]}", f"a file with {roots[kind]}" if kind != "usd" else "USD")
    model = next((loaded for loaded in models if loaded.body.name == name), None)
    able = [loaded.body.name for loaded in models if _turns(loaded)]
    if model is None and not any(name == link.name for loaded in models for link in loaded.links):
        raise BadInput("name", f"{name!r}, which is not in {text!r} with a mass", nearest(name, able))
    if model is None or not _turns(model):
        allowed = "one that a joint turns" + (": " + ", ".join(sorted(able)) if able else "; this file has none")
        raise BadInput("name", f"{name!r}, which no joint turns", allowed)
    part = model.truth
    if model.flaw:
        raise BadInput("name", f"{name!r}: {model.flaw}", "a link with a mass and an inertia that a body can have")
    if wrong := model.disagree or "; ".join(model.invalid):
        raise BadInput("name", f"{name!r}: {wrong}", "a body that the file describes in one way")
    lever = part.com - _fixed_point(model)
    return MassDistribution(part.mass, lever, part.inertia)


def _turns(model: Model) -> bool:
    """Return whether a body is free or has a joint that turns."""
    kinds = {kind for kind, _ in model.body.pivots}
    return not kinds or bool(kinds.intersection((*FREE, *TURNING)))


def _fixed_point(model: Model) -> Array:
    """Return the fixed point of a body (3,), m, in its axes; its centre of mass if it is free. Raise `BadInput`."""
    pivots = model.body.pivots
    if not pivots or any(kind in FREE for kind, _ in pivots):
        return model.truth.com
    anchors = np.array([place for kind, place in pivots if kind in TURNING])
    spread = np.abs(anchors - anchors[0]).max()
    if spread > _SAME_POINT * max(1.0, float(np.abs(anchors).max())):
        allowed = "a body whose ball joint or hinges go through one point"
        raise BadInput("name", f"{model.body.name!r}, whose joints turn about points {spread:.3g} m apart", allowed)
    return np.array(anchors[0])


body_from_urdf, body_from_sdf, body_from_mjcf, body_from_usd = (
    partial(body_from_file, kind=kind) for kind in ("urdf", "sdf", "mjcf", "usd")
)
