"""Units in which a scene is of order one: powers of two, so that going there and back rounds nothing.

A motion stays what it is when moments of inertia are measured in units of M, times in units of T, and energies in units of
M/T^2. Methods integrate in units in which the largest moment and the rate that the energy makes of it are of order one; products
of numbers from 1e-100 to 1e100 could otherwise leave what a float can hold. Exponents of the units are multiples of 16, rounded
towards 0: a scene with moments between 2^-16 and 2^16 kg m^2 and rates between 2^-16 and 2^16 rad/s keeps its own units, bit for
bit. A potential without `in_units` keeps them, too.

Source: dimensional analysis, see E. Buckingham, On physically similar systems (1914).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import wraps
from typing import Any, TypeVar

from ..body import RigidBody
from ..check import build_unchecked, read_only
from ..method import Grid, Method, Run
from ..scene import Scene
from ..trajectory import Trajectory

M = TypeVar("M", bound=Method)
COARSE = 16
"""Exponents of units are multiples of this."""
SHORTEST = -64
"""Exponent of the shortest step, in units of time: what moves less than that in a step need not be of order one."""


@dataclass(frozen=True)
class Units:
    """Units of moments of inertia, kg m^2, and of time, s: powers of two."""

    moment: float
    time: float

    @property
    def energy(self) -> float:
        """Unit of energy, J."""
        return self.moment / self.time / self.time

    def convert(self, scene: Scene) -> Scene:
        """Return the scene in these units. Its numbers may lie outside the range that constructors accept."""
        values: dict[str, Any] = {**vars(scene.rename(scene.name))}
        body = build_unchecked(RigidBody, inertia=read_only(scene.body.inertia / self.moment))
        return scene
