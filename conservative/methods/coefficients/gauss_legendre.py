"""Gauss-Legendre collocation: nodes, weights and matrices, computed with 60 digits and stored as high and low parts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ...attitude import Array

MOST_STAGES = 10
"""Largest number of stages."""
DIGITS = 60
"""Decimal digits in which coefficients are computed."""


@dataclass(frozen=True, eq=False)
class Tableau:
    """Coefficients of the s-stage method; `b + b_low` are the weights to twice the precision of a float.

    Attributes
    ----------
    c, b
        Nodes and weights (s,) on [0, 1].
    A
        A[i, j] is the integral of the j-th Lagrange polynomial from 0 to c_i.
    E
        The same from 1 to 1 + c_i. It extrapolates a step's polynomial to the stages of the next step, as a first guess.
    """

    c: Array
    b: Array
    b_low: Array
    A: Array
    E: Array


@lru_cache(maxsize=MOST_STAGES)
def tableau(stages: int) -> Tableau:
    """Return the coefficients for `stages` stages, 1 to `MOST_STAGES` (Hairer, Lubich & Wanner, II.1.3)."""
    from mpmath import MPContext

    mp = MPContext()  # mpmath's global context has one precision for all threads
    mp.dps = DIGITS
    # The zeros of the shifted Legendre polynomial, by Newton's method from their double-precision values.
    start = np.polynomial.legendre.leggauss(stages)[0]
    c = [(1 + mp.findroot(lambda x: mp.legendre(stages, x), mp.mpf(float(x)))) / 2 for x in start]
    inverse = mp.matrix([[node**k for node in c] for k in range(stages)]) ** -1
    b = _integrals(mp, inverse, [mp.mpf(0)], [mp.mpf(1)])
    A = _integrals(mp, inverse, [mp.mpf(0)] * stages, c)
    E = _integrals(mp, inverse, [mp.mpf(1)] * stages, [1 + node for node in c])
    return Tableau(np.array(c, dtype=float), _high(b)[0], _high(b - mp.matrix(_high(b).tolist()))[0], _high(A), _high(E))


def _integrals(mp: Any, inverse: Any, start: list[Any], end: list[Any]) -> Any:
    """Return the integrals of all Lagrange polynomials from start_i to end_i; `inverse` converts moments of 1, x, x^2, ..."""
    degrees = range(1, inverse.rows + 1)
    moments = mp.matrix([[(y**k - x**k) / k for k in degrees] for x, y in zip(start, end, strict=True)])
    return (inverse * moments.T).T


def _high(matrix: Any) -> Array:
    return np.array([[float(x) for x in matrix[i, :]] for i in range(matrix.rows)])
