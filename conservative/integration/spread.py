"""Random initial states and bodies near a scene, for `integrate_many`.

Every quantity has its own stream of random numbers, drawn body by body. A large ensemble therefore begins with the bodies of a
small one, and the spread of one quantity does not change another. Uniformly distributed attitudes are drawn as in K. Shoemake,
Uniform random rotations (1992).
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from numbers import Integral
from typing import Any, TypedDict

import numpy as np

from ..attitude import Array, from_quaternion
from ..check import describe, positive_integer, real_number
from ..errors import BadInput, nearest
from ..grid import SAMPLE_BYTES, most_samples
from ..potentials.turning import static_part
from ..scene import Scene
from . import inputs

START_BYTES = 400
"""Memory for drawing and checking the initial values of a body, bytes."""
_PIECE = 1 << 16
"""Number of attitudes that are computed at once, which limits the intermediate results to 50 MB."""
_ROUND_OFF = 1e-12
"""Round-off of a second moment of mass, relative to the largest moment of inertia. The second moment of a plate is 0."""

_ANY = "any"
"""Value for uniformly distributed directions or attitudes."""
_TEXT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\d\s]\S*)?\s*")
_ANGLES = {"": 1.0, "rad": 1.0, "deg": math.pi / 180}
_RATES = {"": 1.0, "rad/s": 1.0, "deg/s": math.pi / 180, "%": 0.01}
_ANGLE = f"a standard deviation above 0 such as 0.1 (rad) or 5deg, or {_ANY}"
_RATE = f"a standard deviation above 0 such as 0.1 (rad/s), 5deg/s or 10% (of its size), or {_ANY}"
_NUMBER = "a standard deviation above 0 such as 2% (of its size) or 0.1 (its own SI unit)"
_SHARE = "a standard deviation above 0% and up to 100%, such as 1%"


class Starts(TypedDict, total=False):
    """Arguments of `integrate_many`: attitudes and rates, and inertia and numbers of the potential if they vary."""

    R_WB0: Array
    w_WB_B0: Array
    inertia: Array
    parameters: dict[str, Array]


def spread(
    scene: Scene,
    n: int,
    attitude: float | str | None = None,
    rate: float | str | None = None,
    inertia: str | None = None,
    parameters: Mapping[str, float | str] | None = None,
    seed: int = 0,
) -> Starts:
    """Return n random initial states and bodies near a scene: `integrate_many(scene, **spread(scene, n, ...))`.

    Deviations are normally distributed. A number is a standard deviation in SI units, for each component of a vector. A string
    such as `"2%"` is relative to the scene's value, or to the length of a vector. Everything else is taken from the scene. The
    same seed gives the same bodies with the same version of NumPy, and a larger n only adds bodies.

    Parameters
    ----------
    scene, n
        The scene, and the number of bodies.
    attitude
        Standard deviation of each component of a rotation vector, body axes, that turns the attitude: a number in rad, or
        `"5deg"`; `"any"` for uniformly distributed attitudes.
    rate
        Standard deviation of each component of the angular velocity, body axes: a number in rad/s, `"5deg/s"`, or `"10%"` of
        its magnitude; `"any"` for uniformly distributed directions with the scene's magnitude.
    inertia
        Standard deviation of each second moment of mass about a principal plane (int x^2 dm), such as `"1%"`; any positive
        values belong to a body. The principal moments are sums of two of them and vary by 0.71 to 1 times as much. The
        principal axes do not change. Negative values are drawn again (with 30 %, one in 2,300).
    parameters
        Standard deviations of the potential's numbers and vectors, by the names of its fields, such as `{"weight": "2%"}`. A
        direction (3,) is normalized after its components were changed.
    seed
        Seed of the random numbers, 0 or more.

    Returns
    -------
    Starts
        `R_WB0` (n, 3, 3), `w_WB_B0` (n, 3), rad/s, body axes; `inertia`, kg m^2, moments (n, 3) or tensors (n, 3, 3), and
        `parameters`, (n, ...), in SI units, if these vary.

    Raises
    ------
    BadInput
        A deviation is invalid, or relative to zero; the potential has no such number; the scene's inertia does not belong to a
        mass distribution, or the potential is a turning field with the scene's inertia; n or seed is not an integer in range;
        or n bodies do not fit in memory.
    """
    if not isinstance(scene, Scene):
        raise BadInput("scene", describe(scene), "a Scene, such as conservative.scenes.brick_flip()")
    count, most = positive_integer("n", n), most_samples() * SAMPLE_BYTES // START_BYTES
    if count > most:
        raise BadInput("n", describe(n), f"up to {most:.3g}, which fit in memory, {START_BYTES} bytes each")
    checked: object = seed  # callers may pass another type than annotated
    if isinstance(checked, bool) or not isinstance(checked, Integral) or checked < 0:
        raise BadInput("seed", describe(seed), "an integer of 0 or more")
    starts = Starts(R_WB0=_draw_attitudes(scene, count, attitude, seed), w_WB_B0=_draw_rates(scene, count, rate, seed))
    varied = {name: _draw_parameter(scene, name, count, value, seed) for name, value in (parameters or {}).items()}
    if inertia is not None:
        drawn = starts["inertia"] = _draw_inertia(scene, count, _read_share("inertia", inertia), seed)
        if hasattr(scene.potential, "inertia"):  # tensors, because the field has a tensor
            varied["inertia"] = drawn if drawn.ndim == 3 else drawn[:, :, None] * np.eye(3)
        elif hasattr(static_part(scene.potential), "inertia"):
            got = "a spread in a turning field with the inertia of the scene's body"
            raise BadInput("inertia", got, "none: all bodies of such a field have the scene's inertia")
    if varied:
        starts["parameters"] = varied
    return starts


def list_parameters(scene: Scene) -> list[str]:
    """Return the names of the numbers and vectors of a scene's potential, which `spread` can vary."""
    return [name for name, shape in inputs.list_parameters(scene.potential).items() if shape in ((), (3,))]


def _read(argument: str, value: object, units: Mapping[str, float], allowed: str) -> tuple[float, bool]:
    """Return a standard deviation from a number or a text with one of the units, and whether it is relative."""
    match = _TEXT.fullmatch(value) if isinstance(value, str) else None
    number, unit = (float(match[1]), match[2] or "") if match else (real_number(value), "")
    if number is None or unit not in units or not 0 < number * units[unit] < math.inf:
        raise BadInput(argument, describe(value), allowed)
    return number * units[unit], unit == "%"


def _read_share(argument: str, value: object) -> float:
    """Return a relative standard deviation of a quantity that stays above 0."""
    share, _ = _read(argument, value, {"%": 0.01}, _SHARE)
    if share > 1:
        raise BadInput(argument, describe(value), _SHARE)
    return share


def _find_size(argument: str, value: object, centre: Array, unit: str) -> float:
    """Return the magnitude of a number () or a vector (3,), to which `value` is relative. Raise `BadInput` if it is 0."""
    size = float(np.linalg.norm(centre))
    if size == 0:
        raise BadInput(argument, f"{describe(value)} of 0", f"a standard deviation in {unit}, such as 0.1")
    return size


def _is_any(value: object) -> bool:
    return isinstance(value, str) and value.strip() == _ANY


def _stream(seed: int, name: str, again: int = 0) -> np.random.Generator:
    """Return the random numbers of a quantity; `again` is the number of earlier draws."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(*name.encode(), again)))


def _draw_attitudes(scene: Scene, n: int, value: object, seed: int) -> Array:
    """Return attitudes (n, 3, 3), body to world."""
    R_WB0 = np.tile(scene.R_WB0, (n, 1, 1))
    if value is None:
        return R_WB0
    uniform, stream = _is_any(value), _stream(seed, "attitude")
    deviation = 0.0 if uniform else _read("attitude", value, _ANGLES, _ANGLE)[0]
    for start in range(0, n, _PIECE):
        part = R_WB0[start : start + _PIECE]
        if uniform:
            q = stream.standard_normal((len(part), 4))
            part[:] = from_quaternion(q / np.linalg.norm(q, axis=1, keepdims=True))
        else:
            turns = deviation * stream.standard_normal((len(part), 3))
            half = np.linalg.norm(turns, axis=1, keepdims=True) / 2
            part[:] = scene.R_WB0 @ from_quaternion(np.hstack([np.cos(half), np.sinc(half / math.pi) / 2 * turns]))
    return R_WB0


def _draw_rates(scene: Scene, n: int, value: object, seed: int) -> Array:
    """Return angular velocities (n, 3), rad/s, body axes."""
    if value is None:
        return np.tile(scene.w_WB_B0, (n, 1))
    drawn = _stream(seed, "rate").standard_normal((n, 3))
    if _is_any(value):
        size = _find_size("rate", value, scene.w_WB_B0, "rad/s")
        return drawn * (size / np.linalg.norm(drawn, axis=1, keepdims=True))
    deviation, relative = _read("rate", value, _RATES, _RATE)
    if relative:
        deviation *= _find_size("rate", value, scene.w_WB_B0, "rad/s")
    return scene.w_WB_B0 + deviation * drawn


def _draw_factors(seed: int, name: str, shape: tuple[int, ...], deviation: float) -> Array:
    """Return factors (n, ...), normally distributed about 1. Factors of 0 or less are drawn again."""
    factors, again = 1 + deviation * _stream(seed, name).standard_normal(shape), 0
    while (wrong := factors <= 0).any():
        again += 1
        factors[wrong] = 1 + deviation * _stream(seed, name, again).standard_normal(np.count_nonzero(wrong))
    return factors


def _draw_inertia(scene: Scene, n: int, deviation: float, seed: int) -> Array:
    """Return principal moments (n, 3) if the body axes are the principal ones, otherwise tensors (n, 3, 3), kg m^2."""
    moments, R_BP = scene.body.moments, scene.body.R_BP
    planes = moments.sum() / 2 - moments
    if planes.min() < -_ROUND_OFF * moments.max():
        got = f"a spread for principal moments {moments.tolist()}"
        raise BadInput("inertia", got, "moments of a body: none is larger than the sum of the others")
    varied = planes * _draw_factors(seed, "inertia", (n, 3), deviation)
    drawn = varied.sum(axis=1, keepdims=True) - varied
    return drawn if np.array_equal(R_BP, np.eye(3)) else (R_BP * drawn[:, None, :]) @ R_BP.T


def _draw_parameter(scene: Scene, name: str, n: int, value: object, seed: int) -> Array:
    """Return a number (n,) or a vector (n, 3) of the potential for each body, in its own unit."""
    argument, shapes = f"potential.{name}", list_parameters(scene)
    if name not in shapes:
        allowed = nearest(name, shapes) if shapes else "none: the scene has no potential with numbers to spread"
        raise BadInput("parameters", repr(name), allowed)
    centre = np.asarray(getattr(scene.potential, name))
    deviation, relative = _read(argument, value, {"": 1.0, "%": 0.01}, _NUMBER)
    if relative:
        deviation *= _find_size(argument, value, centre, "its unit")
        if not centre.ndim:
            return np.asarray(centre * _draw_factors(seed, argument, (n,), _read_share(argument, value)))
    numbers = centre + deviation * _stream(seed, argument).standard_normal((n, *centre.shape))
    potential: Any = scene.potential
    if centre.ndim and np.allclose(getattr(replace(potential, **{name: 2 * centre}), name), centre, rtol=1e-12):
        numbers /= np.linalg.norm(numbers, axis=1, keepdims=True)  # a direction, which the potential normalizes
    return numbers
