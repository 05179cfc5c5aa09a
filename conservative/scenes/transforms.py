"""The same motion in other units of time or in another body frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from ..attitude import Array, rotation_about
from ..body import RigidBody
from ..check import finite_number, positive_number, read_only, replace_unchecked, rotation
from ..errors import BadInput
from ..potentials.load import Damping, OfTime, Resistance
from ..potentials.uniform_gravity import UniformGravity
from ..scene import Scene

AnyLoad = TypeVar("AnyLoad", bound=OfTime)


def slow_motion(scene: Scene, slow: float = 4.0) -> Scene:
    """Return the scene `NAME:slow=4`: the same motion with time stretched by the factor `slow`.

    Engines that limit rates need it: game engines stop at 100 rad/s, and the top of Krenk & Nielsen turns at 141. With f = slow

        R'(f t) = R(t)     w' = w / f     weight' = weight / f^2     h' = h / f     T'(f t) = T(t) / f^2     D'(f t) = D(t) / f

    If f is a power of two, both motions have the same digits. The result for f = 1 is the scene itself.

    Raises
    ------
    BadInput
        `slow` is not a finite number above 0, the field is not uniform gravity, or the scene has extra invariants, whose
        scaling is unknown.
    """
    factor, field, flight = positive_number("slow", slow), scene.potential, scene.flight
    rotor, motor = scene.body.rotor_momentum, scene.body.motor
    if factor == 1:
        return scene
    rotor, motor = None if rotor is None else rotor / factor, motor and motor.in_units(factor, 1 / factor)
    if isinstance(field, UniformGravity):
        field = UniformGravity(field.weight / factor**2, field.com_B)
    elif field is not None:
        raise BadInput("scene", f"a scene with {field!r}", "a free body or one in uniform gravity")
    if scene.extra_invariants:
        raise BadInput("scene", "a scene with extra_invariants", "a scene without")
    return scene.rename(
        f"{scene.name}:slow={factor:g}",
        body=RigidBody(scene.body.inertia, rotor, motor),
        w_WB_B0=scene.w_WB_B0 / factor,
        torque=scene.torque and scene.torque.in_units(factor**2, 1 / factor),
        damping=scene.damping and scene.damping.in_units(factor**2, 1 / factor),
        flight=flight and replace(flight, v_WB0=flight.v_WB0 / factor, g=flight.g / factor**2),
        t_end=scene.t_end * factor,
        potential=field,
        dt=scene.dt * factor,
        source=f"{scene.source}; {factor:g} times slower",
    )


def in_body_frame(scene: Scene, F: Array, name: str) -> Scene:
    """Return the same motion in a body frame turned by the rotation F (3, 3), which maps old body components to new ones.

        J' = F J F'     R_WB' = R_WB F'     w' = F w     com' = F com     h' = F h     T' = F T     D' = F D F'

    Engines have dropped this rotation or applied it twice. The result of a correct method satisfies R_WB' F = R_WB.

    Raises
    ------
    BadInput
        F is not a rotation, or the field is not uniform gravity.
    """
    F = rotation("F", F)
    field = scene.potential
    if isinstance(field, UniformGravity):
        field = UniformGravity(field.weight, F @ field.com_B)
    elif field is not None:
        raise BadInput("scene", f"a scene with {field!r}", "a free body or one in uniform gravity")
    flight = scene.flight and replace(scene.flight, com_B=F @ scene.flight.com_B)
    motor, torque, damping = scene.body.motor, scene.torque, scene.damping

    def turn(vectors: Array) -> Array:
        return vectors @ F.T

    return scene.rename(
        name,
        body=RigidBody(F @ scene.body.inertia @ F.T, scene.body.rotor_along(F.T), motor and _turn(motor, F, turn)),
        R_WB0=scene.R_WB0 @ F.T,
        w_WB_B0=F @ scene.w_WB_B0,
        potential=field,
        torque=torque and _turn(torque, F, turn if torque.frame == "body" else np.asarray),
        damping=damping and _turn_damping(damping, F),
        extra_invariants=tuple(
            replace(extra_invariant, evaluate=_turn_back(extra_invariant.evaluate, F))
            for extra_invariant in scene.extra_invariants
        ),
        flight=flight,
    )


def _turn(load: AnyLoad, F: Array, convert: Callable[[Array], Array]) -> AnyLoad:
    """Return a load in a body frame turned by F (3, 3). `convert` returns the components of its values there."""
    value: Any = load.value
    if isinstance(value, tuple):
        value = value[0], read_only(convert(value[1]))
    elif not callable(value):
        value = read_only(convert(value))
    elif load.of_attitude:
        value = lambda t, R_WB: convert(load.at(t, R_WB @ F))  # noqa: E731  # its arguments count
    else:
        value = lambda t: convert(load.at(t))  # noqa: E731
    return replace_unchecked(load, value=value, origin=(load, 1.0))


def _turn_damping(damping: Damping, F: Array) -> Damping:
    """Return a damping in a body frame turned by F (3, 3)."""

    def turn(matrices: Array) -> Array:
        return F @ matrices @ F.T

    matrix, factor = damping.matrix, damping.factor
    matrix = _turn(matrix, F, turn) if isinstance(matrix, Resistance) else read_only(turn(matrix))
    return replace_unchecked(damping, matrix=matrix, factor=factor and _turn(factor, F, np.asarray))


def _turn_back(evaluate: Callable[..., Array], F: Array) -> Callable[..., Array]:
    """Return an invariant as a function of attitudes and rates in a body frame turned by F (3, 3)."""
    return lambda R_WB, w_WB_B: evaluate(R_WB @ F, w_WB_B @ F)


def turned(scene: Scene, angle: float, t_end: float | None, name: str) -> Scene:
    """Return a scene in a body frame turned by `angle`, rad, about (1, 2, 3): an inertia with off-diagonal terms."""
    F = rotation_about((1.0, 2.0, 3.0), finite_number("angle", angle, "a finite angle, rad"))
    return in_body_frame(scene, F, name).rename(name, t_end=scene.t_end if t_end is None else t_end)
