"""`Ensemble`, the result of `integrate_many`: samples, drifts and outcomes of many bodies."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import Array
from ..batch import Batch
from ..check import choice as require_choice
from ..drifts import arrange_drifts, drifts_of, list_drifts
from ..errors import IntegrationFailed, RemovedAttribute, require_extra
from ..grid import Grid
from ..number_text import rounded_up
from ..outcome import OK, Choice, Counters, Outcome
from ..presentation import columns, html_table
from ..presentation import samples as sample_rows
from ..scene import Scene
from ..trajectory import Trajectory
from .blocks import BlockResult
from .store import Store, open_store, write_store

if TYPE_CHECKING:
    import altair
    import pandas

MOST_LISTED = 5
"""Largest number of failed bodies in a text."""


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Samples of the motions of n independent bodies at the same m times.

    `len(ensemble)` is the number of bodies, `ensemble[i]` the trajectory of body i, and `ensemble[:10]` an ensemble of the
    first ten.

    Attributes
    ----------
    bodies
        The bodies: `bodies.take(i)` is the scene of body i.
    grid
        Steps of length dt, s, and the stored samples.
    R_WB
        Attitudes (n, m, 3, 3), body to world; nan after a failure.
    w_WB_B
        Angular velocities (n, m, 3), rad/s, body axes; nan after a failure.
    drifts
        Largest drifts (n,), dimensionless, by name: orthonormality and the invariants of the scene. nan for a body that has no
        such invariant, or failed.
    label
        Method with version and setting.
    failures
        Exceptions of runs that ended early, by the index of the body.
    choice
        Method, step size and estimated error, if `integrate_many` had a target error, otherwise None.
    supplied
        Work, J, and impulse, N m s, world axes, of torque and damping up to each sample (n, m, 4), as in `Trajectory`; nan
        after a failure and for methods that do not provide it, None for scenes without them.
    """

    bodies: Batch
    grid: Grid
    R_WB: Array
    w_WB_B: Array
    drifts: Mapping[str, Array]
    label: str
    failures: Mapping[int, IntegrationFailed]
    choice: Choice | None = None
    supplied: Array | None = None

    @cached_property
    def t(self) -> Array:
        """Times (m,) of the samples, s."""
        return self.grid.t

    @property
    def ok(self) -> Any:
        """Booleans (n,): True for bodies whose run reached its end."""
        ok = np.ones(len(self), dtype=bool)
        ok[list(self.failures)] = False
        return ok

    def outcome(self, i: int) -> Outcome:
        """Return the outcome of body i."""
        i = range(len(self))[i]
        return self.failures[i].outcome if i in self.failures else OK

    def to_pandas(self, rows: Literal["samples", "bodies"] = "samples") -> pandas.DataFrame:
        """Return a table with a row for each sample of each body, or for each body.

        Parameters
        ----------
        rows
            "samples": index of the body, t, R_WB (by rows), q_WB, w_WB_B, energy, momentum_W, without samples after a failure.
            A million rows take about 180 MB. "bodies": outcome, time reached, s, and largest drifts, by the index of the body.

        Raises
        ------
        BadInput
            rows has another value.
        MissingExtra
            pandas, of the extra `report`, is not installed.
        """
        require_choice("rows", rows, ("samples", "bodies"))
        require_extra("Ensemble.to_pandas", "report", "pandas")
        import pandas as pd

        if rows == "samples":
            samples = [sample_rows(body) for body in self]
            frame = pd.DataFrame(np.concatenate(samples), columns=columns(self[0]))
            frame.insert(0, "body", np.repeat(np.arange(len(samples)), [len(sample) for sample in samples]))
        else:
            outcomes, reached = np.full(len(self), "ok", dtype=object), np.full(len(self), self.t[-1])
            for i, failure in self.failures.items():
                outcomes[i], reached[i] = str(failure.outcome), max(self[i].t, default=0.0)
            drifts = {f"drift of {name}": values for name, values in self.drifts.items()}
            frame = pd.DataFrame({"outcome": outcomes, "t": reached, **drifts})
            frame.index.name = "body"
        frame.attrs = {"scene": self.bodies.scene.name, "method": self.label}
        return frame

    to_xarray = RemovedAttribute()

    def plot(self, axis_B: ArrayLike | None = None) -> altair.VConcatChart:
        """Return a chart of the directions of a body axis at start and end, the spread of attitudes over time, and the drifts.

        The axis is a direction (3,) in body axes; default: the symmetry axis of body and field, or the third axis.

        Raises
        ------
        BadInput
            The axis is not a direction.
        MissingExtra
            Altair or pandas, of the extra `report`, is not installed.
        """
        require_extra("Ensemble.plot", "report", "altair", "pandas")
        from .pictures import draw_ensemble

        return draw_ensemble(self, axis_B)

    def _repr_html_(self) -> str:
        rows = [
            ("scene", self.bodies.scene.name),
            ("method", self.label),
            ("bodies", str(len(self))),
            ("samples", f"{len(self.t)} of each, to {self.t[-1]:g} s"),
            ("outcomes", self._describe_outcomes()),
        ]
        for name, values in self.drifts.items():
            worst = -1 if np.isnan(values).all() else int(np.nanargmax(values))
            largest = "none" if worst < 0 else f"{rounded_up(values[worst], 3):.2e} at most (relative, body {worst})"
            rows.append((f"drift of {name}", largest))
        return html_table("Ensemble", rows)

    def _describe_outcomes(self) -> str:
        """Return the number of runs of each outcome, and the numbers of some bodies that failed, as text."""
        failed = sorted(self.failures)
        kinds = Counter(self.failures[i].outcome.kind.value for i in failed)
        counts = [f"{len(self) - len(failed)} ok", *(f"{count} {kind}" for kind, count in kinds.most_common())]
        named = ", ".join(map(str, failed[:MOST_LISTED])) + (", ..." if len(failed) > MOST_LISTED else "")
        return ", ".join(counts) + (f" (body {named})" if failed else "")

    @overload
    def __getitem__(self, i: int) -> Trajectory: ...

    @overload
    def __getitem__(self, i: slice) -> Ensemble: ...

    def __getitem__(self, i: int | slice) -> Trajectory | Ensemble:
        if isinstance(i, slice):
            numbers = range(len(self))[i]
            return replace(
                self,
                bodies=self.bodies[i],
                R_WB=self.R_WB[i],
                w_WB_B=self.w_WB_B[i],
                supplied=None if self.supplied is None else self.supplied[i],
                drifts={name: values[i] for name, values in self.drifts.items()},
                failures={k: self.failures[number] for k, number in enumerate(numbers) if number in self.failures},
            )
        i = range(len(self))[i]
        failure, R_WB, w_WB_B = self.failures.get(i), np.asarray(self.R_WB[i]), np.asarray(self.w_WB_B[i])
        m = len(self.t) if failure is None else int(np.isfinite(w_WB_B).all(axis=1).sum())
        counters = Counters(self.grid.n_steps if failure is None else max(0, m - 1) * self.grid.every)
        supplied = None if self.supplied is None else np.asarray(self.supplied[i])[:m]
        if supplied is not None and np.isnan(supplied).any():  # the method does not provide it
            supplied = None
        samples = self.t[:m], R_WB[:m], w_WB_B[:m]
        return Trajectory(self.bodies.take(i), *samples, self.label, counters, failure, self.choice, supplied)

    def to_zarr(self, path: str | Path) -> None:
        """Write the ensemble to a new folder, from which `open_ensemble(path)` reads it: see `conservative.integration.store`.

        Raises
        ------
        BadInput
            The folder exists.
        NotWritten
            The folder cannot be written, or the disk is full.
        MissingExtra
            Zarr, of the extra `ensembles`, is not installed.
        """
        with write_store(path, self.label, self.bodies, self.grid) as store:
            for first in store.blocks:
                part = self[first : first + store.blocks.step]
                drifts = np.stack(list(part.drifts.values()), axis=1)
                result = BlockResult(part.R_WB, part.w_WB_B, drifts, dict(part.failures), part.supplied)
                store.write(first, part.bodies, result)

    def __len__(self) -> int:
        return len(self.bodies)

    def __iter__(self) -> Iterator[Trajectory]:
        return (self[i] for i in range(len(self)))

    def __repr__(self) -> str:
        name, samples = self.bodies.scene.name, f"{len(self.t)} samples to {self.t[-1]:g} s"
        return f"Ensemble({name!r}, {self.label!r}, {len(self)} bodies, {samples}, {self._describe_outcomes()})"


def open_ensemble(path: str | Path, scene: Scene | None = None) -> Ensemble:
    """Return the ensemble in a folder that `integrate_many(..., path=...)` or `Ensemble.to_zarr` has written.

    Samples and initial states stay on the disk: `ensemble.R_WB` and `ensemble.w_WB_B` are arrays of Zarr, and
    `ensemble.R_WB[:1000, -1]` reads only the blocks of the first 1000 bodies. Drifts and outcomes are read at once. Missing and
    truncated blocks raise an error here, other damage when Zarr reads it (`ValueError`).

    Parameters
    ----------
    path
        The folder.
    scene
        The scene of the run, needed only if it contains functions, as in `FunctionPotential` or `extra_invariants`.

    Raises
    ------
    BadInput
        The folder contains no ensemble, or blocks are missing or damaged; or the scene is missing, or another one.
    MissingExtra
        Zarr, of the extra `ensembles`, is not installed.
    SceneNotCompared
        A warning: the scene has a function that cannot be compared with the function of the run.
    """
    store = open_store(path)
    return read_ensemble(store, store.read_bodies(scene))


def read_ensemble(store: Store, bodies: Batch) -> Ensemble:
    """Return the ensemble of bodies in a complete store."""
    (drifts, failures), record = store.read_results(), store.record
    grid = Grid(record["dt"], record["n_steps"], record["sample_every"])
    samples = store.arrays["R_WB"], store.arrays["w_WB_B"]
    return Ensemble(bodies, grid, *samples, drifts, record["method"], failures, supplied=store.arrays.get("supplied"))


def ensemble_of_one(bodies: Batch, grid: Grid, trajectory: Trajectory, choice: Choice | None) -> Ensemble:
    """Return the ensemble of one body with this trajectory."""
    n, failure = len(trajectory), trajectory.failure
    R_WB, w_WB_B = np.full((1, grid.n_samples, 3, 3), np.nan), np.full((1, grid.n_samples, 3), np.nan)
    R_WB[0, :n], w_WB_B[0, :n] = trajectory.R_WB, trajectory.w_WB_B
    supplied = np.full((1, grid.n_samples, 4), np.nan) if bodies.scene.loaded else None
    if supplied is not None and trajectory.supplied is not None:
        supplied[0, :n] = trajectory.supplied
    measured = bodies.first.derive(drifts_of, frozenset())(grid, grid.t, R_WB, w_WB_B, supplied)
    drifts = dict(zip(list_drifts(bodies), arrange_drifts(bodies, measured, R_WB, w_WB_B).T, strict=True))
    return Ensemble(bodies, grid, R_WB, w_WB_B, drifts, trajectory.label, {0: failure} if failure else {}, choice, supplied)
