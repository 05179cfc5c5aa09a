"""Equations: a term of the equations of motion is missing, wrong or additional."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from conservative.scene import Scene

from ..solution import Equations
from .mistake import Mistake, Number


@dataclass(frozen=True)
class EquationsMistake(Mistake):
    """Other equations of motion: `build` returns them for a scene and numbers; None if they are the same.

    Numbers may be arrays (B,), one for each motion.
    """

    kind: ClassVar[str] = "equations"
    build: Callable[..., Equations | None]


def _diagonal(scene: Scene) -> Equations | None:
    J = scene.body.inertia
    diagonal = np.diag(np.diag(J))
    return None if np.array_equal(J, diagonal) else Equations(scene, spinning=diagonal)


def _in_world(scene: Scene) -> Equations | None:
    return None if np.abs(scene.R_WB0 - np.eye(3)).max() <= 1e-6 else Equations(scene, fixed=scene.body.inertia)


EQUATIONS = (
    EquationsMistake(
        "no gyroscopic term",
        "The gyroscopic term is missing: without a torque the angular velocity is constant",
        lambda scene: Equations(scene, gyroscopic=0.0),
        remedy="add (J w) x w to the torque: J w' = (J w) x w + T",
    ),
    EquationsMistake(
        "sign of the gyroscopic term",
        "The gyroscopic term has the other sign",
        lambda scene: Equations(scene, gyroscopic=-1.0),
        remedy="J w' = (J w) x w + T",
    ),
    EquationsMistake(
        "diagonal gyroscopic term",
        "The gyroscopic term has the diagonal of the inertia only",
        _diagonal,
        remedy="use the whole tensor, or principal axes",
    ),
    EquationsMistake(
        "size of the field",
        "The torque of the field is {factor:.5g} times the scene's",
        lambda scene, factor: Equations(scene, field=factor) if scene.potential else None,
        numbers=(Number("factor", 1.0),),
    ),
    EquationsMistake(
        "sign of the field",
        "The torque of the field has the other sign, as of gravity that points up",
        lambda scene: Equations(scene, field=-1.0) if scene.potential else None,
        remedy="gravity is along minus the third axis of W",
    ),
    EquationsMistake(
        "inertia of the start",
        "The inertia does not turn with the body: it keeps the world components of the start",
        lambda scene: Equations(scene, fixed=scene.R_WB0 @ scene.body.inertia @ scene.R_WB0.T),
        remedy="the inertia in world axes is R J R' at each time",
    ),
    EquationsMistake(
        "inertia in world axes",
        "The inertia does not turn with the body: its body components are used in world axes",
        _in_world,
        remedy="the inertia in world axes is R J R'",
    ),
    EquationsMistake(
        "R I for R I R'",
        "The inertia in world axes is R I instead of R I R'",
        lambda scene: Equations(scene, half_turned=True),
        remedy="the inertia in world axes is R J R'",
    ),
    EquationsMistake(
        "wrong side",
        "The product of quaternions is on the wrong side: q' = w q / 2 with rates in body axes",
        lambda scene: Equations(scene, left=True),
        remedy="q' = q w / 2 with rates in body axes",
    ),
    EquationsMistake(
        "factor one half",
        "The attitudes turn by 2.00 times the rates, as without the factor 1/2 of q'",
        lambda scene: Equations(scene, turn=2.0),
        remedy="q' = q w / 2",
    ),
    EquationsMistake(
        "speed of attitudes",
        "The attitudes turn by {factor:.3f} times the rates",
        lambda scene, factor: Equations(scene, turn=factor),
        numbers=(Number("factor", 1.0),),
        remedy="q' = q w / 2",
    ),
    EquationsMistake(
        "damping",
        "The rates are damped by {damping:.4g} per second",
        lambda scene, damping: Equations(scene, damping=damping),
        numbers=(Number("damping", unit="1/s"),),
        remedy="set the damping of the engine to 0",
    ),
    EquationsMistake(
        "no reaction of the motor",
        "The reaction of the motor is missing: J w' = (J w + h) x w without - h'",
        lambda scene: Equations(scene, reaction=0.0) if scene.body.motor else None,
        remedy="J w' = (J w + h) x w - h'",
    ),
    EquationsMistake(
        "sign of the reaction of the motor",
        "The reaction of the motor has the other sign: J w' = (J w + h) x w + h'",
        lambda scene: Equations(scene, reaction=-1.0) if scene.body.motor else None,
        remedy="J w' = (J w + h) x w - h'",
    ),
)
