"""Readings: attitudes or rates are right, but they are written, or read, in another order, unit, frame or direction."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array, from_quaternion, rotation_about, to_quaternion

from ..solution import States
from .mistake import Mistake, Number

Change = Callable[..., States]
"""Takes attitudes (..., 3, 3) and rates (..., 3), one of which may be None, and numbers. Returns both changed."""
ATTITUDES, RATES, AXES = "attitudes", "rates", "axes"


@dataclass(frozen=True)
class Reading(Mistake):
    """Another reading: `read` returns the samples that were meant, `write` the samples in the recording.

    Attributes
    ----------
    of
        What it changes: `ATTITUDES`, `RATES`, or the `AXES` of both.
    quaternions
        True if only quaternions can have it.
    both
        True if attitudes and rates are needed.
    of_world
        True if only the axes of the world differ.
    """

    kind: ClassVar[str] = "readings"
    read: Change
    write: Change
    of: str
    quaternions: bool = False
    both: bool = False
    of_world: bool = False


def attitude(change: Callable[..., Array]) -> Change:
    """Return the reading that changes attitudes."""
    return lambda R, w, *numbers: (None if R is None else change(R, *numbers), w)


def _rates(change: Callable[..., Array]) -> Change:
    return lambda R, w, *numbers: (R, None if w is None else change(w, *numbers))


def _rolled(by: int) -> Change:
    return attitude(lambda R: from_quaternion(np.roll(to_quaternion(R), by, axis=-1)))


def to_body(R: Array | None, w: Array | None) -> States:
    """Return attitudes, and world rates in body axes."""
    return R, None if w is None or R is None else (w[..., None, :] @ R)[..., 0, :]


def to_world(R: Array | None, w: Array | None) -> States:
    """Return attitudes, and body rates in world axes."""
    return R, None if w is None or R is None else (R @ w[..., None])[..., 0]


def _scaled(size: float) -> tuple[Change, Change]:
    return _rates(lambda w: w * size), _rates(lambda w: w / size)


def _turned(sign: float) -> tuple[Change, Change]:
    def read(w: Array, *turn: float) -> Array:
        return sign * w @ Rotation.from_rotvec(turn).as_matrix().T

    def write(w: Array, *turn: float) -> Array:
        return sign * w @ Rotation.from_rotvec(turn).as_matrix()

    return _rates(read), _rates(write)


TURN = tuple(Number(f"turn_{i}") for i in (1, 2, 3))
TO_Y_UP = rotation_about((1, 0, 0), -math.pi / 2)
"""Turns coordinates with the third axis up into coordinates with the second axis up: (x, y, z) to (x, z, -y)."""
_transposed = attitude(lambda R: np.swapaxes(R, -1, -2))

READINGS = (
    Reading(
        "transposed",
        "The attitudes are transposed, or the quaternions conjugated: they map world to body",
        _transposed,
        _transposed,
        ATTITUDES,
        remedy="answer R with v_W = R v_F",
    ),
    Reading(
        "order xyzw",
        "The quaternions are in the order xyzw, but were read as wxyz",
        _rolled(1),
        _rolled(-1),
        ATTITUDES,
        quaternions=True,
        remedy="your engine returns xyzw: reorder, and write the scalar first",
        option="--quaternion xyzw, or name the columns",
    ),
    Reading(
        "order wxyz",
        "The quaternions are in the order wxyz, but were read as xyzw",
        _rolled(-1),
        _rolled(1),
        ATTITUDES,
        quaternions=True,
        remedy="your engine returns wxyz: reorder, and write the scalar last",
        option="--quaternion wxyz, or name the columns",
    ),
    Reading(
        "world y up",
        "The second axis of the world is up: the attitudes are relative to a world with other axes",
        attitude(lambda R: TO_Y_UP.T @ R),
        attitude(lambda R: TO_Y_UP @ R),
        ATTITUDES,
        of_world=True,
        remedy="write attitudes relative to W, whose third axis is up",
    ),
    Reading(
        "world turned the wrong way",
        "The world is turned by 90 degrees about its first axis, the wrong way",
        attitude(lambda R: TO_Y_UP @ R),
        attitude(lambda R: TO_Y_UP.T @ R),
        ATTITUDES,
        of_world=True,
        remedy="write attitudes relative to W, whose third axis is up",
    ),
    Reading(
        "axes y up",
        "All vectors are x, z, -y, with the second axis up",
        lambda R, w: (None if R is None else TO_Y_UP.T @ R @ TO_Y_UP, None if w is None else w @ TO_Y_UP),
        lambda R, w: (None if R is None else TO_Y_UP @ R @ TO_Y_UP.T, None if w is None else w @ TO_Y_UP.T),
        AXES,
        remedy="answer in W and F, whose third axis is up",
    ),
    Reading(
        "world rates",
        "The rates are in world axes",
        to_body,
        to_world,
        RATES,
        both=True,
        remedy="answer rates in F as `w`, or in W as `w_W`",
        option="--rates world",
    ),
    Reading(
        "body rates",
        "The rates are in body axes, but were read in world axes",
        to_world,
        to_body,
        RATES,
        both=True,
        remedy="answer rates in F as `w`, or in W as `w_W`",
        option="--rates body",
    ),
    Reading(
        "rates in degrees", "The rates are in deg/s, but were read in rad/s", *_scaled(math.pi / 180), RATES,
        remedy="answer in rad/s",
    ),
    Reading("rates in radians", "The rates are in rad/s, but were read in deg/s", *_scaled(180 / math.pi), RATES),
    Reading(
        "reversed rates", "The rates have the other sign", *_scaled(-1.0), RATES,
        remedy="answer w with R' = R [w]x in body axes",
    ),
    Reading(
        "size of the rates",
        "The attitudes are right, but the rates are {factor:.5g} times the right ones",
        _rates(lambda w, factor: w / factor),
        _rates(lambda w, factor: w * factor),
        RATES,
        both=True,
        numbers=(Number("factor", 1.0),),
    ),
    Reading(
        "bias of the rates",
        "The attitudes are right, but the rates have a bias of ({bias_1:.4g}, {bias_2:.4g}, {bias_3:.4g}) rad/s",
        _rates(lambda w, *bias: w - np.array(bias)),
        _rates(lambda w, *bias: w + np.array(bias)),
        RATES,
        both=True,
        numbers=tuple(Number(f"bias_{i}", unit="rad/s") for i in (1, 2, 3)),
    ),
    Reading(
        "rates in turned axes",
        "The attitudes are right, but the rates are in axes that are turned by ({turn_1:.5g}, {turn_2:.5g}, {turn_3:.5g}) rad",
        *_turned(1.0),
        RATES,
        both=True,
        numbers=TURN,
    ),
    Reading(
        "rates in mirrored axes",
        "The attitudes are right, but the rates are in left-handed axes: the other sign of all, then turned by "
        "({turn_1:.5g}, {turn_2:.5g}, {turn_3:.5g}) rad",
        *_turned(-1.0),
        RATES,
        both=True,
        numbers=TURN,
    ),
    Reading(
        "turned attitudes",
        "The rates are right, but the attitudes belong to axes that are turned in the body by "
        "({turn_1:.5g}, {turn_2:.5g}, {turn_3:.5g}) rad",
        attitude(lambda R, *turn: R @ Rotation.from_rotvec(turn).as_matrix().T),
        attitude(lambda R, *turn: R @ Rotation.from_rotvec(turn).as_matrix()),
        ATTITUDES,
        both=True,
        numbers=TURN,
    ),
    Reading(
        "turned world",
        "The attitudes are relative to a world that is turned by ({turn_1:.5g}, {turn_2:.5g}, {turn_3:.5g}) rad",
        attitude(lambda R, *turn: _tilt(*turn) @ R),
        attitude(lambda R, *turn: _tilt(*turn).T @ R),
        ATTITUDES,
        of_world=True,
        numbers=TURN,
    ),
    Reading(
        "body axes",
        "The body axes of the file are not the axes of the body: turn them by ({turn_1:.5g}, {turn_2:.5g}, {turn_3:.5g}) rad",
        lambda R, w, *turn: _body_axes(R, w, Rotation.from_rotvec(turn).as_matrix().T),
        lambda R, w, *turn: _body_axes(R, w, Rotation.from_rotvec(turn).as_matrix()),
        AXES,
        numbers=TURN,
    ),
)  # fmt: skip


def _tilt(first: float, second: float, third: float = 0.0) -> Array:
    """Return the matrix of a turn; without the third number the turn about the vertical, which gravity does not show, is 0."""
    return Rotation.from_rotvec([first, second, third]).as_matrix()


def _body_axes(R: Array | None, w: Array | None, C: Array) -> States:
    return None if R is None else R @ C, None if w is None else w @ C
