"""Classes of drift: conserved, small, large."""

from __future__ import annotations

import math
from enum import IntEnum

CONSERVED, SMALL = 1e-10, 1e-4
"""Relative drift up to which a quantity is conserved, and up to which its drift is small."""


class DriftClass(IntEnum):
    """How well a quantity is conserved: the larger, the worse."""

    CONSERVED = 0
    SMALL = 1
    LARGE = 2


def classify(drift: float) -> DriftClass | None:
    """Return the class of a relative drift of either sign; None for nan."""
    if math.isnan(drift):
        return None
    size = abs(drift)
    return DriftClass.CONSERVED if size <= CONSERVED else DriftClass.SMALL if size <= SMALL else DriftClass.LARGE
