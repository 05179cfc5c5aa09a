"""Checks of arguments, made before any work. `value` may have any unit; `allowed` is what the message says of it.

Frozen dataclasses whose constructors convert their arguments have an `__init__` of their own, which checks, converts and calls
`set_fields`. `__post_init__` would not do: the constructor's types would be those of the fields, where the public ones accept
more (array-likes, plain functions, None). `dataclasses.replace` works, as converting twice changes nothing.
"""

from __future__ import annotations

import math
import os
from decimal import Decimal
from functools import lru_cache
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

MOST_STEPS = 2**53
"""Steps of a run at most: floats, which times are made of, count no farther."""
_COUNT = f"an integer of 1 to 2^53 = {MOST_STEPS}, up to which floats count"
SAMPLE_BYTES = 1000
"""Memory that a run takes for a sample, bytes, with all that is in between."""
MEMORY_SHARE = 0.5
"""Share of a machine's memory that the samples of a run may take."""
USUAL_MEMORY = 4 * 2**30
"""Memory, bytes, of a machine that does not say how much it has."""


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


@lru_cache(maxsize=1)
def most_samples() -> int:
    """Return how many samples a run may keep: as many as fill `MEMORY_SHARE` of this machine's memory."""
    try:
        memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):  # not on every system
        memory = USUAL_MEMORY
    return int((memory if memory > 0 else USUAL_MEMORY) * MEMORY_SHARE / SAMPLE_BYTES)


def require_memory(argument: str, n_steps: int, every: int) -> None:
    """Raise `BadInput` if a run of so many steps, every `every`-th of them a sample, has more than `most_samples`."""
    most, samples = most_samples(), 1 + -(-n_steps // every)
    if samples > most:
        fits = f"up to {most:.3g} samples fit in memory, {SAMPLE_BYTES} bytes each"
        fits = f"{-(-n_steps // (most - 1))} or more, or longer steps: {fits}"
        raise BadInput(argument, f"{every}, for {samples} samples of {n_steps} steps", fits)


def convert_steps(dt: object, n_steps: object, every: object) -> tuple[float, int, int]:
    """Return a step, s, and counts, dimensionless, as a float and ints.

    Raises
    ------
    BadInput
        The step is not finite or not above 0, a count is beyond `MOST_STEPS`, or the samples do not fit in memory.
    """
    step = real_number(dt)  # no range: steps of scenes in other units are no longer in SI units
    if step is None or not 0 < step < math.inf:
        raise BadInput("dt", describe(dt), "a finite step above 0, s")
    counts = _convert_count("n_steps", n_steps), _convert_count("every", every)
    if not math.isfinite(step * counts[0]):
        raise BadInput("dt", f"{step:g}, for {counts[0]} steps", "a step whose multiples are finite, s")
    require_memory("every", *counts)
    return step, *counts


def _convert_count(argument: str, value: object) -> int:
    """Return a number of steps as an int. Raise `BadInput` unless it is of 1 to `MOST_STEPS`."""
    count = positive_integer(argument, value, _COUNT)
    if count > MOST_STEPS:
        raise BadInput(argument, describe(count), _COUNT)
    return count


def set_fields(value: object, **fields: Any) -> None:
    """Set the fields of a frozen dataclass, in its constructor: assignments are refused there, too."""
    vars(value).update(fields)


def build_unchecked(kind: type[T], **fields: Any) -> T:
    """Return a frozen dataclass with these fields, without the checks of its constructor: for units of our own, of any size."""
    made = object.__new__(kind)
    set_fields(made, **fields)
    return made
