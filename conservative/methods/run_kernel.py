"""Run a kernel that makes steps, and return its samples as a trajectory."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from threading import get_ident, main_thread
from typing import Any

import numpy as np

from ..attitude import Array
from ..errors import Diverged, IntegrationFailed, NotConverged, WrongBranch
from ..grid import Grid
from ..scene import Scene
from ..trajectory import Counters, Trajectory
from .pieces import list_pieces, march_pieces
from .principal_axes import PrincipalStart

_main = main_thread().ident
"""Identifier of the main thread, stored because it takes 0.2 us to ask for."""


def _find_main() -> None:
    global _main
    _main = main_thread().ident


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_find_main)  # the thread that forks is the main thread of the child


class KernelRun(partial[Trajectory]):
    """A run, and its function `own_loop`: the compiled code alone, which fills arrays (`Method.prepare`).

    A `partial`, because a call takes 0.04 us more than a call of a function; a method `__call__` takes 0.06 us more.
    """

    __slots__ = ("own_loop",)
    own_loop: Callable[[], Any]


def prepare_run(
    scene: Scene,
    grid: Grid,
    label: str,
    start: PrincipalStart,
    kernel: Any,
    model: Any,
    coefficients: Any,
    find_coefficients: Callable[[float], Any] | None = None,
) -> KernelRun:
    """Return the run of a kernel with its model and coefficients (`conservative.kernels.protocol`).

    Where a load is not smooth, steps are divided: `find_coefficients` returns the coefficients of a part of a step, s.

    `start` turns the samples from principal to body axes. Everything that all calls share is made here, including the arrays q
    and L, because calls of one run do not overlap. With loads, L has four more columns, for `Trajectory.supplied`.
    """
    n, loaded, last = grid.n_samples, scene.loaded, (grid.n_steps, grid.every)
    q, L, axes = np.empty((n, 4)), np.empty((n, 7 if loaded else 3)), start.axes(grid.dt)
    if find_coefficients and len(breaks := scene.smoothness(grid.last).breaks):
        pieces = list_pieces(grid, breaks)
        enter, rest = partial(march_pieces, pieces, kernel, model, find_coefficients, grid), (q, L, axes)
    elif hasattr(kernel, "bind"):
        enter, rest = partial(kernel.bind(model, coefficients, axes), *last), (q, L)
    else:
        enter, rest = partial(kernel.enter, *model, *coefficients, *last), (q, L, axes)
    supplied = (lambda: L[:, 3:].copy()) if loaded else None
    return build_run(scene, grid, label, kernel, lambda pause: partial(enter, pause, *rest), supplied)


def build_run(
    scene: Scene,
    grid: Grid,
    label: str,
    kernel: Any,
    with_pause: Callable[[int], Callable[[Array, Array], Any]],
    supplied: Callable[[], Array] | None = None,
) -> KernelRun:
    """Return a run of compiled code that fills attitudes (n, 3, 3) and rates (n, 3), and returns what `deliver` returns.

    `with_pause` returns the code with this pause between two calls of handlers of signals. `supplied` returns
    `Trajectory.supplied` after a call.
    """
    n, t = grid.n_samples, grid.t
    of_R, of_w, empty, new = (n, 3, 3), (n, 3), np.empty, object.__new__
    in_main_thread, in_other_threads = with_pause(kernel.PAUSE), with_pause(0)  # handlers run in the main thread only
    seen: tuple[Any, ...] = ()
    # The dictionary of a trajectory: its constructor takes three times as long.
    whole: dict[str, Any] = {}

    def run() -> Trajectory:
        R_WB, w_WB_B = empty(of_R), empty(of_w)
        result = (in_main_thread if get_ident() == _main else in_other_threads)(R_WB, w_WB_B)
        if result != seen:  # at the first call: later ones are equal, and share its counters
            if failed := look_at(result, R_WB, w_WB_B):
                return failed
        trajectory = new(Trajectory)
        values = trajectory.__dict__
        values.update(whole)
        values["R_WB"], values["w_WB_B"] = R_WB, w_WB_B
        if supplied:
            values["supplied"] = supplied()
        return trajectory

    def look_at(result: tuple[Any, ...], R_WB: Array, w_WB_B: Array) -> Trajectory | None:
        """Prepare the trajectories of a result; return the trajectory that ended early if it did."""
        nonlocal seen, whole
        done, stages, corrections, evaluations, size, elsewhere, finite = result
        counters, n_good = Counters(done, stages, corrections, evaluations), grid.count_samples(done)
        if done == grid.n_steps and finite == n:
            whole = vars(Trajectory(scene, t, R_WB, w_WB_B, label, counters)).copy()
            whole["_times"] = whole.pop("t")  # copied when it is asked for
            seen = result
            return None
        if finite < n_good:
            failure: IntegrationFailed = Diverged(float(t[max(finite - 1, 0)]))
        else:
            failure = (WrongBranch if elsewhere else NotConverged)(done + 1, done * grid.dt, size, kernel.FAILURE)
        more = supplied()[:finite] if supplied else None
        return Trajectory(scene, t[:finite].copy(), R_WB[:finite], w_WB_B[:finite], label, counters, failure, None, more)

    whole_run = KernelRun(run)
    whole_run.own_loop = partial(in_other_threads, empty(of_R), empty(of_w))
    return whole_run
