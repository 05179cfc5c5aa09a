"""What `integrate_many` gives: samples, drifts and outcomes of many bodies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import Array
from ..errors import IntegrationFailed
from ..method import Grid
from ..methods.many import Bodies
from ..outcome import OK, Choice, Counters, Outcome
from ..trajectory import Trajectory
from . import pictures

if TYPE_CHECKING:
    import altair


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Samples of the motions of n bodies, each of which moves by itself, at the same m times.

    Attributes
    ----------
    bodies
        What was integrated: `bodies.take(i)` is the scene of body number i.
    grid
        Steps of dt, s, and the samples kept of them.
    R_WB
        Attitudes (n, m, 3, 3), body to world; nan after a failure, as all other samples.
    w_WB_B
        Angular velocities (n, m, 3), rad/s, body axes.
    drifts
        The largest drift (n,) over a body's samples, dimensionless, by the name of what drifts: orthonormality and the
        invariants of the scene. nan where a body has no such invariant, or failed.
    label
        Who made it, with version and setting.
    failures
        What ended runs early, by the number of the body.
    choice
        Method, step and estimated error, where `integrate_many` was asked for an error. Else None.
    """

    bodies: Bodies
    grid: Grid
    R_WB: Array
    w_WB_B: Array
    drifts: Mapping[str, Array]
    label: str
    failures: Mapping[int, IntegrationFailed]
    choice: Choice | None = None

    @property
    def t(self) -> Array:
        """Times (m,) of the samples, s."""
        return self.grid.t

    @property
    def ok(self) -> Any:
        """Whether each body (n,) reached the end of its run."""
        found = np.ones(len(self), dtype=bool)
        found[list(self.failures)] = False
        return found

    def outcome(self, i: int) -> Outcome:
        """Return how the run of body number i ended."""
        return self.failures[i].outcome if i in self.failures else OK

    def plot(self, axis_B: ArrayLike | None = None) -> altair.VConcatChart:
        """Return where a body axis points at the start and at the end, the spread of attitudes over time, and the drifts.

        The axis is a direction (3,) in body axes, by default the axis of symmetry of body and field, else the third.

        Raises
        ------
        BadInput
            The axis is no direction.
        MissingExtra
            Altair or pandas, of the extra `report`, is not installed.
        """
        return pictures.draw_ensemble(self, axis_B)

    def __getitem__(self, i: int) -> Trajectory:
        failure, scene = self.failures.get(range(len(self))[i]), self.bodies.take(i)
        m = len(self.t) if failure is None else int(np.isfinite(self.w_WB_B[i]).all(axis=1).sum())
        samples = self.t[:m], self.R_WB[i, :m], self.w_WB_B[i, :m]
        return Trajectory(scene, *samples, self.label, Counters(self.grid.n_steps), failure, self.choice)

    def __len__(self) -> int:
        return len(self.bodies)

    def __repr__(self) -> str:
        name, samples = self.bodies.scene.name, f"{len(self.t)} samples to {self.t[-1]:g} s"
        return f"Ensemble({name!r}, {self.label!r}, {len(self)} bodies, {samples}, {len(self.failures)} failed)"


class Memory:
    """Keeps what blocks give in memory."""

    def __init__(self, bodies: Bodies, grid: Grid, names: tuple[str, ...]) -> None:
        n, m = len(bodies), grid.n_samples
        self.names = names
        self.R_WB, self.w_WB_B, self.drifts = np.empty((n, m, 3, 3)), np.empty((n, m, 3)), np.empty((n, len(names)))
        self.failures: dict[int, IntegrationFailed] = {}

    @property
    def done(self) -> frozenset[int]:
        """First indices of the blocks that are here already: none at first."""
        return frozenset()

    @property
    def drifts_by_name(self) -> dict[str, Array]:
        """Largest drifts (n,), dimensionless, of all bodies by the names of what drifts."""
        return dict(zip(self.names, self.drifts.T, strict=True))

    def write(self, first: int, result: Any) -> None:
        """Keep the result of the block that begins with body number `first`."""
        part = slice(first, first + len(result))
        self.R_WB[part], self.w_WB_B[part], self.drifts[part] = result.R_WB, result.w_WB_B, result.drifts
        self.failures.update((first + i, failure) for i, failure in result.failures.items())
