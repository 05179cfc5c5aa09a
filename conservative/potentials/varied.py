"""Fields of one kind whose numbers differ from body to body: energies, sizes and axes of all bodies at once.

A potential may have a method `vary(parameters)`, which returns such a `Varied` for numbers (n, ...) that stand in place of its
own, by the names of its fields; and a static method `suspects(parameters)`, which returns which of them (n,) its constructor
might refuse or change, beyond what holds for all numbers. Without them bodies are asked one by one, which takes 10 us or more
for each. Source: definitions, as in the files of the potentials.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ..attitude import Array


class Varied(Protocol):
    """A field of n bodies, with numbers of its own for each."""

    def energies(self, R_WB: Array) -> Array:
        """Return V, (n, m), in J at attitudes (n, m, 3, 3)."""

    def scales(self) -> Array:
        """Return the size of the field, (n,), in J, as `Potential.scale` has it."""

    def axes_W(self) -> Array:
        """Return unit vectors (n, 3), or (1, 3) for all, world axes, that the field is symmetric about; 0 is none."""


@dataclass(frozen=True, eq=False)
class OneByOne:
    """The potentials of n bodies, asked one after another."""

    potentials: Sequence[Any]

    def energies(self, R_WB: Array) -> Array:
        """Return V, (n, m), in J at attitudes (n, m, 3, 3)."""
        return np.stack([each.energy(R) for each, R in zip(self.potentials, R_WB, strict=True)])

    def scales(self) -> Array:
        """Return the size of the field, (n,), in J."""
        return np.array([each.scale() for each in self.potentials])

    def axes_W(self) -> Array:
        """Return unit vectors (n, 3), world axes; 0 where there is none."""
        return np.stack([np.zeros(3) if each.axis_W is None else each.axis_W for each in self.potentials])


@dataclass(frozen=True, eq=False)
class VariedGravity:
    """Uniform fields of n bodies: weight times centre of mass (n, 3), N m, body axes."""

    moments_B: Array

    def energies(self, R_WB: Array) -> Array:
        """Return V, (n, m), in J at attitudes (n, m, 3, 3)."""
        return (R_WB[:, :, 2] @ self.moments_B[:, :, None])[..., 0]

    def scales(self) -> Array:
        """Return weight times lever arm, (n,), in J."""
        return lengths(self.moments_B)

    def axes_W(self) -> Array:
        """Return the vertical, (1, 3)."""
        return np.array([[0.0, 0.0, 1.0]])


@dataclass(frozen=True, eq=False)
class VariedPoints:
    """Fields between points of n bodies (n, 3), body axes, and points of the world (n, 3), m.

    `energy_of` gives V, (n, m), in J at distances (n, m), m, and `sizes` are those of the field (n,), J.
    """

    points_B: Array
    anchors_W: Array
    energy_of: Callable[[Array], Array]
    sizes: Array

    def energies(self, R_WB: Array) -> Array:
        """Return V, (n, m), in J at attitudes (n, m, 3, 3)."""
        at = (R_WB.reshape(len(R_WB), -1, 3) @ self.points_B[:, :, None]).reshape(R_WB.shape[:-1])
        return self.energy_of(np.linalg.norm(at - self.anchors_W[:, None], axis=-1))

    def scales(self) -> Array:
        """Return the size of the field, (n,), in J."""
        return self.sizes

    def axes_W(self) -> Array:
        """Return the directions (n, 3) of the points of the world; 0 where that is the pivot."""
        size = lengths(self.anchors_W)[:, None]
        return np.divide(self.anchors_W, size, out=np.zeros(self.anchors_W.shape), where=size > 0)


@dataclass(frozen=True, eq=False)
class VariedGradient:
    """Gradients of gravity on n bodies: 3 rate^2 (n,), 1/s^2, inertia (n, 3, 3), kg m^2, and directions (n, 3), world axes."""

    factors: Array
    inertia: Array
    directions_W: Array

    def energies(self, R_WB: Array) -> Array:
        """Return V, (n, m), in J at attitudes (n, m, 3, 3)."""
        u = (self.directions_W[:, None, None] @ R_WB)[:, :, 0]
        return self.factors[:, None] / 2 * np.sum(u @ self.inertia * u, axis=-1)

    def scales(self) -> Array:
        """Return the largest V, (n,), in J."""
        return self.factors / 2 * np.linalg.eigvalsh(self.inertia)[:, -1]

    def axes_W(self) -> Array:
        """Return the directions of the centre, (n, 3)."""
        return self.directions_W


def lengths(vectors: Array) -> Array:
    """Return |v|, (n,), of vectors (n, 3), of any unit and size: squares neither vanish nor overflow."""
    return np.asarray(np.hypot(np.hypot(vectors[:, 0], vectors[:, 1]), vectors[:, 2]))


def fill(potential: Any, parameters: Mapping[str, Array], *names: str) -> list[Array]:
    """Return numbers of a potential, (n,), (n, 3) or (n, 3, 3), of any unit: of `parameters`, else its own for all n."""
    n = len(next(iter(parameters.values())))
    own = ((name, np.asarray(getattr(potential, name), dtype=float)) for name in names)
    return [parameters.get(name, np.broadcast_to(value, (n, *value.shape))) for name, value in own]
