"""Trajectories, the results of methods, and the checks of a run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from . import invariants, presentation
from .attitude import Array, angle_between, orthonormality, to_quaternion
from .check import describe, has_masked
from .deferred_imports import PACKAGES, load_entry
from .errors import BadInput, Diverged, IntegrationFailed, NotConserved, RemovedAttribute, nearest, require_extra
from .grid import Grid
from .invariants import Invariant, sizes
from .number_text import rounded_up
from .outcome import OK, Outcome
from .outcome import Choice as Choice
from .outcome import Counters as Counters
from .scene import Scene

if TYPE_CHECKING:
    import altair
    import pandas


class StepControl(NamedTuple):
    """The sum of the local errors of all steps, rad, and a time, s, near which functions are not smooth; None if they are."""

    local: float
    rough: float | None


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
    supplied
        Work, J, and impulse, N m s, world axes, of torque and damping up to each sample (n, 4), as the method's own steps sum
        them; None for scenes without them and for methods that do not provide it.
    frame
        Positions (n, 3), m, and velocities (n, 3), m/s, as an engine integrated them in free flight, otherwise None.
    control
        Errors of steps that a tolerance controls, for methods that provide them, otherwise None.
    """

    scene: Scene
    t: Array
    R_WB: Array
    w_WB_B: Array
    label: str
    counters: Counters = field(default=Counters(0))
    failure: IntegrationFailed | None = None
    choice: Choice | None = None
    supplied: Array | None = None
    frame: tuple[Array, Array] | None = None
    control: StepControl | None = None

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Return the times, or the scene, of a trajectory that compiled code has filled: runs leave them out.

            All runs on a grid share `_times`, of which a copy takes 0.3 us; `_scene` makes the scene of another start.
            """
            own = self.__dict__
            if name == "t" and "_times" in own:
                own["t"] = own["_times"].copy()
            elif name == "scene" and "_scene" in own:
                own["scene"] = own["_scene"]()
            else:
                return object.__getattribute__(self, name)  # raises the error of an attribute that is missing or gone
            return own[name]

        def __getstate__(self) -> dict[str, Any]:
            kept = {name: value for name, value in self.__dict__.items() if name not in ("_times", "_scene")}
            return kept | {"scene": self.scene, "t": self.t}

    @property
    def outcome(self) -> Outcome:
        """Outcome of the run: ok, or the failure and its time."""
        return OK if self.failure is None else self.failure.outcome

    @property
    def ok(self) -> bool:
        """True if the run reached its end."""
        return self.failure is None

    @property
    def p_WB(self) -> Array | None:
        """Positions (n, 3), m, world axes, of the origin of the body frame in free flight, otherwise None.

        They are the engine's. If the method integrates the rotation only, they follow from its attitudes and the
        exact parabola of the centre of mass.
        """
        return self.place[0] if self.scene.flight else None

    @property
    def v_WB(self) -> Array | None:
        """Velocities (n, 3), m/s, world axes, of the origin of the body frame in free flight, otherwise None; as `p_WB`."""
        return self.place[1] if self.scene.flight else None

    @cached_property
    def place(self) -> tuple[Array, ...]:
        """`p_WB` and `v_WB` in free flight, otherwise ()."""
        flight = self.scene.flight
        if self.frame or not flight:
            return self.frame or ()
        return flight.follow(flight.fall(self.scene, self.t), self.R_WB, self.w_WB_B)

    @cached_property
    def energy(self) -> Array:
        """Kinetic plus potential energy (n,), J. It is not conserved in a field that depends on time.

        In free flight it is the energy of the rotation about the centre of mass.
        """
        return invariants.energy(self.scene.body, self.scene.potential, self.R_WB, self.w_WB_B, self.t)

    @cached_property
    def momentum_W(self) -> Array:
        """Angular momentum about the fixed point, or a free body's centre of mass (n, 3), kg m^2/s, world axes."""
        return invariants.momentum_W(self.scene.body, self.R_WB, self.w_WB_B, self.t)

    @property
    def quaternion_wxyz(self) -> Array:
        """Attitudes as unit quaternions (n, 4), body to world, scalar first and not negative."""
        return to_quaternion(self.R_WB)

    @property
    def work(self) -> dict[str, int]:
        """Counts of work by name, without those that the method does not provide."""
        return {name: count for name, count in vars(self.counters).items() if count is not None}

    def drift(self, invariant: Invariant | str) -> Array:
        """Return the drift (I - I0) / scale of an invariant I, (n,) or (n, 3); I0 is its value in the scene's initial state.

        The invariant is one of `scene.invariants`, or its name, such as "energy". `conservative.invariants.sizes` returns
        magnitudes. In a scene with a torque or damping, the drift belongs to the balance I - I0 - supplied, and nan if the
        method does not provide `supplied`.

        Raises
        ------
        BadInput
            The scene has no such invariant.
        """
        if isinstance(invariant, str):
            by_name = {entry.name: entry for entry in self.scene.invariants}
            if invariant not in by_name:
                raise BadInput("invariant", describe(invariant), nearest(invariant, by_name))
            invariant = by_name[invariant]
        change = self.values_of(invariant) - self.scene.initial_value(invariant)
        if invariant.supplied is not None:
            change = change - (np.nan if self.supplied is None else invariant.supplied(self.supplied))
        return np.asarray(change / invariant.scale)

    def values_of(self, invariant: Invariant) -> Array:
        """Return the values of an invariant at the samples, (n,) or (n, 3), in its unit."""
        more = (*self.place, self.t) if isinstance(invariant, invariants.InvariantInTime) else ()
        return invariant.evaluate(self.scene.in_field_axes(self.R_WB, self.t), self.w_WB_B, *more)

    def error(self, truth: Trajectory) -> Array:
        """Return the attitude error (n,), rad: the angle between this attitude and the attitude of `truth` at each sample.

        Raises
        ------
        BadInput
            The two do not have samples at the same times.
        """
        if len(self) != len(truth) or not np.allclose(self.t, truth.t, rtol=1e-12, atol=0):
            raise BadInput("truth", repr(truth), f"a trajectory with the times of {self!r}")
        return angle_between(truth.R_WB, self.R_WB)

    def to_pandas(self) -> pandas.DataFrame:
        """Return a table with a row for each sample: t, R_WB (by rows), q_WB, w_WB_B, energy, momentum_W; units as above.

        Raises
        ------
        MissingExtra
            pandas, of the extra `report`, is not installed.
        """
        require_extra("Trajectory.to_pandas", "report", "pandas")
        import pandas as pd

        frame = pd.DataFrame(presentation.samples(self), columns=presentation.columns(self))
        frame.attrs = {"scene": self.scene.name, "method": self.label, "outcome": str(self.outcome)}
        return frame

    to_xarray = RemovedAttribute()

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

    def animate(self, *others: Trajectory, labels: Sequence[str] | None = None, truth: Trajectory | None = None) -> Any:
        """Return an animation of this motion, and of others beside it on the same clock (`conservative.reports.animation`).

        A notebook shows it. Its method `save(path)` writes a page (.html), or with the extra `video` a .gif or .png.

        Parameters
        ----------
        others
            Trajectories of the same scene; their steps can differ.
        labels
            Titles of the panels; default: the labels of the trajectories.
        truth
            The reference solution, which has a panel, and is an outline in the others; these show their attitude error at
            their own samples. If the samples of the truth have other times, they are moved there by integration.
        """
        shown = [self, *others]
        if truth is not None and not any(trajectory is truth for trajectory in shown):
            shown.append(truth)
        index = next((number for number, trajectory in enumerate(shown) if trajectory is truth), None)
        animation = load_entry(PACKAGES, PACKAGES, "animation")
        return animation(shown, labels or [trajectory.label for trajectory in shown], index)

    def _repr_html_(self) -> str:
        rows = [
            ("scene", self.scene.name),
            ("method", self.label),
            ("outcome", str(self.outcome)),
            ("samples", f"{len(self)} to {self._end}"),
            ("work", ", ".join(f"{count} {name}" for name, count in self.work.items())),
        ]
        drifts = ((invariant.name, sizes(self.drift(invariant)).max(initial=0.0)) for invariant in self.scene.invariants)
        rows += [(f"drift of {name}", f"{rounded_up(drift, 3):.2e} (relative)") for name, drift in drifts]
        return presentation.html_table("Trajectory", rows)

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        outcome = str(self.outcome)
        return f"Trajectory({self.scene.name!r}, {self.label!r}, {len(self)} samples to {self._end}, {outcome=})"

    @property
    def _end(self) -> str:
        return f"{self.t[-1]:g} s" if len(self) else "nothing"


START_TOLERANCE = 1e-6
"""Largest difference of the first sample from the initial state: of attitudes, and of rates relative to their size."""
START_ROUNDING = 16.0
"""Largest difference of the first momentum from the initial one, in units of its round-off (measured: up to 1.9)."""


_FLOAT, _ROUND_OFF = np.dtype(np.float64), float(np.finfo(np.float64).eps)


LOOSEST = 1e-3
"""Upper limit of all bounds of our methods, for any tolerance, body, field and number of steps."""
STEEP = 32.0
"""Drift that rounding the attitude may cause in a field with a singularity, in units of round-off times `Scene.steepness`
(measured: up to 1.4)."""


class Bounds(NamedTuple):
    """Limits for every sample of a run with the outcome ok, dimensionless.

    `drift` limits the drift of the invariants that a method conserves, relative to their scales (see `drift_limit`).
    `orthonormality` limits the largest component of |R'R - 1|. `energy` limits the drift of the energy, or of the Jacobi
    integral in a turning field, for methods that do not conserve it: a run beyond it has diverged.
    """

    drift: float
    orthonormality: float
    energy: float = 1.0


def find_mistake(result: Any, scene: Scene, grid: Grid) -> str | None:
    """Return the error in type, shape or scene of the result of a run on a grid, or None if it is a trajectory of the scene."""
    is_trajectory: bool = isinstance(result, Trajectory)
    if not is_trajectory:
        return f"a {type(result).__name__}, not a Trajectory"
    if result.scene is not scene:
        return "the trajectory of another scene"
    if not isinstance(result.counters, Counters):
        return "counters of another type"
    n = grid.n_samples
    if result.failure is not None:
        if not isinstance(result.failure, IntegrationFailed):
            return "a failure of another type"
        n = len(result.t) if isinstance(result.t, np.ndarray) else n
    for name, values, shape in (("t", result.t, (n,)), ("R_WB", result.R_WB, (n, 3, 3)), ("w_WB_B", result.w_WB_B, (n, 3))):
        if not isinstance(values, np.ndarray) or has_masked(values):
            return f"{name} as a {type(values).__name__}{' with masked entries' * has_masked(values)}"
        if values.shape != shape or values.dtype != _FLOAT:
            return f"{name} of shape {values.shape} and type {values.dtype} instead of {shape} and float64"
    frame: Any = result.frame
    if frame is not None and (scene.flight is None or [np.shape(part) for part in frame] != [(n, 3)] * 2):
        return "positions and velocities that are not two arrays (n, 3) in free flight"
    return None


def find_misplaced(result: Trajectory, grid: Grid) -> str | None:
    """Return the error in times or initial state of the samples of a run on a grid, or None."""
    t, scene = grid.t, result.scene
    if len(result) > len(t) or not np.allclose(result.t, t[: len(result)], rtol=1e-12, atol=0):
        return "samples at times that are not in the grid"
    R_off = np.abs(result.R_WB[:1] - scene.R_WB0) > START_TOLERANCE
    # At rest, rates are relative to the fastest that the energy allows.
    speed = float(np.abs(scene.w_WB_B0).max()) or math.sqrt(2 * scene.energy_scale / float(scene.body.moments.min()))
    # Rates computed from a momentum have its round-off over a moment: of their axis, or of any if the axes are computed.
    least = scene.body.moments if np.array_equal(scene.body.R_BP, np.eye(3)) else scene.body.moments.min()
    rounding = START_ROUNDING * _ROUND_OFF * np.linalg.norm(scene.body.inertia @ scene.w_WB_B0) / least
    w_off = np.abs(result.w_WB_B[:1] - scene.w_WB_B0) > START_TOLERANCE * speed + rounding
    off = bool(R_off.any() or w_off.any())
    if scene.flight and result.frame:
        arm = np.linalg.norm(scene.flight.com_B) * np.array([1.0, np.linalg.norm(scene.w_WB_B0)])
        for values, start, size in zip(result.frame, (scene.flight.p_WB0, scene.flight.v_WB0), arm, strict=True):
            off |= bool((np.abs(values[:1] - start) > START_TOLERANCE * (np.abs(start).max() + size)).any())
    return "a first sample that is not the start" if off else None


def cut_at_failure(result: Trajectory, conserved: frozenset[str], bounds: Bounds) -> Trajectory:
    """Cut a trajectory before the first invalid sample: one that is not finite or, if the run reached its end, exceeds a bound.

    `conserved` are the names of the bounded invariants. A trajectory without invalid samples is returned unchanged. One that
    is cut contains the failure.
    """
    with np.errstate(all="ignore"):
        n = len(result)
        if not (np.isfinite(result.R_WB).all() and np.isfinite(result.w_WB_B).all()):  # this alone is three times as fast
            n = int(np.argmin(np.isfinite(result.R_WB).all(axis=(1, 2)) & np.isfinite(result.w_WB_B).all(axis=1)))
        if n < len(result):
            return _cut(result, n, result.failure or Diverged(float(result.t[max(n - 1, 0)])))
        if result.failure is not None:
            return result
        limit = drift_limit(result.scene, bounds)
        quantities = [("orthonormality", orthonormality(result.R_WB), bounds.orthonormality)]
        for invariant, size in invariants.kept_sizes(result.scene, conserved).items():
            scale = size + _most_supplied(result, invariant)
            quantities.append((invariant.name, sizes(result.drift(invariant)) * (invariant.scale / scale), limit))
        if (energy := invariants.find_energy(result.scene.invariants)) is not None:
            quantities.append((energy.name, sizes(result.drift(energy)), bounds.energy))
    # The appended sample ends the search where all are within the bound.
    counts = [int(np.argmin(np.append(values <= bound, False))) for _, values, bound in quantities]
    n, (name, values, bound) = min(zip(counts, quantities, strict=True), key=lambda pair: pair[0])
    if n == len(result):
        return result
    time, drift = float(result.t[max(n - 1, 0)]), float(values.max())
    if name in {"orthonormality", *conserved}:
        return _cut(result, n, NotConserved(time, name, drift, bound))
    return _cut(result, n, Diverged(time, f"the drift of {name} is {drift:.3g}, the bound {bound:.3g}"))


def _most_supplied(result: Trajectory, invariant: Invariant) -> Array | float:
    """Return the most that loads have supplied to an invariant up to each sample (n,), whose round-off is part of the drift."""
    if invariant.supplied is None or result.supplied is None:
        return 0.0
    return np.asarray(np.maximum.accumulate(sizes(invariant.supplied(result.supplied))))


def drift_limit(scene: Scene, bounds: Bounds) -> float:
    """Return the limit on the drift of conserved invariants, including the effect of rounding the attitude in a steep field."""
    return max(bounds.drift, min(LOOSEST, bounds.drift + STEEP * _ROUND_OFF * scene.steepness))


def head(result: Trajectory, n: int) -> Trajectory:
    """Return the first n samples of a trajectory."""
    supplied, frame = result.supplied, result.frame
    changes: dict[str, Any] = {"supplied": None if supplied is None else supplied[:n]}
    changes["frame"] = frame and (frame[0][:n], frame[1][:n])
    return replace(result, t=result.t[:n], R_WB=result.R_WB[:n], w_WB_B=result.w_WB_B[:n], **changes)


def _cut(result: Trajectory, n: int, failure: IntegrationFailed) -> Trajectory:
    return replace(head(result, n), failure=failure)
