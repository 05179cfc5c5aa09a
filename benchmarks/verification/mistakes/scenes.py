"""Scenes: the motion is right for another scene. A part is missing, reversed or of another size, or the start is misread."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar

import numpy as np

from conservative.attitude import Array, from_quaternion, to_quaternion
from conservative.body import RigidBody
from conservative.check import build_unchecked, read_only, replace_unchecked
from conservative.potentials.load import FRAMES
from conservative.potentials.turning import Orbit, Turning, static_part
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene

from .mistake import Mistake, Number
from .readings import TO_Y_UP

GRAVITY = 9.81
"""Acceleration, m/s^2, with which a weight is a mass."""
SMALLEST = 1e-6
"""Smallest principal moment of some engines, kg m^2."""
Change = Callable[..., Scene | None]
"""From a scene and numbers to the one that was simulated; None if it is the same, or if there is none."""


@dataclass(frozen=True)
class SceneMistake(Mistake):
    """Another scene. With `start` its initial state differs, which the first row of a recording shows."""

    kind: ClassVar[str] = "scenes"
    change: Change
    start: bool = False


def changed(scene: Scene, **changes: Any) -> Scene | None:
    """Return the scene with other fields; None if it is the same motion."""
    other = scene.rename(scene.name, **changes)
    return None if other.key == scene.key else other


def body_of(inertia: Array, rotor: Any = None, motor: Any = None) -> RigidBody:
    """Return a body that a search tries. It may be one that no mass distribution has, without a warning."""
    tensor = read_only(np.array(inertia, float))
    return build_unchecked(RigidBody, inertia=tensor, rotor_momentum=rotor, motor=motor)


def with_inertia(scene: Scene, inertia: Array) -> Scene | None:
    """Return the scene with another inertia, also in a field that depends on it; None for one that is no inertia."""
    if np.linalg.eigvalsh(inertia)[0] <= 0:
        return None
    field, fixed = scene.potential, static_part(scene.potential)
    if hasattr(fixed, "inertia"):
        other: Any = replace(fixed, inertia=inertia)
        field = replace(field, potential=other) if isinstance(field, Turning) else other
    body = body_of(inertia, scene.body.rotor_momentum, scene.body.motor)
    return changed(scene, body=body, potential=field)


def _rotor(scene: Scene, factor: float) -> Scene | None:
    body = scene.body
    if body.rotor_momentum is None and body.motor is None:
        return None
    if factor == 0:
        return changed(scene, body=body_of(body.inertia))
    momentum = None if body.rotor_momentum is None else read_only(factor * body.rotor_momentum)
    motor = body.motor and body.motor.in_units(1 / factor, 1.0)
    return changed(scene, body=body_of(body.inertia, momentum, motor))


def _torque(scene: Scene, factor: float) -> Scene | None:
    if scene.torque is None:
        return None
    return changed(scene, torque=scene.torque.in_units(1 / factor, 1.0) if factor else None)


def _damping(scene: Scene, factor: float) -> Scene | None:
    if scene.damping is None:
        return None
    return changed(scene, damping=scene.damping.in_units(1 / factor, 1.0) if factor else None)


def _turn_torque(scene: Scene) -> Scene | None:
    if scene.torque is None:
        return None
    return changed(scene, torque=replace_unchecked(scene.torque, frame=FRAMES[scene.torque.frame == FRAMES[0]]))


def _orbit(scene: Scene, factor: float) -> Scene | None:
    field = scene.potential
    if not isinstance(field, Turning):
        return None
    fixed: Any = field.potential
    if getattr(fixed, "rate", None) == field.orbit.rate:  # the gradient of a circular orbit has the rate of the orbit
        fixed = replace(fixed, rate=fixed.rate * factor)
    return changed(scene, potential=Turning(fixed, Orbit(field.orbit.rate * factor, field.orbit.normal_W)))


def _products(scene: Scene, factor: float) -> Scene | None:
    J = scene.body.inertia
    diagonal = np.diag(np.diag(J))
    return None if np.array_equal(J, diagonal) else with_inertia(scene, diagonal + factor * (J - diagonal))


def _smallest(scene: Scene) -> Scene | None:
    """Return the scene with principal moments of at least `SMALLEST`; None if they are."""
    J, R = np.maximum(scene.body.moments, SMALLEST), scene.body.R_BP
    return None if (scene.body.moments >= SMALLEST).all() else with_inertia(scene, R @ np.diag(J) @ R.T)


def _inverted(scene: Scene) -> Scene | None:
    """Return the scene with the inverse inertia. The field of a satellite keeps the inertia."""
    return changed(scene, body=body_of(scene.body.inverse, scene.body.rotor_momentum, scene.body.motor))


def _central(scene: Scene) -> Scene | None:
    """Return the scene of a heavy body with its inertia about the centre of mass."""
    field = scene.potential
    if not isinstance(field, UniformGravity):
        return None
    c, mass = field.com_B, abs(field.weight) / GRAVITY
    return with_inertia(scene, scene.body.inertia - mass * (c @ c * np.eye(3) - np.outer(c, c)))


def _central_moments(scene: Scene, share: float) -> Scene | None:
    """Return a heavy body that has the principal moments about the centre of mass about the axes of the fixed point.

    `share` is its mass over the largest one that the scene allows: m c' S^-1 c <= 1 with S = tr(J)/2 - J.
    """
    field, J = scene.potential, scene.body.inertia
    second = np.eye(3) * np.trace(J) / 2 - J
    if not isinstance(field, UniformGravity) or not field.com_B.any() or np.linalg.eigvalsh(second)[0] <= 1e-15 * np.trace(J):
        return None
    c = field.com_B
    central = J - share / float(c @ np.linalg.solve(second, c)) * (c @ c * np.eye(3) - np.outer(c, c))
    return with_inertia(scene, np.diag(body_of(central).moments)) if np.linalg.eigvalsh(central)[0] > 0 else None


def _start(scene: Scene, change: Callable[[Array, Array], tuple[Array, Array]]) -> Scene | None:
    R, w = change(scene.R_WB0, scene.w_WB_B0)
    return changed(scene, R_WB0=R, w_WB_B0=w)


WITHOUT = {
    "the rotor": lambda scene: changed(scene, body=body_of(scene.body.inertia)),
    "the torque": lambda scene: changed(scene, torque=None),
    "the damping": lambda scene: changed(scene, damping=None),
    "the field": lambda scene: changed(scene, potential=None),
}
"""The parts of a scene that can be missing, also several at once."""
PARTS = tuple(
    SceneMistake(
        f"without {name}", f"It is the motion without {name}", change, remedy=f'use {name}, or answer "unsupported"'
    )
    for name, change in WITHOUT.items()
)  # fmt: skip
FACTOR = (Number("factor", 1.0),)
SIZES = (
    *(
        SceneMistake(
            f"size of {name}",
            f"{text} is {{factor:.5g}} times the scene's",
            change,
            numbers=FACTOR,
            remedy=f"check the units of {name}, SI",
        )
        for name, text, change in (
            ("the rotor", "The wheel's momentum", _rotor),
            ("the torque", "The torque", _torque),
            ("the damping", "The damping", _damping),
        )
    ),
    SceneMistake(
        "rate of the orbit",
        "The rate of the orbit is {factor:.8g} times the scene's",
        _orbit,
        numbers=FACTOR,
        remedy="check the unit of the rate, rad/s",
    ),
)
SCENES = (
    *PARTS,
    *SIZES,
    SceneMistake(
        "sign of the rotor",
        "The momentum of the rotor has the other sign",
        partial(_rotor, factor=-1.0),
        remedy="the momentum is J w + h",
    ),
    SceneMistake(
        "turning of the field",
        "The field does not turn",
        lambda scene: changed(scene, potential=static_part(scene.potential)),
        remedy="turn the field with the orbit at each time",
    ),
    SceneMistake(
        "sign of the torque",
        "The torque has the other sign",
        partial(_torque, factor=-1.0),
        remedy="J w' = (J w) x w + T",
    ),
    SceneMistake(
        "axes of the torque",
        "The components of the torque are taken in the other axes, world instead of body or the reverse",
        _turn_torque,
        remedy="T_B = R' T_W",
    ),
    SceneMistake(
        "sign of the damping",
        "The damping has the other sign",
        partial(_damping, factor=-1.0),
        remedy="J w' = (J w) x w - D w",
    ),
    SceneMistake(
        "no products of inertia",
        "The products of inertia are dropped",
        partial(_products, factor=0.0),
        remedy="use the whole tensor, or principal axes",
    ),
    SceneMistake(
        "sign of the products of inertia",
        "The products of inertia have the other sign",
        partial(_products, factor=-1.0),
        remedy="the matrix has minus the sums of m x y beside the diagonal",
    ),
    SceneMistake(
        "inverted inertia", "The inertia is inverted: J w' = (J w) x w with the inverse of J", _inverted,
        remedy="J w' = (J w) x w with J = `moments`",
    ),
    SceneMistake(
        "inertia about the centre of mass",
        "The inertia is about the centre of mass instead of the fixed point",
        _central,
        remedy="`moments` are about the fixed point",
    ),
    SceneMistake(
        "moments about the centre of mass",
        "The principal moments about the centre of mass are used as the moments about the fixed point",
        _central_moments,
        numbers=(Number("mass share", 15 / 16),),  # the share of bodies in PROTOCOL.md
        remedy="`moments` are about the fixed point",
    ),
    SceneMistake(
        "smallest moments",
        f"Moments of inertia below {SMALLEST:g} kg m^2 are replaced by {SMALLEST:g} kg m^2",
        _smallest,
        remedy="lower the least moment of the engine, or scale the units of mass or length",
    ),
    SceneMistake(
        "start in order xyzw",
        "The initial quaternion is read as x, y, z, w",
        partial(_start, change=lambda R, w: (from_quaternion(np.roll(to_quaternion(R), 1)), w)),
        start=True,
        remedy="your engine reads xyzw: reorder `q0`, whose scalar comes first",
    ),
    SceneMistake(
        "start in order wxyz",
        "The initial quaternion is read as w, x, y, z, but its scalar is last",
        partial(_start, change=lambda R, w: (from_quaternion(np.roll(to_quaternion(R), -1)), w)),
        start=True,
        remedy="your engine reads wxyz: reorder `q0`, whose scalar comes last here",
    ),
    SceneMistake(
        "start transposed",
        "The initial attitude is read transposed",
        partial(_start, change=lambda R, w: (R.T, w)),
        start=True,
        remedy="v_W = R0 v_F",
    ),
    SceneMistake(
        "start in world rates",
        "The initial rates are read in world axes",
        partial(_start, change=lambda R, w: (R, R.T @ w)),
        start=True,
        remedy="`w0` is in F",
    ),
    SceneMistake(
        "start in degrees",
        "The initial rates are read in deg/s",
        partial(_start, change=lambda R, w: (R, np.deg2rad(w))),
        start=True,
        remedy="`w0` is in rad/s",
    ),
    SceneMistake(
        "start in a world with y up",
        "The initial attitude is read in a world whose second axis is up",
        partial(_start, change=lambda R, w: (TO_Y_UP.T @ R, w)),
        start=True,
        remedy="the third axis of W is up",
    ),
)  # fmt: skip


@dataclass(frozen=True)
class OtherBody(Mistake):
    """The motion of another body, whose inertia is fitted."""

    kind: ClassVar[str] = "bodies"


@dataclass(frozen=True)
class SceneDigits(Mistake):
    """The motion of a scene whose numbers were rounded when they were written."""

    kind: ClassVar[str] = "scenes"


DIGITS = SceneDigits(
    "digits of the scene", "It is the motion of the scene within the digits of its numbers: more digits of {text} explain it"
)
BODIES = (
    OtherBody("other moments", "It is the motion of another body. {text}", option="correct --body"),
    OtherBody("another body", "It is the motion of another body, with {text}", option="correct --body"),
)
