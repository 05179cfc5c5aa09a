"""Fields of one kind whose numbers differ from body to body: energies, sizes and axes of all bodies at once.

A potential with a method `vary(parameters)` is evaluated for all bodies together (`conservative.potentials.field`). Its static
method `suspects(parameters)` returns which bodies (n,) have numbers that the constructor might refuse or change. All other
potentials are asked one by one, which takes 10 us or more for each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..attitude import Array


@dataclass(frozen=True, eq=False)
class Varied:
    """A field of n bodies: the potential's field with numbers (n, 1) and vectors (n, 1, 3)."""

    field: Any

    def energies(self, R_WB: Array) -> Array:
        """Return V, (n, m), in J at attitudes (n, m, 3, 3)."""
        return np.asarray(self.field.energies(R_WB))

    def scales(self) -> Array:
        """Return the size of the field, (n,), in J, as `Potential.scale` has it."""
        return np.asarray(self.field.scale())[:, 0]

    def axes_W(self) -> Array:
        """Return unit vectors (n, 3), world axes, that the field is symmetric about; 0 is none."""
        axes = self.field.axis_W()[:, 0]
        size = np.linalg.norm(axes, axis=1)[:, None]
        return np.divide(axes, size, out=np.zeros(axes.shape), where=size > 0)


@dataclass(frozen=True, eq=False)
class OneByOne:
    """The potentials of n bodies, evaluated one after another."""

    potentials: Sequence[Any]

    def energies(self, R_WB: Array) -> Array:
        """Return V, (n, m), in J at attitudes (n, m, 3, 3)."""
        return np.stack([potential.energy(R) for potential, R in zip(self.potentials, R_WB, strict=True)])

    def scales(self) -> Array:
        """Return the size of the field, (n,), in J."""
        return np.array([potential.scale() for potential in self.potentials])

    def axes_W(self) -> Array:
        """Return unit vectors (n, 3), world axes; 0 where there is none."""
        return np.stack([np.zeros(3) if potential.axis_W is None else potential.axis_W for potential in self.potentials])
