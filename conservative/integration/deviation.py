"""Standard deviations as users write them: numbers in SI units, `5deg`, `2%`, `any`. Source: definitions."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..attitude import Array
from ..check import describe, real_number
from ..errors import BadInput

ANY = "any"
"""Where directions or attitudes are evenly distributed instead."""
_TEXT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\d\s]\S*)?\s*")
_DEGREE = math.pi / 180
_ANGLES = {"": 1.0, "rad": 1.0, "deg": _DEGREE}
_RATES = {"": 1.0, "rad/s": 1.0, "deg/s": _DEGREE}
_ANGLE = f"a standard deviation above 0 such as 0.1 (rad) or 5deg, or {ANY}"
_RATE = f"a standard deviation above 0 such as 0.1 (rad/s), 5deg/s or 10% (of its size), or {ANY}"
_NUMBER = "a standard deviation above 0 such as 2% (of its size) or 0.1 (its own SI unit)"
_SHARE = "a standard deviation above 0% and up to 100%, such as 1%"


@dataclass(frozen=True)
class Deviation:
    """A standard deviation, in the unit of its quantity or relative to its size."""

    size: float
    relative: bool

    def of(self, argument: str, value: object, centre: Array, unit: str) -> float:
        """Return it in the unit of a quantity, a number () or a vector (3,) in `unit`.

        Raises
        ------
        BadInput
            It is relative to a quantity that is 0; the message names `argument` and the `value` that was given.
        """
        if not self.relative:
            return self.size
        size = float(np.linalg.norm(centre))
        if size == 0:
            raise BadInput(argument, f"{describe(value)} of 0", f"a standard deviation in {unit}, such as 0.1")
        return self.size * size


def read_angle(argument: str, value: object) -> Deviation | None:
    """Return a spread of attitudes, rad, None for any. Raise `BadInput` for what is none."""
    return None if _is_any(value) else _read(argument, value, _ANGLES, _ANGLE)


def read_rate(argument: str, value: object) -> Deviation | None:
    """Return a spread of rates, rad/s or relative, None for any direction. Raise `BadInput` for what is none."""
    return None if _is_any(value) else _read(argument, value, _RATES | {"%": 0.01}, _RATE)


def read_number(argument: str, value: object) -> Deviation:
    """Return a spread of numbers of any unit, or a relative one. Raise `BadInput` for what is none."""
    return _read(argument, value, {"": 1.0, "%": 0.01}, _NUMBER)


def read_share(argument: str, value: object) -> Deviation:
    """Return a relative spread of what stays above 0. Raise `BadInput` for what is none, or more than 100 %."""
    found = _read(argument, value, {"%": 0.01}, _SHARE)
    if found.size > 1:
        raise BadInput(argument, describe(value), _SHARE)
    return found


def _is_any(value: object) -> bool:
    return isinstance(value, str) and value.strip() == ANY


def _read(argument: str, value: object, units: Mapping[str, float], allowed: str) -> Deviation:
    """Return a number or a text with one of the units."""
    match = _TEXT.fullmatch(value) if isinstance(value, str) else None
    number, unit = (float(match[1]), match[2] or "") if match else (real_number(value), "")
    if number is None or unit not in units or not 0 < number * units[unit] < math.inf:
        raise BadInput(argument, describe(value), allowed)
    return Deviation(number * units[unit], unit == "%")
