"""A key of a motion, made of numbers, that stays the same between programs; `Scene.key` is valid only within one.

`Scene.key` is exact, and differs between interpreters and versions of this package. `Motion.key` does not: it is made of the
numbers of `description.describe`, without the last digits, in which two machines differ. Both leave out the name of the scene.
`Motion.definition` is the format in which baselines store it, with the names of the row.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from conservative.attitude import rotation_about
from conservative.grid import count_steps

from .description import describe_scene

PROBES = tuple(rotation_about(axis, angle) for axis, angle in (((1, 2, 3), 0.4), ((-2, 1, 1), 1.3), ((1, -1, 4), 2.2)))
"""Arbitrary attitudes without symmetry, at which energies distinguish two potentials."""


@dataclass(frozen=True)
class Motion:
    """A motion, and the steps that its scene proposes.

    Attributes
    ----------
    description
        Its numbers, from `describe` with the attitudes `PROBES`, in this or in another version.
    """

    description: Mapping[str, Any]

    @property
    def key(self) -> str:
        """A text that is equal for scenes of the same motion and step."""
        return _hash([self.description["invariants"], self._list_digits()])

    def definition(self, scene: str, method: str) -> str:
        """Return the key of a row of a baseline: measures of two definitions cannot be compared."""
        names = [scene, method, *self.description["invariants"]]
        # The empty text once described how times were taken. Without it, every definition in every baseline would change.
        return _hash([names, self._list_digits(count_steps(*self.description["ends"])), ""])

    def _list_digits(self, *n_steps: int) -> list[list[float]]:
        """Return the digits of each group of numbers; `n_steps` is empty for `key`."""
        start = [self.description[name] for name in ("inertia", "R_WB0", "w_WB_B0")]
        parts = [part for part in self.description["parts"] if len(part)]
        groups = [*start, [*self.description["ends"], *n_steps], self.description["energies"], *parts]
        return [_digits(group) for group in groups]


def motion_of(scene: str, describe: Callable[..., Mapping[str, Any]] = describe_scene) -> Motion:
    """Return the motion of a registered scene, by default as this process has it.

    Raise `BadInput` if it does not have the scene.
    """
    return Motion(describe(scene=scene, probes=np.array(PROBES)))


def _digits(values: object) -> list[float]:
    """Return numbers without the last digits, in which two machines differ."""
    flat = np.ravel(np.asarray(values, dtype=float))
    scale = np.abs(flat).max(initial=0.0) or 1.0
    # Rounded to 1e-10 of the largest; .9e removes the round-off of the product with it, and + 0.0 the sign of a zero.
    return [float(f"{value:.9e}") + 0.0 for value in np.round(flat / scale, 10) * float(f"{scale:.10e}")]


def _hash(content: object) -> str:
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()[:16]
