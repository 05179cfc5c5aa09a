"""Checks of arguments, made before any work. `value` may have any unit; `allowed` is what the message says of it.

Frozen values whose constructors convert what they are given are written in two classes, here and everywhere: a frozen dataclass
has the fields, and the public class derived from it has an `__init__` that checks, converts, and calls the generated one. So
nothing is ever assigned to a frozen value, and `dataclasses.replace` works, as what is converted already converts to itself.

Why not attrs: a lean install does not bring it. Why not `__post_init__`: it would have to assign to frozen fields, and the
constructor's types would be those of the fields, where the public ones accept more (array-likes, plain functions, None).
"""

from __future__ import annotations

import math
from numbers import Integral, Real
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from .attitude import ROTATION_TOLERANCE, Array, orthonormality
from .errors import BadInput

T = TypeVar("T")


def finite_array(argument: str, value: ArrayLike, shapes: tuple[tuple[int, ...], ...], allowed: str) -> Array:
    """Return `value` as a new read-only array of one of `shapes`, such as (3,) or (3, 3), of finite numbers in any unit.

    Raises
    ------
    BadInput
        It is none.
    """
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise BadInput(argument, repr(value), allowed) from None
    if array.shape not in shapes:
        raise BadInput(argument, f"shape {array.shape}", allowed)
    if not np.isfinite(array).all():
        raise BadInput(argument, f"{array.tolist()}, not finite", allowed)
    return read_only(array)


def read_only(array: Array) -> Array:
    """Return an array, (...) in and (...) out and of any unit, after closing it to writing: frozen values hold no others."""
    array.flags.writeable = False
    return array


def finite_number(argument: str, value: object, allowed: str) -> float:
    """Return `value`, of any unit, as a finite float. Raise `BadInput` otherwise."""
    if type(value) is float and math.isfinite(value):  # nearly always, and twenty times as fast as asking for a `Real`
        return value
    if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
        raise BadInput(argument, repr(value), allowed)
    return float(value)


def positive_number(argument: str, value: object, allowed: str = "a finite number above 0") -> float:
    """Return `value`, of any unit, as a float that is finite and above 0. Raise `BadInput` otherwise."""
    number = finite_number(argument, value, allowed)
    if number <= 0:
        raise BadInput(argument, repr(value), allowed)
    return number


def positive_integer(argument: str, value: object, allowed: str = "an integer of 1 or more") -> int:
    """Return `value` as an int of 1 or more. Raise `BadInput` otherwise."""
    if type(value) is int and value >= 1:
        return value
    if isinstance(value, bool) or not isinstance(value, Integral) or value < 1:
        raise BadInput(argument, repr(value), allowed)
    return int(value)


def rotation(argument: str, value: object) -> Array:
    """Return `value`, a matrix (3, 3) or a SciPy `Rotation`, as a rotation matrix. Raise `BadInput` with how far off it is."""
    allowed = f"a rotation matrix (3, 3), orthonormal to {ROTATION_TOLERANCE:g} with determinant +1, or a SciPy Rotation"
    as_matrix = getattr(value, "as_matrix", None)
    R = finite_array(argument, as_matrix() if as_matrix else value, ((3, 3),), allowed)  # type: ignore[arg-type]
    off = float(orthonormality(R))
    if off > ROTATION_TOLERANCE:
        raise BadInput(argument, f"a matrix with |R'R - 1| = {off:.3g}", allowed)
    if np.linalg.det(R) < 0:
        raise BadInput(argument, "a reflection (determinant -1)", allowed)
    return R


def choice(argument: str, value: object, options: tuple[object, ...]) -> None:
    """Raise `BadInput` unless `value` is one of `options`."""
    if value not in options:
        raise BadInput(argument, repr(value), "one of " + ", ".join(repr(o) for o in options))


def power_of_two(size: float) -> float:
    """Return the power of two above a finite size, by which dividing rounds nothing; 1 for a size of 0. Of any unit."""
    return math.ldexp(1.0, min(math.frexp(size)[1], 1023)) if size > 0 else 1.0


def length(vector: Array) -> float:
    """Return |v| of a vector (3,), of any unit and size: squares neither vanish nor overflow."""
    unit = power_of_two(float(np.abs(vector).max()))
    return float(np.linalg.norm(vector / unit)) * unit


def geometric_mean(a: float, b: float) -> float:
    """Return the square root of the product of two numbers of any unit, above 0, which itself may overflow or vanish."""
    (x, i), (y, j) = math.frexp(a), math.frexp(b)
    return math.ldexp(math.sqrt(math.ldexp(x * y, (i + j) % 2)), (i + j) // 2)


def build_unchecked(kind: type[T], **values: Any) -> T:
    """Return a frozen value of two classes (see above) without its checks: for numbers in units of our own, of any size."""
    made = object.__new__(kind)
    kind.__bases__[0].__init__(made, **values)  # type: ignore[misc]  # that of the class which has the fields
    return made
