"""Functions of one matrix as functions of many: what a potential made of Python functions consists of. Source: our own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..attitude import Array
from ..errors import BadInput

EnergyFunction = Callable[[Array], float]
GradientFunction = Callable[[Array], Array]


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
        """Return V, J, at a matrix (3, 3)."""
        return float(self.function(R.copy()))

    def __call__(self, R_WB: Array) -> Array:
        """Return V, (...), in J."""
        R = np.asarray(R_WB, dtype=float)
        return np.array([self.at(each) for each in R.reshape(-1, 3, 3)]).reshape(R.shape[:-2])


@dataclass(frozen=True)
class Gradient:
    """dV/dR in J: `at` one matrix (3, 3), and called with matrices (..., 3, 3)."""

    function: GradientFunction

    def at(self, R: Array) -> Array:
        """Return dV/dR, (3, 3), in J, at a matrix (3, 3). Raise `BadInput` where the function gives another shape."""
        gradient = np.asarray(self.function(R.copy()), dtype=float)
        if gradient.shape != (3, 3):
            raise BadInput("gradient", f"shape {gradient.shape}", "a function that returns a matrix (3, 3)")
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
