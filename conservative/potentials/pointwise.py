"""Functions of one matrix as functions of many: what a potential made of Python functions consists of. Source: our own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..attitude import Array
from ..check import describe, real_array
from ..errors import PotentialFailed

EnergyFunction = Callable[[Array], float] | Callable[[Array, float], float]
GradientFunction = Callable[[Array], Array] | Callable[[Array, float], Array]
"""Functions of a matrix (3, 3), or of a matrix and a time, s."""


@contextmanager
def _blamed() -> Iterator[None]:
    """Turn whatever goes wrong in a function that is not ours into `PotentialFailed`, with that as its cause."""
    try:
        yield
    except Exception as error:
        raise PotentialFailed(error) from error


@dataclass(frozen=True)
class Product:
    """A function of a matrix (3, 3), and maybe a time, times a constant: called, it gives the product, a number or a matrix.

    The time it is called with is in units of `time`, s.
    """

    function: Callable[..., Any]
    factor: float
    time: float = 1.0

    def __call__(self, R: Array, *t: float) -> Any:
        """Return the product, in the function's unit."""
        return self.function(R, *(each * self.time for each in t)) * self.factor


@dataclass(frozen=True)
class Energy:
    """V in J: `at` one matrix (3, 3), and called with matrices (..., 3, 3); `in_time`, with times in s as well."""

    function: EnergyFunction
    in_time: bool = False

    def at(self, R: Array, *t: float) -> float:
        """Return V, J, at a matrix (3, 3). Raise `PotentialFailed` where the function raises or gives no real number."""
        with _blamed():
            found = _call(self, R, t)
            if type(found) is float:
                return found
            if isinstance(found, bool | str | bytes) or np.ndim(found):
                raise TypeError(f"the energy is {describe(found)}, not a real number")
            return float(found)

    def __call__(self, R_WB: Array, *t: Array) -> Array:
        """Return V, (...), in J."""
        return np.array([self.at(*each) for each in _each(R_WB, *t)]).reshape(np.shape(R_WB)[:-2])


@dataclass(frozen=True)
class Gradient:
    """dV/dR in J: `at` one matrix (3, 3), and called with matrices (..., 3, 3); `in_time`, with times in s as well."""

    function: GradientFunction
    in_time: bool = False

    def at(self, R: Array, *t: float) -> Array:
        """Return dV/dR, (3, 3), in J, at a matrix (3, 3). Raise `PotentialFailed` where the function raises or gives none."""
        with _blamed():
            found = _call(self, R, t)
            gradient = real_array(found)
            if gradient is None or gradient.shape != (3, 3):
                raise TypeError(f"the gradient is {describe(found)}, not a matrix (3, 3) of real numbers")
            return gradient

    def __call__(self, R_WB: Array, *t: Array) -> Array:
        """Return dV/dR, (..., 3, 3), in J."""
        return np.array([self.at(*each) for each in _each(R_WB, *t)]).reshape(np.shape(R_WB))


def _call(of: Energy | Gradient, R: Array, t: tuple[float, ...]) -> Any:
    """Return what the function gives; one of attitude and time is not called without the time, whatever its defaults."""
    if len(t) != of.in_time:
        raise TypeError("it is a function of attitude and time" if of.in_time else "it is a function of the attitude alone")
    function: Callable[..., Any] = of.function
    return function(R.copy(), *t)


def _each(R_WB: Array, *t: Array) -> Iterator[tuple[Any, ...]]:
    """Yield matrices (3, 3) out of (..., 3, 3), and with them the times, floats, out of (...)."""
    R = np.asarray(R_WB, dtype=float)
    times = [np.broadcast_to(np.asarray(each, dtype=float), R.shape[:-2]).ravel().tolist() for each in t]
    return zip(R.reshape(-1, 3, 3), *times, strict=True)


@dataclass(frozen=True)
class Size:
    """A size of V: called, it gives itself, J."""

    value: float

    def __call__(self) -> float:
        """Return the size, J."""
        return self.value
