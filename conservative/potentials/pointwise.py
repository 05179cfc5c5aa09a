"""Functions of one matrix as functions of many: what a potential made of Python functions consists of. Source: our own."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ..attitude import Array
from ..check import describe, real_array
from ..errors import PotentialFailed

EnergyFunction = Callable[[Array], float] | Callable[[Array, float], float]
GradientFunction = Callable[[Array], Array] | Callable[[Array, float], Array]
"""Functions of a matrix (3, 3), or of a matrix and a time, s."""
EARLIER = 1.0 - 2.0**-49
"""Functions of time are called this much earlier, relative to the time. A sum of steps is above t_end by rounding, where a
function of a recording has no value."""


@dataclass(frozen=True)
class _OfAttitude(ABC):
    """A function of a matrix (3, 3) and, if `in_time`, of a time, s. Subclasses have the shape of its values."""

    function: Callable[..., Any]
    in_time: bool = False
    shape: ClassVar[tuple[int, ...]]

    def at(self, R: Array, *t: float) -> Any:
        """Return the value, J, at a matrix (3, 3). Raise `PotentialFailed` where the function raises or gives no such value.

        A function of attitude and time is not called without the time, whatever its defaults. At a matrix that is not finite
        the value may be NaN: the run has diverged, which is no fault of the function.
        """
        try:
            if len(t) != self.in_time:
                raise TypeError(f"it is a function of {'attitude and time' if self.in_time else 'the attitude alone'}")
            return self._read(self.function(R.copy(), *(time * EARLIER for time in t)))
        except Exception as error:
            if not np.isfinite(R).all():
                return np.full(self.shape, math.nan)[()]
            raise PotentialFailed(error) from error

    @abstractmethod
    def _read(self, value: Any) -> Any:
        """Check a value of the function, and return it as a float or an array of floats."""

    def __call__(self, R_WB: Array, *t: Array) -> Array:
        """Return the values, (...) or (..., 3, 3), in J at matrices (..., 3, 3), and times (...), s."""
        R = np.asarray(R_WB, dtype=float)
        times = [np.broadcast_to(np.asarray(time, dtype=float), R.shape[:-2]).ravel().tolist() for time in t]
        values = [self.at(*arguments) for arguments in zip(R.reshape(-1, 3, 3), *times, strict=True)]
        return np.array(values).reshape((*R.shape[:-2], *self.shape))


class Energy(_OfAttitude):
    """V in J: `at` one matrix (3, 3), and called with matrices (..., 3, 3); `in_time`, with times in s as well."""

    shape = ()

    def _read(self, value: Any) -> float:
        if type(value) is float:
            return value
        if isinstance(value, bool | str | bytes) or np.ndim(value):
            raise TypeError(f"the energy is {describe(value)}, not a real number")
        return float(value)


class Gradient(_OfAttitude):
    """dV/dR in J: `at` one matrix (3, 3), and called with matrices (..., 3, 3); `in_time`, with times in s as well."""

    shape = (3, 3)

    def _read(self, value: Any) -> Array:
        gradient = real_array(value)
        if gradient is None or gradient.shape != (3, 3):
            raise TypeError(f"the gradient is {describe(value)}, not a matrix (3, 3) of real numbers")
        return gradient


@dataclass(frozen=True)
class Size:
    """A size of V: called, it gives itself, J."""

    value: float

    def __call__(self) -> float:
        """Return the size, J."""
        return self.value
