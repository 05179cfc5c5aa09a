"""Trajectories, the results of methods, and the checks of a run."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from . import invariants, presentation
from .attitude import Array, orthonormality
from .deferred_imports import kernels
from .errors import Diverged, IntegrationFailed, InvalidResult, NotConserved
from .grid import Grid
from .invariants import Invariant, sizes
from .outcome import OK, Outcome
from .outcome import Choice as Choice
from .outcome import Counters as Counters
from .scene import Scene

if TYPE_CHECKING:
    import altair
    import pandas


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Samples of a motion.

    Attributes
    ----------
    scene, t
        The scene, and the times (n,), s.
    R_WB
        Attitudes (n, 3, 3), body to world, as the method returns them, without orthonormalization.
    w_WB_B
        Angular velocities (n, 3), rad/s, body axes.
    label, counters
        Method with version and setting, such as `mujoco==4.0.0/RK4`, and counts of its work.
    failure
        The exception that `integrate` raises if the run ended early, otherwise None. The samples end before the failure.
    choice
        Method, step size and estimated error of a run with a target error, otherwise None.
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
        """How the run ended: ok, or the failure and its time."""
        return OK if self.failure is None else self.failure.outcome

    @property
    def ok(self) -> bool:
        """Whether the run reached its end."""
        return self.failure is None

    @cached_property
    def energy(self) -> Array:
        """Kinetic plus potential energy (n,), J. It is not conserved in a field that depends on time."""
        return invariants.energy(self.scene.body, self.scene.potential, self.R_WB, self.w_WB_B, self.t)

    @cached_property
    def momentum_W(self) -> Array:
        """Angular momentum about the fixed point (n, 3), kg m^2/s, world axes."""
        return invariants.momentum_W(self.scene.body, self.R_WB, self.w_WB_B)

    @property
    def work(self) -> dict[str, int]:
        """Counts of work by name, without those that the method does not provide."""
        return {name: count for name, count in vars(self.counters).items() if count is not None}

    def drift(self, invariant: Invariant | str) -> Array:
        """Return the drift (I - I0) / scale of an invariant I, (n,) or (n, 3); I0 is its value in the scene's initial state.

        The invariant is one of `scene.invariants`, or its name, such as "energy". `conservative.invariants.sizes` returns
        magnitudes.

        Raises
        ------
        BadInput
            The scene has no such invariant.
        """
        invariant = invariants.find_invariant(invariant, self.scene.invariants)
        start = invariant.evaluate(self.scene.R_WB0[None], self.scene.w_WB_B0[None])
        R = self.scene.in_field_axes(self.R_WB, self.t)
        return np.asarray((invariant.evaluate(R, self.w_WB_B) - start) / invariant.scale)

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


START_TOLERANCE = 1e-6
"""Largest difference of the first sample from the initial state: of attitudes, and of rates relative to their size."""


@dataclass(frozen=True)
class Bounds:
    """Limits for every sample of a run with the outcome ok, dimensionless.

    `drift` limits the drift of the invariants that a method conserves, relative to their scales. `orthonormality` limits the
    largest component of |R'R - 1|.
    """

    drift: float
    orthonormality: float


def accept(found: Any, scene: Scene, steps: Grid, method: Any, bounds: Bounds) -> Trajectory:
    """Return the trajectory if it passes every check, otherwise its valid samples and the failure.

    Parameters
    ----------
    found
        The result of a run, which should be a `Trajectory`.
    scene, steps
        Scene and grid of the run.
    method, bounds
        The `Method`, and its bounds on the invariants that it conserves. If it has a kernel, a compiled check runs first. If
        that passes, no other check is made.
    """
    mistake = _find_mistake(found, scene, steps)
    kept = method.conserves
    if mistake is None and method.card.kernel and found.failure is None and _is_kept(found, steps, kept, bounds):
        return found
    with np.errstate(all="ignore"):
        mistake = mistake or _find_misplaced(found, steps)
        if mistake is not None:
            nothing = np.empty(0), np.empty((0, 3, 3)), np.empty((0, 3))
            return Trajectory(scene, *nothing, method.label, failure=InvalidResult(method.label, mistake))
        return _cut_at_drift(_cut_to_finite(found), kept, bounds)


def accept_samples(found: Trajectory, kept: frozenset[str], bounds: Bounds) -> Trajectory:
    """Return the samples of a run, at any times, before the first one outside the bounds of the invariants named `kept`."""
    with np.errstate(all="ignore"):
        return _cut_at_drift(_cut_to_finite(found), kept, bounds)


def _find_mistake(found: Any, scene: Scene, steps: Grid) -> str | None:
    """Return the error in type, shape or scene of a result, or None."""
    if not isinstance(found, Trajectory):
        return f"a {type(found).__name__}, no Trajectory"
    if found.scene is not scene:
        return "the trajectory of another scene"
    return _find_mistyped(found, steps)


def _find_mistyped(found: Any, steps: Grid) -> str | None:
    """Return the error in type or shape of a field of a `Trajectory`, or None."""
    if not isinstance(found.counters, Counters) or not isinstance(found.failure, IntegrationFailed | None):
        return "counters or a failure of another type"
    n = len(found.t) if found.failure is not None and isinstance(found.t, np.ndarray) else steps.n_samples
    for name, values, shape in (("t", found.t, (n,)), ("R_WB", found.R_WB, (n, 3, 3)), ("w_WB_B", found.w_WB_B, (n, 3))):
        if not isinstance(values, np.ndarray):
            return f"{name} as a {type(values).__name__}"
        if values.dtype != np.float64 or values.shape != shape:
            return f"{name} of shape {values.shape} and type {values.dtype} instead of {shape} and float64"
    return None


def _find_misplaced(found: Trajectory, steps: Grid) -> str | None:
    """Return the error in times or initial state of the samples, or None."""
    t = steps.t
    if len(found) > len(t) or not np.allclose(found.t, t[: len(found)], rtol=1e-12, atol=0):
        return "samples at other times than those of the grid"
    R_off = np.abs(found.R_WB[:1] - found.scene.R_WB0) > START_TOLERANCE
    w_off = np.abs(found.w_WB_B[:1] - found.scene.w_WB_B0) > START_TOLERANCE * np.abs(found.scene.w_WB_B0).max()
    return "a first sample that is not the start" if R_off.any() or w_off.any() else None


def _is_kept(found: Trajectory, steps: Grid, kept: frozenset[str], bounds: Bounds) -> bool:
    """Return whether compiled code finds all samples within the bounds and all times right."""
    scene = found.scene
    V = invariants.conserved_part(scene.body, scene.potential, scene.in_field_axes(found.R_WB, found.t), found.w_WB_B)
    J, constants = scene.derive(invariants.kernel_constants, kept)
    times, allowed = (steps.dt, steps.every, steps.n_steps, found.t), (bounds.drift, bounds.orthonormality)
    return bool(kernels("drifts").are_kept(*times, found.R_WB, found.w_WB_B, V, J, constants, *allowed))


def _cut_to_finite(found: Trajectory) -> Trajectory:
    """Return the samples before the first that is not finite, with the failure."""
    good = finite_prefix(found.R_WB, found.w_WB_B)
    failure = found.failure or Diverged(float(found.t[max(good - 1, 0)]))
    return found if good == len(found) else _cut(found, good, failure)


def _cut_at_drift(found: Trajectory, kept: frozenset[str], bounds: Bounds) -> Trajectory:
    """Return the samples before the first that is beyond a bound, with the failure; those of a failed run as they are."""
    if found.failure is not None:
        return found
    quantities = [("orthonormality", orthonormality(found.R_WB), bounds.orthonormality)]
    for invariant, size in invariants.kept_sizes(found.scene, kept).items():
        quantities.append((invariant.name, sizes(found.drift(invariant)) * (invariant.scale / size), bounds.drift))
    good, (name, values, bound) = min(((_count_within(*entry[1:]), entry) for entry in quantities), key=lambda pair: pair[0])
    if good == len(found):
        return found
    return _cut(found, good, NotConserved(float(found.t[max(good - 1, 0)]), name, float(values.max()), bound))


def _count_within(values: Array, bound: float) -> int:
    """Return how many leading values (n,) are within a bound."""
    within = values <= bound
    return len(values) if within.all() else int(np.argmin(within))


def _cut(found: Trajectory, n: int, failure: IntegrationFailed) -> Trajectory:
    return replace(found, t=found.t[:n], R_WB=found.R_WB[:n], w_WB_B=found.w_WB_B[:n], failure=failure)


def finite_prefix(R_WB: Array, w_WB_B: Array) -> int:
    """Return how many leading samples of attitudes (n, 3, 3) and rates (n, 3), rad/s, are finite."""
    if np.isfinite(R_WB).all() and np.isfinite(w_WB_B).all():  # nearly always, and in a third of the time
        return len(R_WB)
    finite = np.isfinite(R_WB).all(axis=(1, 2)) & np.isfinite(w_WB_B).all(axis=1)
    return int(np.argmin(finite))
