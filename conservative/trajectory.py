"""What a method hands back: sampled attitudes and rates, what it cost in work, and how it ended."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from . import invariants, presentation
from .attitude import Array
from .errors import IntegrationFailed
from .invariants import Invariant
from .outcome import OK, Outcome
from .scene import Scene

if TYPE_CHECKING:
    import altair
    import pandas


@dataclass(frozen=True)
class Counters:
    """Work done: steps, stages solved, corrections of the nonlinear solver, evaluations of the right-hand side.

    None means that the method does not have the thing or its engine does not tell.
    """

    steps: int
    stages: int | None = None
    iterations: int | None = None
    evaluations: int | None = None


@dataclass(frozen=True)
class Choice:
    """What `integrate(scene, error=...)` chose.

    Attributes
    ----------
    method, dt
        The `Method` that made the trajectory, and its step, s.
    error
        Attitude error asked for over the run, rad.
    estimate
        Estimated attitude error over the run, rad, from the same run at twice the step.
    attempts
        Steps tried on the whole run, s, with the estimate of each, rad.
    """

    method: Any  # a `Method`: naming the type would close a circle, as that file imports this one
    dt: float
    error: float
    estimate: float
    attempts: tuple[tuple[float, float], ...]

    @property
    def reached(self) -> bool:
        """Whether the estimate is within what was asked for."""
        return self.estimate <= self.error


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Samples of a motion.

    Attributes
    ----------
    scene
        What was integrated.
    t
        Times (n,), s.
    R_WB
        Attitudes (n, 3, 3), body to world, as the method has them: not tidied up.
    w_WB_B
        Angular velocities (n, 3), rad/s, body axes.
    label
        Who made it, with version and setting, such as `mujoco==4.0.0/RK4`.
    counters
        Work done.
    failure
        What ended the run early, as the exception that `integrate` raises; the samples then end before it. Else None.
    choice
        Method, step and estimated error, where `integrate` was asked for an error instead of a method. Else None.
    """

    scene: Scene
    t: Array
    R_WB: Array
    w_WB_B: Array
    label: str
    counters: Counters = field(default=Counters(0))
    failure: IntegrationFailed | None = None
    choice: Choice | None = None

    @property
    def outcome(self) -> Outcome:
        """How the run ended: ok, or what failed and when."""
        return OK if self.failure is None else self.failure.outcome

    @property
    def ok(self) -> bool:
        """Whether the run reached its end."""
        return self.failure is None

    @cached_property
    def energy(self) -> Array:
        """Kinetic plus potential energy (n,), J."""
        return invariants.energy(self.scene.body, self.scene.potential, self.R_WB, self.w_WB_B)

    @cached_property
    def momentum_W(self) -> Array:
        """Angular momentum about the fixed point (n, 3), kg m^2/s, world axes."""
        return invariants.momentum_W(self.scene.body, self.R_WB, self.w_WB_B)

    @property
    def work(self) -> dict[str, int]:
        """Counts of work by their names, those that the method has."""
        return {name: count for name, count in vars(self.counters).items() if count is not None}

    def drift(self, invariant: Invariant) -> Array:
        """Return (I - I0) / scale of an invariant I, (n,) or (n, 3), with I0 of the scene and not of the first sample: no unit.

        `conservative.invariants.sizes` makes sizes of it, of a vector its length.
        """
        start = invariant.evaluate(self.scene.R_WB0[None], self.scene.w_WB_B0[None])
        return np.asarray((invariant.evaluate(self.R_WB, self.w_WB_B) - start) / invariant.scale)

    def to_pandas(self) -> pandas.DataFrame:
        """Return a table with a row for each sample: t, R_WB (by rows), w_WB_B, energy, momentum_W; units as above.

        Raises
        ------
        MissingExtra
            pandas, of the extra `report`, is not installed.
        """
        return presentation.table(self)

    def plot(self) -> altair.VConcatChart:
        """Return a chart of the body rates and of the drift of every invariant over time.

        Raises
        ------
        BadInput
            There are no samples.
        MissingExtra
            Altair or pandas, of the extra `report`, is not installed.
        """
        return presentation.picture(self)

    def _repr_html_(self) -> str:
        return presentation.card(self)

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        end = f"{self.t[-1]:g} s" if len(self.t) else "nothing"
        return f"Trajectory({self.scene.name!r}, {self.label!r}, {len(self)} samples to {end}, outcome={str(self.outcome)!r})"


def finite_prefix(R_WB: Array, w_WB_B: Array) -> int:
    """Return how many leading samples of attitudes (n, 3, 3) and rates (n, 3), rad/s, are finite."""
    finite = np.isfinite(R_WB).all(axis=(1, 2)) & np.isfinite(w_WB_B).all(axis=1)
    return len(R_WB) if np.all(finite) else int(np.argmin(finite))
