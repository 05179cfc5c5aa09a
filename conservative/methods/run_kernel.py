"""Run a kernel that makes steps, and return its samples as a trajectory."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from threading import get_ident, main_thread
from typing import Any, Self

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

    `from_start` is the function for other starts of the body. `find_restart` and `again` are as `conservative.starts` describes
    them, None if no start can be written.

    A `partial`, because a call takes 0.04 us more than a call of a function; a method `__call__` takes 0.06 us more.
    """

    __slots__ = ("again", "find_restart", "from_start", "own_loop")
    own_loop: Callable[[], Any]
    from_start: Any
    find_restart: Callable[[], Callable[[Array, Array], bool]] | None
    again: Callable[[Callable[[], Scene]], Trajectory] | None

    def __new__(cls, run: Callable[..., Trajectory]) -> Self:
        made = super().__new__(cls, run)
        made.from_start = made.find_restart = made.again = None
        return made


def prepare_run(
    scene: Scene,
    grid: Grid,
    label: str,
    start: PrincipalStart,
    kernel: Any,
    model: Any,
    coefficients: Any,
    find_coefficients: Callable[[float], Any] | None = None,
    bind_restart: Callable[[Array], Callable[[Array, Array], bool]] | None = None,
) -> KernelRun:
    """Return the run of a kernel with its model and coefficients (`conservative.kernels.protocol`).

    Where a load is not smooth, steps are divided: `find_coefficients` returns the coefficients of a part of a step, s. For
    kernels with `bind`, `bind_restart` returns the function that writes a start into the numbers of a run.

    `start` turns the samples from principal to body axes. Everything that all calls share is made here, including the arrays q
    and L, because calls of one run do not overlap. With loads, L has four more columns, for `Trajectory.supplied`.
    """
    n, loaded, last = grid.n_samples, scene.loaded, (grid.n_steps, grid.every)
    q, L, axes = np.empty((n, 4)), np.empty((n, 7 if loaded else 3)), start.axes(grid.dt)
    find_restart = None
    rest: tuple[Array, ...] = (q, L, axes)
    if find_coefficients and len(breaks := scene.smoothness(grid.last).breaks):
        pieces = list_pieces(grid, breaks)
        enter = partial(march_pieces, pieces, kernel, model, find_coefficients, grid)
    elif hasattr(kernel, "bind"):
        bound = kernel.bind(model, coefficients, axes)
        enter, rest = partial(bound, *last), (q, L)
        find_restart = partial(bind_restart, bound.args[0]) if bind_restart else None
    else:
        enter = partial(kernel.enter, *model, *coefficients, *last)
    supplied = (lambda: L[:, 3:].copy()) if loaded else None
    return build_run(scene, grid, label, kernel, lambda pause: partial(enter, pause, *rest), supplied, find_restart)


def build_run(  # noqa: PLR0915  # the functions of one run
    scene: Scene,
    grid: Grid,
    label: str,
    kernel: Any,
    with_pause: Callable[[int], Callable[[Array, Array], Any]],
    supplied: Callable[[], Array] | None = None,
    find_restart: Callable[[], Callable[[Array, Array], bool]] | None = None,
) -> KernelRun:
    """Return a run of compiled code that fills attitudes (n, 3, 3) and rates (n, 3), and returns what `deliver` returns.

    `with_pause` returns the code with this pause between two calls of handlers of signals. `supplied` returns
    `Trajectory.supplied` after a call, `find_restart` returns the function that writes another start into the numbers of
    the code.
    """
    n, t = grid.n_samples, grid.t
    of_R, of_w, empty, new = (n, 3, 3), (n, 3), np.empty, object.__new__
    in_main_thread, in_other_threads = with_pause(kernel.PAUSE), with_pause(0)  # handlers run in the main thread only
    seen: tuple[Any, ...] = ()
    # The dictionary of a trajectory: its constructor takes three times as long.
    whole: dict[str, Any] = {}

    def run(R_WB0: Any = None, w_WB_B0: Any = None) -> Trajectory:
        if R_WB0 is not None or w_WB_B0 is not None:
            return whole_run.from_start(R_WB0, w_WB_B0)
        R_WB, w_WB_B = empty(of_R), empty(of_w)
        result = (in_main_thread if get_ident() == _main else in_other_threads)(R_WB, w_WB_B)
        # At the first call: later results are equal, and share its counters.
        if result != seen and (failed := look_at(result, R_WB, w_WB_B)):
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
        if result[0] == grid.n_steps and result[-1] == n:
            counters = Counters(*result[:4])
            whole = vars(Trajectory(scene, t, R_WB, w_WB_B, label, counters)).copy()
            whole["_times"] = whole.pop("t")  # copied when it is asked for
            seen = result
            return None
        return cut(scene, result, R_WB, w_WB_B)

    def cut(scene: Scene, result: tuple[Any, ...], R_WB: Array, w_WB_B: Array) -> Trajectory:
        """Return the trajectory of a run that ended early."""
        done, stages, corrections, evaluations, size, elsewhere, finite = result
        counters, n_good = Counters(done, stages, corrections, evaluations), grid.count_samples(done)
        if finite < n_good:
            failure: IntegrationFailed = Diverged(float(t[max(finite - 1, 0)]))
        else:
            failure = (WrongBranch if elsewhere else NotConverged)(done + 1, done * grid.dt, size, kernel.FAILURE)
        more = supplied()[:finite] if supplied else None
        return Trajectory(scene, t[:finite].copy(), R_WB[:finite], w_WB_B[:finite], label, counters, failure, None, more)

    room = empty(of_R), empty(of_w)
    template = vars(Trajectory(scene, t, *room, label)).copy()
    template["_times"] = template.pop("t")
    del template["scene"]  # of the start: made when it is asked for
    counted: tuple[Any, ...] = ()

    def again(find_scene: Callable[[], Scene]) -> Trajectory:
        """Return the trajectory from the start that `restart` has written, in arrays that each call fills."""
        nonlocal counted
        result = (in_main_thread if get_ident() == _main else in_other_threads)(*room)
        if result[0] != grid.n_steps or result[-1] != n:
            return cut(find_scene(), result, *(values.copy() for values in room))
        if (done := result[:4]) != counted:
            counted, template["counters"] = done, Counters(*done)
        trajectory = new(Trajectory)
        values = trajectory.__dict__
        values.update(template)
        values["_scene"] = find_scene
        return trajectory

    whole_run = KernelRun(run)
    whole_run.own_loop = partial(in_other_threads, *room)
    if find_restart is not None:
        whole_run.find_restart, whole_run.again = find_restart, again
    return whole_run
