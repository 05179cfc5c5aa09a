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

EnergyFunction = Callable[[Array], float]
GradientFunction = Callable[[Array], Array]


@contextmanager
def _blamed() -> Iterator[None]:
    """Turn whatever goes wrong in a function that is not ours into `PotentialFailed`, with that as its cause."""
    try:
        yield
    except Exception as error:
        raise PotentialFailed(error) from error


@dataclass(frozen=True)
class Product:
    """A function of a matrix (3, 3) times a constant: called, it gives the product, a number or a matrix."""

    function: Callable[[Array], Any]
    factor: float

    def __call__(self, R: Array) -> Any:
        """Return the product, in the function's unit."""
        return self.function(R) * self.factor


@dataclass(frozen=True)
class Energy:
    """V in J: `at` one matrix (3, 3), and called with matrices (..., 3, 3)."""

    function: EnergyFunction

    def at(self, R: Array) -> float:
        """Return V, J, at a matrix (3, 3). Raise `PotentialFailed` where the function raises or gives no real number."""
        with _blamed():
            found = self.function(R.copy())
            if type(found) is float:
                return found
            if isinstance(found, bool | str | bytes) or np.ndim(found):
                raise TypeError(f"the energy is {describe(found)}, not a real number")
            return float(found)

    def __call__(self, R_WB: Array) -> Array:
        """Return V, (...), in J."""
        R = np.asarray(R_WB, dtype=float)
        return np.array([self.at(each) for each in R.reshape(-1, 3, 3)]).reshape(R.shape[:-2])


@dataclass(frozen=True)
class Gradient:
    """dV/dR in J: `at` one matrix (3, 3), and called with matrices (..., 3, 3)."""

    function: GradientFunction

    def at(self, R: Array) -> Array:
        """Return dV/dR, (3, 3), in J, at a matrix (3, 3). Raise `PotentialFailed` where the function raises or gives none."""
        with _blamed():
            found = self.function(R.copy())
            gradient = real_array(found)
            if gradient is None or gradient.shape != (3, 3):
                raise TypeError(f"the gradient is {describe(found)}, not a matrix (3, 3) of real numbers")
            return gradient

    def __call__(self, R_WB: Array) -> Array:
        """Return dV/dR, (..., 3, 3), in J."""
        R = np.asarray(R_WB, dtype=float)
        return np.array([self.at(each) for each in R.reshape(-1, 3, 3)]).reshape(R.shape)


@dataclass(frozen=True)
class Size:
    """A size of V: called, it gives itself, J."""

    value: float

    def __call__(self) -> float:
        """Return the size, J."""
        return self.value
