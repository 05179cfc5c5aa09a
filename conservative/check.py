"""Checks of arguments. Each raises `BadInput` with the argument's name, its value, and `allowed`: the valid values in words.

A frozen dataclass that converts its arguments has its own `__init__`, which checks, converts and calls `set_fields`. With
`__post_init__` the constructor would have the types of the fields, but it accepts more (array-likes, plain functions, None).
`dataclasses.replace` works, because a second conversion changes nothing.
"""

from __future__ import annotations

import math
import unicodedata
from dataclasses import fields
from decimal import Decimal
from numbers import Integral, Real
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from .attitude import ROTATION_TOLERANCE, Array, orthonormality
from .errors import BadInput

T = TypeVar("T")

SMALLEST, LARGEST = 1e-30, 1e30
"""Range of the magnitude of every number except 0, in SI units; of an array, the range of the largest component.

The product of three such numbers does not overflow or underflow, so energies and momenta do not either.
"""
FREE_BODIES = 1e-60, 1e60
"""Range of the largest component of an inertia, kg m^2: molecules have 1e-47, planets 1e38.

A free body depends on the ratios of its moments only. With scales of 1e-100 to 1e100 every method returned the same attitudes
and rates up to round-off. Beside a field or a load an inertia has the range of all numbers; see `require_size`.
"""
TENSOR_CONDITION = 1e13
"""Largest ratio of the principal moments of a tensor that is not diagonal.

Round-off of the tensor changes its smallest moment by up to 4e-16 of the largest (measured on 10,000 random tensors). That is
0.4 % at this ratio; at 1e15 even the sign of the smallest moment is unknown. For a diagonal tensor it is `LARGEST`.
"""
_INERTIA = "three positive moments (3,) or a symmetric positive definite matrix (3, 3), kg m^2"
_RANGE = f"0 or of magnitude {SMALLEST:g} to {LARGEST:g}"
_UNIT = 4 * np.finfo(float).eps
"""A vector whose length is 1 to this is not changed, so that a second normalization changes nothing."""


def describe(value: object) -> str:
    """Return `repr(value)`, at most 200 characters of it, or the type if `repr` fails."""
    try:
        text = f"{'masked entries in ' * has_masked(value)}{value!r}"
    except Exception:  # an integer of 5,000 digits, or a user's class
        return f"a value of type {type(value).__name__}"
    return text if len(text) <= 200 else f"{text[:200]}..."


def has_masked(value: object) -> bool:
    """Return whether an array, or one in nested lists or tuples, has masked entries. NumPy drops the mask.

    NumPy and other packages with masked arrays have the attribute `mask`.
    """
    if isinstance(value, list | tuple):
        return any(type(item) is not float and has_masked(item) for item in value)
    return isinstance(value, np.ndarray) and type(value) is not np.ndarray and bool(np.any(getattr(value, "mask", False)))


def finite_array(
    argument: str,
    value: ArrayLike,
    shapes: tuple[tuple[int, ...], ...],
    allowed: str,
    limits: tuple[float, float] = (SMALLEST, LARGEST),
) -> Array:
    """Return `value` as a new read-only array of finite numbers, with one of `shapes`, such as (3,) or (3, 3).

    Its largest component has to be 0 or of a magnitude within the limits.
    """
    array = real_array(value)
    if array is None:
        raise BadInput(argument, describe(value), allowed)
    if array.shape not in shapes:
        raise BadInput(argument, f"shape {array.shape}", allowed)
    if not np.isfinite(array).all():
        raise BadInput(argument, f"{describe(array.tolist())}, not finite", allowed)
    size = float(np.abs(array).max(initial=0.0))
    if size and not limits[0] <= size <= limits[1]:
        raise BadInput(
            argument, describe(array.tolist()), f"{allowed}, the largest 0 or of magnitude {limits[0]:g} to {limits[1]:g}"
        )
    return read_only(array)


def read_inertia(value: ArrayLike) -> Array:
    """Return moments (3,) or a tensor (3, 3), kg m^2, as a symmetric read-only tensor of a possible body; see `RigidBody`."""
    inertia = finite_array("inertia", value, ((3,), (3, 3)), _INERTIA, FREE_BODIES)
    tensor = np.diag(inertia) if inertia.ndim == 1 else inertia
    asymmetry = np.abs(tensor - tensor.T).max()
    if asymmetry > 1e-12 * np.abs(tensor).max():
        raise BadInput("inertia", f"a matrix that is not symmetric (off by {asymmetry:.3g})", _INERTIA)
    is_diagonal = np.count_nonzero(tensor - np.diag(np.diag(tensor))) == 0
    moments = np.sort(np.diag(tensor)) if is_diagonal else np.linalg.eigvalsh(tensor)
    if moments[0] <= 0:
        rod = f"{_INERTIA}; for a rod or a linear molecule (1e-9 I, I, I), without a rate about the first axis"
        allowed = rod if 0 == moments[0] < moments[1] == moments[2] else _INERTIA
        raise BadInput("inertia", f"principal moments {moments.tolist()}, not all positive", allowed)
    condition = LARGEST if is_diagonal else TENSOR_CONDITION
    if moments[-1] > condition * moments[0]:
        raise BadInput("inertia", f"principal moments {moments.tolist()}", f"{_INERTIA}, their ratio up to {condition:g}")
    return read_only((tensor + tensor.T) / 2)


def require_size(inertia: Array) -> None:
    """Raise `BadInput` if an inertia (3, 3), kg m^2, is out of the range beside a field or a load.

    There, not only ratios of moments matter.
    """
    if not _in_range(float(np.abs(inertia).max())):
        allowed = (
            f"the largest component of magnitude {SMALLEST:g} to {LARGEST:g} beside a field or a load. Use larger or smaller"
        )
        got = describe((inertia if np.count_nonzero(inertia) > 3 else np.diag(inertia)).tolist())
        raise BadInput(
            "inertia",
            got,
            f"{allowed} units for mass, length and time, or remove the field and the load: for a free body only ratios matter",
        )


def real_array(value: object) -> Array | None:
    """Return `value` as a new array of floats, finite or not; None if it has masked entries, or is not of real numbers."""
    if type(value) is np.ndarray and value.dtype == np.float64:
        return value.copy()
    try:
        if has_masked(value):
            return None
        with np.errstate(all="ignore"):
            array = np.asarray(value)
            if array.dtype.kind == "O":
                if not all(isinstance(x, Real | Decimal) and not isinstance(x, bool) for x in array.flat):
                    return None
            elif array.dtype.kind not in "iuf":
                return None
            return np.array(array, dtype=float)
    except Exception:  # rows of unequal length, integers beyond the range of floats, or a user's `__array__`
        return None


def numbers(argument: str, value: ArrayLike) -> Array:
    """Return numbers of any shape, finite or not, as floats."""
    array = real_array(value)
    if array is None:
        raise BadInput(argument, describe(value), "real numbers")
    return array


def _in_range(size: float) -> bool:
    return size == 0 or SMALLEST <= size <= LARGEST


def read_only(array: Array) -> Array:
    """Make an array read-only, as the arrays of frozen dataclasses are, and return it."""
    array.flags.writeable = False
    return array


def finite_number(argument: str, value: object, allowed: str) -> float:
    """Return `value` as a float: 0, or of magnitude `SMALLEST` to `LARGEST`."""
    if type(value) is float and (SMALLEST <= value <= LARGEST or value == 0):  # the usual case, twenty times as fast
        return value
    number = real_number(value)
    if number is None or not math.isfinite(number):
        raise BadInput(argument, describe(value), allowed)
    if not _in_range(abs(number)):
        raise BadInput(argument, describe(value), f"{allowed}, {_RANGE}")
    return number


def real_number(value: object) -> float | None:
    """Return a real number as a float, finite or not; None for booleans and for everything that is not a number."""
    if type(value) is float:
        return value
    if isinstance(value, bool) or not isinstance(value, Real):
        return None
    try:
        with np.errstate(all="ignore"):
            return float(value)
    except Exception:  # integers and fractions beyond the range of floats, or a user's class
        return None


def positive_number(argument: str, value: object, allowed: str = "a finite number above 0") -> float:
    """Return `value` as a float of `SMALLEST` to `LARGEST`."""
    if type(value) is float and SMALLEST <= value <= LARGEST:
        return value
    number = real_number(value)
    if number is None or not 0 < number < math.inf:
        raise BadInput(argument, describe(value), allowed)
    if not _in_range(number):
        raise BadInput(argument, describe(value), f"{allowed}, of {SMALLEST:g} to {LARGEST:g}")
    return number


def positive_integer(argument: str, value: object, allowed: str = "an integer of 1 or more") -> int:
    """Return `value` as an int of 1 or more."""
    if type(value) is int and value >= 1:
        return value
    if isinstance(value, bool) or not isinstance(value, Integral) or value < 1:
        raise BadInput(argument, describe(value), allowed)
    return int(value)


def printable_text(argument: str, value: object, allowed: str) -> str:
    """Return a text that can be written to files and terminals: without control characters and without lone surrogates."""
    if not isinstance(value, str) or any(unicodedata.category(character) in ("Cc", "Cs") for character in value):
        raise BadInput(argument, describe(value), allowed)
    return value


LONGEST_NAME = 1000
"""Most characters of a name, which is in messages, tables, pictures and each row of measurements."""
NAME = f"a text of one character to {LONGEST_NAME:,}"


def name_text(value: object) -> str:
    """Return the argument `name`, a text that can be shown."""
    name = printable_text("name", value, NAME)
    if not 0 < len(name) <= LONGEST_NAME:
        raise BadInput("name", describe(name), NAME)
    return name


def unit_vector(argument: str, value: ArrayLike, allowed: str = "three finite numbers (3,), not all 0", size: int = 3) -> Array:
    """Return the unit vector (size,) along a vector (size,) of any length above 0."""
    direction = finite_array(argument, value, ((size,),), allowed)
    length = float(np.linalg.norm(direction))
    if length == 0:
        raise BadInput(argument, direction.tolist(), allowed)
    return read_only(direction / length) if abs(length - 1) > _UNIT else direction


def rotation(argument: str, value: object) -> Array:
    """Return a matrix (3, 3) or a SciPy `Rotation` as a rotation matrix."""
    allowed = f"a rotation matrix (3, 3), orthonormal to {ROTATION_TOLERANCE:g} with determinant +1, or a SciPy Rotation"
    try:
        matrix = value.as_matrix()  # type: ignore[attr-defined]
    except Exception:  # not a SciPy Rotation: the checks below report the error
        matrix = value
    R = finite_array(argument, matrix, ((3, 3),), allowed)
    off = float(orthonormality(R))
    if off > ROTATION_TOLERANCE:
        raise BadInput(argument, f"a matrix with |R'R - 1| = {off:.3g}", allowed)
    if np.linalg.det(R) < 0:
        raise BadInput(argument, "a reflection (determinant -1)", allowed)
    return R


def choice(argument: str, value: object, options: tuple[object, ...]) -> None:
    """Raise `BadInput` unless `value` is one of `options`, which can be texts, integers and None."""
    if type(value) is str and value in options:
        return
    if isinstance(value, bool) or not isinstance(value, str | Integral | None) or value not in options:
        raise BadInput(argument, describe(value), "one of " + ", ".join(repr(o) for o in options))


def set_fields(value: object, /, **values: Any) -> None:
    """Set the fields of a frozen dataclass in its constructor, where assignments fail."""
    vars(value).update(values)


class PickledByFields:
    """Base of frozen dataclasses whose caches have values of one process: pickle takes the fields only."""

    def __reduce__(self) -> tuple[Any, ...]:
        frozen: Any = self
        return _restore, (type(self), {field.name: getattr(self, field.name) for field in fields(frozen)})


def _restore(kind: type[T], values: dict[str, Any]) -> T:
    return build_unchecked(
        kind, **{name: read_only(field) if isinstance(field, np.ndarray) else field for name, field in values.items()}
    )


def replace_unchecked(value: T, /, **changes: Any) -> T:
    """Return a copy of a frozen dataclass with other fields, without the checks of its constructor and with an empty cache."""
    frozen: Any = value
    return build_unchecked(type(value), **{field.name: getattr(frozen, field.name) for field in fields(frozen)} | changes)


def build_unchecked(kind: type[T], **values: Any) -> T:
    """Return a frozen dataclass without the checks of its constructor: internal units can have numbers of any size."""
    instance = object.__new__(kind)
    vars(instance).update(values)
    return instance
