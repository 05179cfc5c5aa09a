"""Mistakes of loaders of model files: each changes the links of a file, or the whole body, to what an engine has instead."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import permutations
from typing import Any, ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array
from conservative.references.model_files.mjcf import OPTIONS
from conservative.references.model_files.pieces import Link, Piece, join_links, make_pose, steiner

from .mistake import Mistake, Number
from .scenes import SCENES

Links = list[Link]


@dataclass(frozen=True)
class BodyMistake(Mistake):
    """A mistake of a loader: the change from the links of a file to those that the loader makes."""

    kind: ClassVar[str] = "bodies"
    change: Callable[[Links], Links]


@dataclass(frozen=True)
class FittedBodyMistake(Mistake):
    """A mistake of a loader with numbers.

    `fit` returns the numbers that turn the body of a file into the one that an engine has, in SI units, and the body with them.
    """

    kind: ClassVar[str] = "bodies"
    fit: Callable[[Piece, Piece], tuple[Mapping[str, float], Piece]]


@dataclass(frozen=True)
class FileMistake(Mistake):
    """A mistake of the author of a model file in one link: the change of a right link, planted with given numbers."""

    kind: ClassVar[str] = "bodies"
    change: Callable[..., Link]


def _all(change: Callable[[Link], dict[str, Any]]) -> Callable[[Links], Links]:
    return lambda links: [replace(link, **change(link)) for link in links]


def _children(change: Callable[[Link], dict[str, Any]]) -> Callable[[Links], Links]:
    return lambda links: [links[0], *(replace(link, **change(link)) for link in links[1:])]


def _ordered(link: Link, order: Sequence[int]) -> dict[str, Any]:
    moments, axes = np.linalg.eigh(link.inertia)
    return {"inertia": (axes * moments[list(order)]) @ axes.T}


def _transposed(link: Link) -> dict[str, Any]:
    moments, axes = np.linalg.eigh(link.inertia)
    return {"inertia": (axes.T * moments) @ axes}


def _from_geometry(link: Link, mass: float, com: bool) -> dict[str, Any]:
    if not link.geometry.mass:
        return {}
    part = link.geometry.scale(mass / link.geometry.mass)
    return {"mass": mass, "frame": make_pose(part.com if com else link.frame[:3, 3]), "inertia": part.inertia}


def _moved(link: Link, sign: float) -> dict[str, Any]:
    return {"inertia": link.inertia + sign * steiner(link.mass, link.frame[:3, :3].T @ link.frame[:3, 3])}


def _collapsed(links: Links) -> Links:
    whole, root = join_links(links), join_links(links[:1])
    others = [replace(link, frame=make_pose(R=link.frame[:3, :3])) for link in links[1:]]
    moved = sum((join_links([link]).inertia + steiner(link.mass, link.pose[:3, 3]) for link in others), root.inertia)
    return [Link(np.eye(4)).filled(replace(whole, inertia=moved))]


def _steiner(links: Links, outer: float, sign: float = 1.0) -> Links:
    """Join links by a parallel axis theorem of another sign, or with another factor of d d'."""
    whole, parts = join_links(links), [join_links([link]) for link in links]
    away = [(part.mass, part.com - whole.com) for part in parts]
    terms = [sign * steiner(mass, d) + outer * mass * np.outer(d, d) for mass, d in away]
    inertia = sum((part.inertia + term for part, term in zip(parts, terms, strict=True)), np.zeros((3, 3)))
    return [Link(np.eye(4)).filled(replace(whole, inertia=inertia))]


def _other_angles(factor: float) -> Callable[[Links], Links]:
    """Return the change that multiplies the angles about fixed axes of all poses, as far as a rotation determines them."""

    def turn(pose: Array) -> Array:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # SciPy warns if two axes coincide
            angles = Rotation.from_matrix(pose[:3, :3]).as_euler("xyz")
        return make_pose(pose[:3, 3], Rotation.from_euler("xyz", factor * angles))

    return _all(lambda k: {"frame": turn(k.frame), "pose": turn(k.pose)})


def _without(links: Links, option: str) -> Links:
    """Return the links that follow without an option of the file."""
    return [link.filled(link.without[option]) if option in link.without else link for link in links]


def _of_scenes(key: str, change: Callable[[Links], Links]) -> BodyMistake:
    """Return a mistake that scenes have as well, with its effect on links."""
    return BodyMistake(key, next(scene.sentence for scene in SCENES if scene.key == key), change)


LOADED: tuple[BodyMistake, ...] = (
    BodyMistake(
        "inertial frame not turned",
        "The rotation of the inertial frame is ignored",
        _all(lambda k: {"frame": make_pose(k.frame[:3, 3])}),
    ),
    BodyMistake(
        "inertia turned on one side",
        "The inertia is R I instead of R I R'",
        _all(lambda k: {"frame": make_pose(k.frame[:3, 3]), "inertia": k.frame[:3, :3] @ k.inertia}),
    ),
    BodyMistake(
        "inertial frame inverted",
        "The rotation of the inertial frame is inverted",
        _all(lambda k: {"frame": make_pose(k.frame[:3, 3], k.frame[:3, :3].T)}),
    ),
    _of_scenes("no products of inertia", _all(lambda k: {"inertia": np.diag(np.diag(k.inertia))})),
    _of_scenes("sign of the products of inertia", _all(lambda k: {"inertia": 2 * np.diag(np.diag(k.inertia)) - k.inertia})),
    BodyMistake("principal axes transposed", "The principal axes are transposed", _all(_transposed)),
    *(
        BodyMistake(
            f"moments in the order {a} {b} {c}",
            f"The principal moments, in ascending order, are used in the order {a}, {b}, {c}",
            _all(partial(_ordered, order=(a - 1, b - 1, c - 1))),
        )
        for a, b, c in list(permutations((1, 2, 3)))[1:]
    ),
    BodyMistake(
        "inertia of the geometry",
        "The inertia is computed from the geometry",
        _all(lambda k: _from_geometry(k, k.mass, False)),
    ),
    BodyMistake(
        "inertia and centre of the geometry",
        "Inertia and centre of mass are computed from the geometry",
        _all(lambda k: _from_geometry(k, k.mass, True)),
    ),
    BodyMistake(
        "mass of the geometry",
        "Mass and inertia are computed from the geometry at 1000 kg/m^3",
        _all(lambda k: _from_geometry(k, k.geometry.mass, True)),
    ),
    *(
        BodyMistake(f"{option} ignored", f"`{option}` is ignored", partial(_without, option=option))
        for option in (*OPTIONS, "shellinertia")
    ),
    BodyMistake("inertia about the origin", "The inertia is taken about the origin of the link", _all(lambda k: _moved(k, -1))),
    BodyMistake("inertia moved twice", "The inertia is moved away from the centre of mass", _all(lambda k: _moved(k, 1))),
    BodyMistake(
        "centre of mass at the origin",
        "The centre of mass is at the origin of the link",
        _all(lambda k: {"frame": make_pose(R=k.frame[:3, :3])}),
    ),
    BodyMistake(
        "no mass of fixed children",
        "The mass of fixed children is lost",
        _children(lambda k: {"mass": 0.0, "inertia": np.zeros((3, 3))}),
    ),
    BodyMistake(
        "no inertia of fixed children",
        "The inertia of fixed children is lost",
        _children(lambda k: {"inertia": np.zeros((3, 3))}),
    ),
    BodyMistake(
        "fixed children not turned",
        "The rotation of fixed children is ignored",
        _children(lambda k: {"pose": make_pose(k.pose[:3, 3])}),
    ),
    BodyMistake(
        "fixed children not moved",
        "The position of fixed children is ignored",
        _children(lambda k: {"pose": make_pose(R=k.pose[:3, :3])}),
    ),
    BodyMistake(
        "fixed children about the root",
        "Fixed children are moved to the origin of the root link, not to the common centre of mass",
        _collapsed,
    ),
    BodyMistake(
        "sign in the parallel axis theorem",
        "d d' has the wrong sign in the parallel axis theorem",
        partial(_steiner, outer=2.0),
    ),
    BodyMistake(
        "sign of the parallel axis theorem",
        "The term of the parallel axis theorem has the wrong sign",
        partial(_steiner, outer=0.0, sign=-1.0),
    ),
    BodyMistake(
        "unit mass of empty links",
        "Links without inertia have mass 1 and the unit inertia",
        _all(lambda k: {} if k.mass else {"mass": 1.0, "inertia": np.eye(3)}),
    ),
    BodyMistake("no inertia", "The inertia is lost", _all(lambda k: {"inertia": np.zeros((3, 3))})),
    BodyMistake("unit inertia", "The inertia is the unit matrix", _all(lambda k: {"inertia": np.eye(3)})),
    BodyMistake("unit mass", "Mass and inertia are 1", _all(lambda k: {"mass": 1.0, "inertia": np.eye(3)})),
    BodyMistake(
        "mean of the moments",
        "The three moments are replaced by their mean",
        _all(lambda k: {"inertia": np.trace(k.inertia) / 3 * np.eye(3)}),
    ),
    BodyMistake("degrees as radians", "Degrees are read as radians", _other_angles(180 / math.pi)),
    BodyMistake("radians as degrees", "Radians are read as degrees", _other_angles(math.pi / 180)),
)
"""Known mistakes of loaders."""


def _fit_factors(wanted: Piece, seen: Piece) -> tuple[Mapping[str, float], Piece]:
    """Fit factors of mass, lengths and inertia, as wrong units have them."""
    square = wanted.com @ wanted.com
    centre = float(seen.com @ wanted.com / square) if square else 1.0
    mass, inertia = seen.mass / wanted.mass, float(np.trace(seen.inertia) / np.trace(wanted.inertia))
    numbers = {"mass": mass, "centre": centre, "inertia": inertia}
    return numbers, replace(wanted, mass=seen.mass, com=centre * wanted.com, inertia=inertia * wanted.inertia)


def _fit_raised(wanted: Piece, seen: Piece) -> tuple[Mapping[str, float], Piece]:
    """Fit the smallest moment, kg m^2, that an engine takes."""
    moments, axes = np.linalg.eigh(wanted.inertia)
    floor = float(np.diag(axes.T @ seen.inertia @ axes).min())
    raised = np.maximum(moments, floor)
    return {"moment": floor}, replace(wanted, inertia=(axes * raised) @ axes.T)


def _fit_equal(wanted: Piece, seen: Piece) -> tuple[Mapping[str, float], Piece]:
    """Fit one moment, kg m^2, about all axes."""
    moment = float(np.trace(seen.inertia)) / 3
    return {"moment": moment}, replace(wanted, inertia=moment * np.eye(3))


_MOMENT = (Number("moment", 0.0, "kg m^2"),)
FITTED: tuple[FittedBodyMistake, ...] = (
    FittedBodyMistake(
        "moments raised", "Small principal moments are raised to {moment:.6g} kg m^2", _fit_raised, numbers=_MOMENT
    ),
    FittedBodyMistake("equal moments", "The moment about all axes is {moment:.6g} kg m^2", _fit_equal, numbers=_MOMENT),
    FittedBodyMistake(
        "factors",
        "The mass is multiplied by {mass:.6g}, the centre of mass by {centre:.6g}, the inertia by {inertia:.6g}",
        _fit_factors,
        numbers=(Number("mass", 1.0), Number("centre", 1.0), Number("inertia", 1.0)),
    ),
)
"""Mistakes whose numbers follow from the body that an engine has, those with fewer numbers first."""


def _with_inertia(link: Link, change: Callable[[Array], Array]) -> Link:
    return replace(link, inertia=change(link.inertia))


def _beyond(inertia: Array) -> Array:
    """Return an inertia whose largest moment exceeds the sum of the others by a fifth."""
    moments, axes = np.linalg.eigh(inertia)
    moments[2] = 1.2 * (moments[0] + moments[1])
    return (axes * moments) @ axes.T


def _sign_of_products(inertia: Array) -> Array:
    return 2 * np.diag(np.diag(inertia)) - inertia


FILES: tuple[FileMistake, ...] = (
    FileMistake(
        "impossible inertia",
        "No body has this inertia",
        lambda link: _with_inertia(link, _beyond),
        remedy="compute it again from the drawing, about the centre of mass and in the axes of the inertial frame",
    ),
    FileMistake(
        "placeholder inertia",
        "The inertia is a placeholder",
        lambda link, moment=0.001: _with_inertia(link, lambda inertia: moment * np.eye(3)),
        remedy="compute it from the drawing or from the shapes at this mass",
    ),
    FileMistake(
        "decimal slip",
        "A number is too large or too small by a power of ten",
        lambda link, power=-1.0: _with_inertia(link, lambda inertia: inertia / 10.0**power),
        numbers=(Number("power"),),
    ),
    FileMistake(
        "inertia too small",
        "The inertia is smaller than any mass distribution in these shapes has, or than any material allows",
        lambda link, factor=0.001: _with_inertia(link, lambda inertia: factor * inertia),
        remedy="check the units (kg, m) and the mass",
    ),
    FileMistake(
        "inertia outside the shapes",
        "The radius of gyration is outside the shapes",
        lambda link, factor=50.0: _with_inertia(link, lambda inertia: factor * inertia),
        remedy="check if the inertia is about the centre of mass, and its units (kg, m)",
    ),
    FileMistake(
        "centre of mass outside the shapes",
        "The centre of mass is outside the shapes",
        lambda link, distance=1.0: replace(link, frame=make_pose((distance, 0, 0)) @ link.frame),
        remedy="check the axes and the unit (m) of the centre of mass",
    ),
    FileMistake(
        "twins differ",
        "Left and right differ",
        lambda link, factor=2.0: replace(link, mass=factor * link.mass),
    ),
    FileMistake(
        "no inertial element",
        "A body that a joint moves has no mass",
        lambda link: replace(link, mass=0.0, inertia=np.zeros((3, 3))),
        remedy="add mass and inertia, or fix the joint",
    ),
    FileMistake(
        "no inertia",
        "The inertia is lost",
        lambda link: replace(link, inertia=np.zeros((3, 3))),
        remedy="compute it from the drawing or from the shapes at this mass",
    ),
    FileMistake(
        "sign of the products of inertia",
        next(scene.sentence for scene in SCENES if scene.key == "sign of the products of inertia"),
        lambda link: _with_inertia(link, _sign_of_products),
        remedy="some programs write products with the other sign: the tensor has minus the integral of x y",
    ),
)
"""Known mistakes of authors of model files. The last two are mistakes of loaders and scenes as well."""
