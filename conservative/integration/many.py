"""`integrate_many`: thousands of starts, and of bodies, of one kind of scene. Source: our own."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from ..check import SAMPLE_BYTES, describe, most_samples, positive_integer, positive_number
from ..errors import BadInput
from ..method import Grid, Method, grid_for
from ..methods.between import Samples
from ..methods.many import Bodies
from ..outcome import ChoiceForMany, ProgressOfMany
from ..scene import Scene
from .blocks import SAMPLE_BYTES as KEPT_BYTES
from .blocks import Tell, count_left, fill, list_blocks, run_blocks
from .ensemble import Ensemble, ensemble_of_one
from .inputs import only_body, read_bodies
from .one import DEFAULT_DT, interrupt_of, read_method, require_support
from .places import Place
from .shared_choice import Goal, choose_for_all, pick_hardest


def integrate_many(
    scene: Scene,
    R_WB0: ArrayLike | None = None,
    w_WB_B0: ArrayLike | None = None,
    *,
    inertia: ArrayLike | None = None,
    parameters: Mapping[str, ArrayLike] | None = None,
    dt: float | None = None,
    t_end: float | None = None,
    method: Method | str | None = None,
    sample_every: int = 1,
    error: float | None = None,
    threads: int | None = None,
    progress: Tell | None = None,
    path: str | Path | None = None,
    resume: bool = False,
    client: Any = None,
) -> Ensemble:
    """Integrate n bodies, each by itself, from n starts.

    Parameters
    ----------
    scene
        What all of them share: all that is not given here.
    R_WB0
        Attitudes at t = 0 (n, 3, 3), body to world, or n rotations of SciPy.
    w_WB_B0
        Angular velocities at t = 0 (n, 3), rad/s, body axes.
    inertia
        Principal moments (n, 3) or tensors (n, 3, 3) about the fixed point, body axes, kg m^2.
    parameters
        Numbers (n, ...) of the scene's potential by the names of its fields, such as {"weight": ..., "com_B": ...}.
    dt, t_end
        Step and duration, s, as `integrate` has them. All bodies have the same steps.
    method
        A method, or its name, as `integrate` has it.
    sample_every
        Keep every so many steps (and the first and last state).
    error
        Attitude error of every body over the run, rad, instead of a method and a step; dt then is the distance of samples.
        `conservative.integration.shared_choice` chooses both for the bodies that turn fastest and for some others, and verifies
        them on further ones: `ensemble.choice` has them, the largest estimated error, and on how many bodies it was estimated.
        A warning `AccuracyNotReached` where one of those is not near enough. Bodies that are not looked at may be further off:
        those near a separatrix, say, which amplify errors.
    threads
        How many blocks of bodies run side by side; default: as many as there are processors for this process. Numbers do not
        depend on it.
    progress
        Called with a `ProgressOfMany`, whose text is a line, after each block. `print` will do.

    path
        A new folder, to which samples go block by block (`conservative.integration.store` says how), so that they need no
        memory; the ensemble that is returned reads them from there, as `open_ensemble(path)` does later.
    resume
        Whether the folder may have some blocks of the same run, which was interrupted: the others are added. The folder is then
        the same, byte for byte, as that of a run without a break.
    client
        A `dask.distributed.Client`: blocks run on its workers, instead of threads of this process.

    Raises
    ------
    BadInput
        An argument cannot be used: shapes do not match, or a body cannot be; the message has its number. Or the folder is there
        without `resume`, or is something else or of another run; or the cluster has no workers, or some of another version.
    NotWritten
        The folder cannot be written, or the disk is full; blocks that are done are kept.
    MissingExtra
        Zarr, of the extra `ensembles`, is not installed, or Dask, of the extra `cluster`.
    MissingEngine
        A method of that name needs an engine that is not installed.
    Unsupported
        The method cannot do the scene.
    """
    if not isinstance(scene, Scene):
        raise BadInput("scene", describe(scene), "a Scene, such as conservative.scenes.brick_flip()")
    if progress is not None and not callable(progress):
        raise BadInput("progress", describe(progress), "a function of a ProgressOfMany, such as print, or None")
    place = Place(_read_threads(threads), client, path, resume)
    alone = R_WB0 is None and w_WB_B0 is None and inertia is None and parameters is None
    bodies = scene.derive(only_body) if alone else read_bodies(scene, R_WB0, w_WB_B0, inertia, parameters)
    try:
        found, grid, choice = make_plan(bodies, dt, t_end, method, sample_every, error)
        if len(bodies) == 1 and place.here:
            return run_one(found, bodies, grid, choice, progress)
        if place.path is None:
            _require_memory(bodies, grid)
        return replace(run_all(found, bodies, grid, place, progress), choice=choice)
    except SystemError as failure:
        raise interrupt_of(failure)  # noqa: B904  # where it is the failure itself, its own reasons stay


def _read_threads(value: object) -> int:
    if value is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return positive_integer("threads", value, "a number of threads, 1 or more, or None for one a processor")


def make_plan(
    bodies: Bodies,
    dt: float | None,
    t_end: float | None,
    method: Method | str | None,
    sample_every: int,
    error: float | None,
) -> tuple[Method, Grid, ChoiceForMany | None]:
    """Return the method and the grid of steps, s, as they are given, or as they were chosen for an error.

    Raises
    ------
    BadInput
        An argument cannot be used, or the method has no step of that length for a body.
    Unsupported
        The method cannot do the scene.
    """
    first = bodies.first
    if error is not None:
        wanted = positive_number("error", error, "a finite attitude error above 0, rad")
        if method is not None:
            raise BadInput("method", describe(method), "None together with error, which chooses the method")
        end = first.t_end if t_end is None else positive_number("t_end", t_end, "a finite duration above 0, s")
        samples = Samples(None if dt is None else grid_for(first, dt, end).dt, positive_integer("sample_every", sample_every))
        choice = choose_for_all(bodies, Goal(wanted, end, samples))
        return choice.method, choice.grid, choice
    found = read_method(method, first)
    grid = grid_for(first, DEFAULT_DT if dt is None else dt, t_end, sample_every)
    require_support(found, first)
    if len(bodies) > 1:  # of one, the run says the same
        require_steps(found, bodies, grid)
    return found, grid, None


def require_steps(method: Method, bodies: Bodies, grid: Grid) -> None:
    """Raise `BadInput` where the method has no step of that length for one of the bodies that turn fastest.

    A body of which only its own run shows it is `NotRun`.
    """
    for i in pick_hardest(bodies):
        scene = bodies.take(i)
        try:
            if method.unsupported(scene) is None:
                method.prepare(scene, grid)
        except BadInput as refusal:
            raise BadInput(refusal.argument, f"{refusal.got} (body {i})", refusal.allowed) from None


def _require_memory(bodies: Bodies, grid: Grid) -> None:
    """Raise `BadInput` if the samples of all bodies do not fit in memory."""
    most, samples = most_samples() * SAMPLE_BYTES // KEPT_BYTES, len(bodies) * grid.n_samples
    if samples > most:
        got = f"{grid.every}, for {samples} samples of {len(bodies)} bodies"
        raise BadInput("sample_every", got, f"a larger one, or a path: {most:.3g} samples of {KEPT_BYTES} bytes fit in memory")


def run_one(method: Method, bodies: Bodies, grid: Grid, choice: ChoiceForMany | None, progress: Tell | None) -> Ensemble:
    """Return what a single body gives, at next to no cost beside that of `integrate`."""
    found = ensemble_of_one(bodies, grid, method.solve(bodies.first, grid), choice)
    if progress is not None:
        progress(ProgressOfMany(0.0, 1, 1))
    return found


def run_all(method: Method, bodies: Bodies, grid: Grid, place: Place, progress: Tell | None) -> Ensemble:
    """Return what all blocks give, in memory or in a folder. Steps of the grid are in s."""
    what, blocks = (method.label, bodies, grid), len(list_blocks(len(bodies), grid))
    with place.start(blocks) as (executor, in_flight), place.open_sink(*what) as sink:
        results = run_blocks(method, bodies, grid, executor, in_flight, sink.done)
        fill(sink, results, (count_left(len(bodies), grid, sink.done), len(bodies)), progress)
    return place.read(sink, *what)
