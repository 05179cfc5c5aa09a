"""Checks of arguments, made before any work. `value` may have any unit; `allowed` is what the message says of it.

Frozen dataclasses whose constructors convert their arguments have an `__init__` of their own, which checks, converts and calls
`set_fields`. `__post_init__` would not do: the constructor's types would be those of the fields, where the public ones accept
more (array-likes, plain functions, None). `dataclasses.replace` works, as converting twice changes nothing.
"""

from __future__ import annotations

import math
from decimal import Decimal
from numbers import Integral, Real
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from .attitude import ROTATION_TOLERANCE, Array, orthonormality
from .errors import BadInput

T = TypeVar("T")

SMALLEST, LARGEST = 1e-30, 1e30
"""Range of every number with a unit, in SI units, 0 apart; of an array the largest component counts.

Products of three such numbers are doubles, and so are all that energies and momenta of a scene are made of.
"""
RANGE = f"0 or of magnitude {SMALLEST:g} to {LARGEST:g}"
LONGEST_SHOWN = 200
"""Characters of a value that a message shows at most."""


def describe(value: object) -> str:
    """Return a value as messages show it: its `repr`, cut off where it is long, or its type where it has none that works."""
    try:
        text = repr(value)
    except Exception:  # an integer of 5,000 digits, or somebody's own class
        return f"a value of type {type(value).__name__}"
    return text if len(text) <= LONGEST_SHOWN else f"{text[:LONGEST_SHOWN]}..."


def finite_array(argument: str, value: ArrayLike, shapes: tuple[tuple[int, ...], ...], allowed: str) -> Array:
    """Return `value` as a new read-only array of one of `shapes`, such as (3,) or (3, 3), of finite numbers in any unit.

    Raises
    ------
    BadInput
        It is none, or its largest component is out of the range `SMALLEST` to `LARGEST` and not 0.
    """
    array = real_array(value)
    if array is None:
        raise BadInput(argument, describe(value), allowed)
    if array.shape not in shapes:
        raise BadInput(argument, f"shape {array.shape}", allowed)
    if not np.isfinite(array).all():
        raise BadInput(argument, f"{describe(array.tolist())}, not finite", allowed)
    if not _in_range(float(np.abs(array).max(initial=0.0))):
        raise BadInput(argument, describe(array.tolist()), f"{allowed}, the largest {RANGE}")
    return read_only(array)


def real_array(value: object) -> Array | None:
    """Return a new array (...) of what NumPy makes real numbers of, finite or not, of any unit; None of texts and the like."""
    if type(value) is np.ndarray and value.dtype == np.float64:
        return value.copy()
    try:
        with np.errstate(all="ignore"):
            found = np.asarray(value)
            if found.dtype.kind not in "iuf" and not (found.dtype.kind == "O" and all(map(_is_real, found.flat))):
                return None
            return np.array(found, dtype=float)
    except Exception:  # rows of unequal length, integers that no float can follow, or somebody's own `__array__`
        return None


def _is_real(value: object) -> bool:
    return isinstance(value, Real | Decimal) and not isinstance(value, bool)


def _in_range(size: float) -> bool:
    return size == 0 or SMALLEST <= size <= LARGEST


def read_only(array: Array) -> Array:
    """Return an array, (...) in and (...) out and of any unit, after closing it to writing: frozen values hold no others."""
    array.flags.writeable = False
    return array


def finite_number(argument: str, value: object, allowed: str) -> float:
    """Return `value`, of any unit, as a float: 0, or of magnitude `SMALLEST` to `LARGEST`. Raise `BadInput` otherwise."""
    if type(value) is float and (SMALLEST <= value <= LARGEST or value == 0):  # nearly always, and twenty times as fast
        return value
    number = real_number(value)
    if number is None or not math.isfinite(number):
        raise BadInput(argument, describe(value), allowed)
    if not _in_range(abs(number)):
        raise BadInput(argument, describe(value), f"{allowed}, {RANGE}")
    return number


def real_number(value: object) -> float | None:
    """Return a real number, of any unit, as a float, finite or not; None for a truth value and for all that is no number."""
    if type(value) is float:
        return value
    if isinstance(value, bool) or not isinstance(value, Real):
        return None
    try:
        with np.errstate(all="ignore"):
            return float(value)
    except Exception:  # integers and fractions beyond the range of floats, or somebody's own class
        return None


def positive_number(argument: str, value: object, allowed: str = "a finite number above 0") -> float:
    """Return `value`, of any unit, as a float of `SMALLEST` to `LARGEST`. Raise `BadInput` otherwise."""
    if type(value) is float and SMALLEST <= value <= LARGEST:
        return value
    number = real_number(value)
    if number is None or not 0 < number < math.inf:
        raise BadInput(argument, describe(value), allowed)
    if not _in_range(number):
        raise BadInput(argument, describe(value), f"{allowed}, of {SMALLEST:g} to {LARGEST:g}")
    return number


def positive_integer(argument: str, value: object, allowed: str = "an integer of 1 or more") -> int:
    """Return `value` as an int of 1 or more. Raise `BadInput` otherwise."""
    if type(value) is int and value >= 1:
        return value
    if isinstance(value, bool) or not isinstance(value, Integral) or value < 1:
        raise BadInput(argument, describe(value), allowed)
    return int(value)


def printable_text(argument: str, value: object, allowed: str) -> str:
    """Return `value`, a text that files and terminals take: no NUL, no half of a surrogate pair. Raise `BadInput` otherwise."""
    if not isinstance(value, str) or "\0" in value or any("\ud800" <= character <= "\udfff" for character in value):
        raise BadInput(argument, describe(value), allowed)
    return value


def rotation(argument: str, value: object) -> Array:
    """Return `value`, a matrix (3, 3) or a SciPy `Rotation`, as a rotation matrix. Raise `BadInput` with how far off it is."""
    allowed = f"a rotation matrix (3, 3), orthonormal to {ROTATION_TOLERANCE:g} with determinant +1, or a SciPy Rotation"
    R = finite_array(argument, _matrix_of(value), ((3, 3),), allowed)
    off = float(orthonormality(R))
    if off > ROTATION_TOLERANCE:
        raise BadInput(argument, f"a matrix with |R'R - 1| = {off:.3g}", allowed)
    if np.linalg.det(R) < 0:
        raise BadInput(argument, "a reflection (determinant -1)", allowed)
    return R


def _matrix_of(value: Any) -> Any:
    """Return the matrix of a SciPy `Rotation`; anything else as it is."""
    try:
        return value.as_matrix()
    except Exception:  # what else it may be, and be wrong about, its check says
        return value


def choice(argument: str, value: object, options: tuple[object, ...]) -> None:
    """Raise `BadInput` unless `value` is one of `options`, which are texts, integers and None."""
    if isinstance(value, bool) or not isinstance(value, str | Integral | None) or value not in options:
        raise BadInput(argument, describe(value), "one of " + ", ".join(repr(o) for o in options))


def set_fields(value: object, **fields: Any) -> None:
    """Set the fields of a frozen dataclass, in its constructor: assignments are refused there, too."""
    vars(value).update(fields)


def build_unchecked(kind: type[T], **fields: Any) -> T:
    """Return a frozen dataclass with these fields, without the checks of its constructor: for units of our own, of any size."""
    made = object.__new__(kind)
    set_fields(made, **fields)
    return made
