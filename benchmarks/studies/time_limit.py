"""A time limit for single runs, so that no engine blocks a study."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import islice
from weakref import WeakKeyDictionary

from conservative.grid import Grid
from conservative.method import Method, Role
from conservative.outcome import Outcome, OutcomeKind
from conservative.pickling import NotTransferable
from conservative.references.environments.engine_method import EngineMethod
from conservative.references.worker.calls import run_within
from conservative.references.worker.client import EngineCrashed, EngineTimeout, time_limit
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures.timing import Preparation
from .case import Case, Success, attempt
from .selection import Missing

_timeouts: WeakKeyDictionary[Scene, dict[Method, tuple[float, Grid]]] = WeakKeyDictionary()
"""Limit, s, and grid of the last run that was stopped, by scene and method, so that it is not tried again."""

_trials: WeakKeyDictionary[Scene, dict[Method, Trial]] = WeakKeyDictionary()
"""The short run of a method by which the cost of others is known, by scene and method."""
TRIAL = 8
"""Number of steps of a short run, or 1 if one step exceeds the time budget of a run."""


@dataclass(frozen=True)
class Trial:
    """A short run: its grid, and its wall time, s, without compilation; the time is NaN if it failed."""

    grid: Grid
    spent: float

    def expect(self, case: Case) -> float:
        """Return the wall time, s, of a run of the same method on the scene: by steps, or by duration if it chooses its own."""
        per_step = self.spent / self.grid.n_steps
        return per_step * case.grid.n_steps * (1.0 if case.method.order is not None else case.grid.dt / self.grid.dt)


def is_quick(case: Case) -> bool:
    """Return whether a case is known to be quick: it takes a fixed number of steps that call no Python functions.

    Steps that call functions of a scene, and methods of other people, take as long as the functions need.
    """
    return isinstance(case.method, Missing) or (is_known_to_end(case.method) and not case.scene.calls_python)


def find_trial(budget: float, limit: float, case: Case, skip_missing: bool = False) -> Trial:
    """Return a short run at the scene's step for a case that is not quick, made once for each scene and method.

    `budget` and `limit` are the time budget and the time limit of a run, s. A first run may compile, so a long one is repeated.
    """
    known = _trials.setdefault(case.scene, {})
    if case.method not in known:
        for n in (1, TRIAL):
            grid = Grid(case.scene.dt, n)  # all samples, at which some solvers start again
            runs = (attempt_within(limit, replace(case, grid=grid), skip_missing) for _ in range(2))
            costs = [done.cost.first_call if isinstance(done, Success) else math.nan for done in islice(runs, 1)]
            if costs[0] > budget / 4:
                costs += [done.cost.first_call for done in runs if isinstance(done, Success)]
            known[case.method] = Trial(grid, min(costs))
            if not known[case.method].spent <= budget:
                break
    return known[case.method]


def attempt_within(limit: float, case: Case, skip_missing: bool = False, apart: bool = False) -> Success | Outcome:
    """Return the result of a case that has `limit` s of wall time; see `attempt`.

    A method of other people may never end, or may end its process. It runs in a worker process, which is ended after the limit,
    and so does any method that is not bounded if `apart`. The trajectory is the same bit for bit. The `run` of a success is
    prepared in this process when it is first called. A method that cannot be pickled, for example because it holds an open
    file, runs in this process, without a limit.

    Raises
    ------
    MissingEngine
        The engine is not installed, and `skip_missing` is False.
    """
    elsewhere = isinstance(case.method, EngineMethod)  # it runs in another process already
    if is_bounded(case.method) or (is_known_to_end(case.method) and not apart and not elsewhere):
        return attempt(case, skip_missing)
    before, grid = _timeouts.get(case.scene, {}).get(case.method, (0.0, case.grid))
    longer = case.grid.n_steps >= grid.n_steps and case.grid.dt * case.grid.n_steps >= grid.dt * grid.n_steps * (1 - 1e-9)
    if limit <= before and longer:  # at least as long, in steps and in time, as one that was stopped at this limit
        return Outcome(OutcomeKind.TIMEOUT, f"a run of {grid.n_steps} steps was ended after {before:g} s")
    done: tuple[Trajectory, Preparation] | Success | Outcome
    try:
        if elsewhere:
            with time_limit(limit):
                done = attempt(case, skip_missing)
        else:
            done = run_within(limit, partial(_attempt, case), (case.scene,))
    except (EngineTimeout, EngineCrashed) as failure:
        done = failure.outcome
    except NotTransferable:
        return attempt(case, skip_missing)
    if isinstance(done, Outcome) and done.kind is OutcomeKind.TIMEOUT:
        _timeouts.setdefault(case.scene, {})[case.method] = limit, case.grid
    if isinstance(done, Success):
        return done
    if isinstance(done, Outcome):
        return attempt(case, skip_missing) if done.kind is OutcomeKind.MISSING else done
    prepare = cache(lambda: case.method.prepare(case.scene, case.grid))
    return Success(lambda: prepare()(), *done)


def attempt_here(limit: float, case: Case, skip_missing: bool = False) -> Success | Outcome:
    """Return the result of a case whose run is to be timed in this process.

    A method that is not known to end is tried in another process first; see `attempt_within`.
    """
    tried = attempt_within(limit, case, skip_missing)
    here = is_known_to_end(case.method) or isinstance(case.method, EngineMethod)  # whose process times its runs
    return tried if here or isinstance(tried, Outcome) else attempt(case, skip_missing)


def is_known_to_end(method: Method) -> bool:
    """Return whether the run of a method ends: of ours, and of our adapters of engines with a fixed number of steps."""
    return is_bounded(method) or (_is_ours(method) and method.order is not None)


def is_bounded(method: Method) -> bool:
    """Return whether a run ends for certain: our kernels take a fixed number of steps, and reference solutions have limits."""
    return bool(method.method_info.kernel) or isinstance(method, Missing) or (method.role == Role.TRUTH and _is_ours(method))


def _is_ours(method: Method) -> bool:
    return type(method).__module__.startswith("conservative.")


def _attempt(case: Case) -> tuple[Trajectory, Preparation] | Outcome:
    """Return the trajectory of a case and its cost; the run stays in the worker."""
    done = attempt(case, skip_missing=True)
    return (done.trajectory, done.cost) if isinstance(done, Success) else done
