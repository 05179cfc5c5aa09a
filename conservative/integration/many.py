"""`integrate_many`: thousands of initial states and bodies in one kind of scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..batch import Batch
from ..check import describe, positive_integer
from ..errors import BadInput
from ..grid import grid_for
from ..method import Method
from ..outcome import ChoiceForMany, ProgressOfMany
from ..scene import Scene
from .blocks import list_blocks, run_blocks, start_workers
from .ensemble import Ensemble, ensemble_of_one, read_ensemble
from .inputs import read_bodies
from .memory import Memory, write_memory
from .one import ROD, interrupt_of, read_error, read_method, read_target, require_support, warn_of_steps
from .shared_choice import choose_for_all, pick_hardest, require_steps
from .store import open_store, write_store

if TYPE_CHECKING:
    from distributed import Client
_COMPARED = (
    "such a part cannot be compared with the same part of the earlier run. To resume runs, give it as numbers or as a table "
    "(times, values), or as a function that reads numbers and arrays only"
)


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
    progress: Callable[[ProgressOfMany], object] | None = None,
    path: str | Path | None = None,
    resume: bool = False,
    client: Client | None = None,
) -> Ensemble:
    """Integrate n independent bodies from n initial states.

    Parameters
    ----------
    scene
        The scene of all bodies. It provides everything that is not given here. In free flight the rotation is integrated, and
        trajectories have the positions that follow from it and the exact parabola of the centre of mass.
    R_WB0
        Attitudes at t = 0 (n, 3, 3), body to world, or n rotations as a SciPy `Rotation`.
    w_WB_B0
        Angular velocities at t = 0 (n, 3), rad/s, body axes.
    inertia
        Principal moments (n, 3) or tensors (n, 3, 3) about the fixed point, body axes, kg m^2.
    parameters
        Numbers (n, ...) of the scene's potential by the names of its fields, such as {"weight": ..., "com_B": ...}.
    dt, t_end
        Step size and duration, s, as in `integrate`. All bodies have the same steps.
    method
        A method, or its name. Without a method and a step, both are chosen as for `error=1e-6`, as in `integrate`.
    sample_every
        Store every `sample_every`-th step, and the first and last state.
    error
        Target for the attitude error of every body over the run, rad, instead of a method and a step size; dt is then the
        sampling interval. Both are chosen for the bodies that may rotate fastest and some random ones, and verified on others
        (`conservative.integration.shared_choice`). `ensemble.choice` has the result, the largest estimated error, and the
        number of examined bodies. If one of them misses the target, the warning `AccuracyNotReached` is issued. Errors of
        other bodies may be larger, for example near a separatrix, which amplifies errors.
    threads
        Number of threads; default: the number of processors of this process. Results do not depend on it.
    progress
        Called with a `ProgressOfMany` after each block of bodies, for example `print`.
    path
        A new folder, to which samples are written block by block (`conservative.integration.store`), so that they need not fit
        in memory. The returned ensemble reads them from there, as `open_ensemble(path)` does later.
    resume
        True if the folder may contain some blocks of the same run. Missing and damaged blocks are then computed. The result is
        the same, byte for byte, as without an interruption. Functions of the scene have to be comparable
        (`conservative.identity`).
    client
        A `dask.distributed.Client`, on whose workers the blocks run instead of threads of this process.

    Raises
    ------
    BadInput
        An argument is invalid: shapes do not match, or a body is not possible (the message has its number). Or the folder
        exists and `resume` is False, or contains something else or another run. Or the cluster has no workers, or some with
        another version of this package.
    NotWritten
        The folder cannot be written, or the disk is full. Finished blocks stay there.
    ImpossibleInertia, LargeEnsemble
        Warnings: an inertia that no mass distribution has; the samples take more than 1 GB of memory, without a `path`.
    MissingExtra
        Zarr (extra `ensembles`) or Dask (extra `cluster`) is not installed.
    MissingEngine
        The method needs an engine that is not installed.
    Unsupported
        The method does not support the scene.
    """
    if not isinstance(scene, Scene):
        raise BadInput("scene", describe(scene), "a Scene, such as conservative.scenes.brick_flip()")
    scene = scene.now()
    if resume and (unknown := scene.identity.unknown):
        got = f"True, for the scene {scene.name!r} with {unknown}"
        raise BadInput("resume", got, f"False: {_COMPARED}")
    flight, scene = scene.flight, scene.rotation_only
    _check_options(threads, progress, path, resume)
    only_scene = R_WB0 is None and w_WB_B0 is None and inertia is None and parameters is None
    bodies = scene.derive(Batch.of) if only_scene else read_bodies(scene, R_WB0, w_WB_B0, inertia, parameters)
    flying = bodies if flight is None else replace(bodies, scene=bodies.scene.rename(bodies.scene.name, flight=flight))
    choice: ChoiceForMany | None = None
    error = read_error(error, method, dt)
    try:
        if error is None:
            chosen = read_method(method, bodies.first)
            grid = grid_for(bodies.first, dt, t_end, sample_every)
            require_support(chosen, bodies.first)
            warn_of_steps(bodies.first, chosen, grid, _find_rod(bodies))
            if len(bodies) > 1:  # the run of a single body raises the error itself
                require_steps(chosen, bodies, grid)
        else:
            choice = choose_for_all(bodies, error, *read_target(bodies.first, error, method, dt, t_end, sample_every))
            chosen, grid = choice.method, choice.grid
        if len(bodies) == 1 and path is None and client is None:
            ensemble = ensemble_of_one(flying, grid, chosen.solve(bodies.first, grid), choice)
            if progress is not None:
                progress(ProgressOfMany(0.0, 1, 1))
            return ensemble
        blocks = list_blocks(len(bodies), grid)
        label = chosen.label
        target = write_memory(label, flying, grid) if path is None else write_store(path, label, flying, grid, resume)
        with start_workers(client, threads, len(blocks)) as workers, target as store:
            left = [first for first in blocks if not store.is_whole(first)]
            run_blocks(chosen, bodies, grid, workers, left, store.write, progress)
        if isinstance(store, Memory):
            return replace(store.ensemble(), choice=choice)
        whole = open_store(store.place)
        return replace(read_ensemble(whole, whole.read_bodies(flying.scene, compare=False)), choice=choice)
    except SystemError as failure:
        raise interrupt_of(failure)  # noqa: B904  # if it is the failure itself, it keeps its own cause


def _find_rod(bodies: Batch) -> Scene:
    """Return the rod that may rotate fastest; the first body if there is none."""
    moments = bodies.scene.body.moments[None] if bodies.inertia is None else bodies.principal[0]
    a, b, c = moments.T  # reductions along an axis of three take 25 times as long
    if (np.maximum(np.maximum(a, b), c) <= ROD * np.minimum(np.minimum(a, b), c)).all():
        return bodies.first
    hardest = (bodies.take(i) for i in pick_hardest(bodies))
    return next((scene for scene in hardest if scene.body.condition > ROD), bodies.first)


def _check_options(threads: object, progress: object, path: object, resume: object) -> None:
    """Raise `BadInput` if one of these arguments of `integrate_many` is invalid."""
    if progress is not None and not callable(progress):
        raise BadInput("progress", describe(progress), "a function of a ProgressOfMany, such as print, or None")
    if not isinstance(path, str | Path | None):
        raise BadInput("path", describe(path), "the path of a folder, or None")
    if not isinstance(resume, bool):
        raise BadInput("resume", describe(resume), "True or False")
    if resume and path is None:
        raise BadInput("resume", "True", "False without a path, because there is no run to resume")
    if threads is not None:
        positive_integer("threads", threads, "a number of threads, 1 or more, or None for one per processor")
