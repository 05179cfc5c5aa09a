"""Steps of any length with control of their local error: for functions of Python, which may have corners and jumps anywhere.

Each step is taken once, and again as two of half its length; both must agree to a tolerance. A corner or a jump in attitude,
whose time depends on the motion, then costs some dozen short steps, while the error of equal steps falls with the first or
second power of their length only. Steps also end at samples and at the break points of loads. Source: C. W. Gear, Numerical
Initial Value Problems in Ordinary Differential Equations (1971), 5.4, on step doubling.

Alternatives that were considered, but neither written nor measured: the embedded formulas of orders 5 and 3 would need a third
of the calls for a step, and a kernel that returns its stages. A bisection of corners in attitude would need to know which part
of a function has them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from ..attitude import Array
from ..deferred_imports import kernels
from ..errors import Diverged, IntegrationFailed, NotConverged
from ..grid import Grid
from ..method import Method
from ..potentials.load import load_field
from ..potentials.potential import depends_on_time
from ..scene import Scene
from ..trajectory import Counters, StepControl, Trajectory
from .pieces import no_output
from .principal_axes import PrincipalStart
from .units import bound_rate

FIRST, LONGEST, LOOSE = 0.01, 1.5, 1e-2
"""First step, and the longest one at a `LOOSE` tolerance, in radians of the fastest rotation that the energy allows. At others
it is proportional to the root of what the tolerance allows, so that no two tolerances take the same steps."""
SHORTEST = 1e-14
"""Shortest step, relative to the time of its end: it is accepted whatever its error, because a function jumps within it."""
GROW, SHRINK, SHARE = 4.0, 0.1, 0.9
"""Largest and smallest factor between two steps, and share of the step that the tolerance allows."""
POWER = 1 / 9
"""Inverse of the power of the step to which its error is proportional, if functions are smooth."""
MOST_TRIES, REJECTED, MOST_LONG = 5_000, 0.1, 100_000
"""Largest number of steps that are tried if more than this share is rejected, which shows that a function is smooth nowhere:
180,000 calls of a function, some seconds. Otherwise the motion is long, and more steps are possible."""
FIRST_TRIES, BEYOND = 1_000, 10.0
"""After `FIRST_TRIES` tries, the walk also ends if the whole motion would take `BEYOND` times `MOST_TRIES` at the same rate."""
SAME = 1e-12
"""A sample that is closer to a break point, relative to the time, is at it."""
ROUGH = 3e-3
"""A corner or a jump is shown if the tolerance allows a step of less than this share of the median."""


@dataclass
class Walk:
    """The states of an adaptive run, principal axes.

    `t` are the times of samples (n,), s; `q` (n, 4) and `L` (n, 3 or 7) the states there, of which `good` are known. `ends` are
    the ends of accepted steps, s, and `h` the lengths that the tolerance allowed, which are longer if a step ends at a sample
    or a break point; `local` is the sum of their errors, rad.
    """

    t: Array
    q: Array
    L: Array
    good: int
    h: list[float]
    ends: list[float]
    local: float = 0.0
    tries: int = 0
    corrections: int = 0
    reason: str = ""

    @property
    def control(self) -> StepControl:
        """The sum of local errors, and a time of `StepControl.rough`: the end of the step for which the tolerance allowed the
        least, if that is much less than for most; the end of the last one if too many steps are rejected.
        """
        if not self.h:
            return StepControl(self.local, 0.0 if self.erratic else None)
        i = int(np.argmin(self.h))
        if self.h[i] < ROUGH * float(np.median(self.h)):
            return StepControl(self.local, self.ends[i])
        return StepControl(self.local, self.ends[-1] if self.erratic else None)

    @property
    def erratic(self) -> bool:
        """True if so many steps are rejected that the function seems to be smooth nowhere."""
        if self.tries <= FIRST_TRIES or self.tries - len(self.h) <= REJECTED * self.tries:
            return False
        now = self.ends[-1] if self.ends else 0.0
        return self.tries > MOST_TRIES or self.tries * float(self.t[-1]) > BEYOND * MOST_TRIES * now


def walk(  # noqa: PLR0915  # one loop
    scene: Scene, model: Any, find: Callable[[float], Any], tolerance: float, t: Array
) -> Walk:
    """Return the states at increasing times t (n,), s, the first 0, of steps with a tolerance; `find` returns coefficients."""
    kernel, size, rate = kernels("projected"), model.scales[1], bound_rate(scene)
    if depends_on_time(scene.potential) and not scene.loaded:  # the clock of steps belongs to loads
        model = model._replace(field=load_field(model.field, None, None, np.eye(3)))
    clocked, columns = hasattr(model.field, "clock"), 7 if hasattr(model.field, "load") else 3
    end, path = float(t[-1]), Walk(t, np.empty((len(t), 4)), np.zeros((len(t), columns)), 1, [], [])
    smooth = scene.smoothness(end)
    longest = min(LONGEST / rate * min(1.0, (tolerance / LOOSE) ** (POWER / 2)), smooth.step, end)
    edges = [-math.inf, *smooth.breaks.tolist(), math.inf]
    q, L, room = model.q, model.L, (np.empty((2, 4)), np.zeros((2, columns)), *no_output())
    path.q[0], path.L[0, :3], supplied = q, L, np.zeros(columns - 3)

    def take(now: float, h: float, n: int, window: tuple[float, float]) -> tuple[Any, Any, Any] | None:
        """Return the state after n steps of length h, s, and what loads supplied; None if they fail."""
        field = model.field._replace(clock=(now, *window)) if clocked else model.field
        with np.errstate(all="ignore"):
            done, _, corrections, *_ = kernel.enter(*model._replace(q=q, L=L, field=field), *find(h), n, n, 0, *room)
        path.corrections += corrections
        last = *room[0][-1].tolist(), *room[1][-1].tolist()
        return None if done < n or not all(map(math.isfinite, last)) else (last[:4], last[4:7], room[1][-1, 3:].copy())

    h, now = min(FIRST / rate, longest), 0.0
    for first, last in pairwise(edges):
        stops = t[(t > max(first, 0.0) * (1 + SAME)) & (t <= last * (1 + SAME))].tolist()
        stops += [last] if last < end and not (stops and stops[-1] >= last * (1 - SAME)) else []
        for stop in stops:
            stop_at = min(stop, last)
            while now < stop_at:
                left = stop_at - now
                step = left if h >= left * (1 - SAME) else min(h, left / 2)
                least = SHORTEST * max(stop_at, end / 100)
                path.tries += 1
                if path.erratic or path.tries > MOST_LONG + len(t):
                    path.reason = f"a tolerance of {tolerance:.2g} takes more than {path.tries - 1} steps, at t = {now:.6g} s"
                    return path
                coarse, fine = take(now, step, 1, (first, last)), take(now, step / 2, 2, (first, last))
                error = math.inf
                if coarse is not None and fine is not None:
                    off = math.dist(coarse[1], fine[1]) / size
                    error = 2 * math.dist(coarse[0], fine[0]) + off
                if error > tolerance and step > least:
                    h = max(least, step * max(SHRINK, SHARE * (tolerance / error) ** POWER))
                    continue
                if fine is None:
                    path.reason = kernel.FAILURE
                    return path
                q, L, supply = fine
                supplied = supplied + supply
                now = stop_at if step == left else now + step
                path.h.append(max(step, h))
                path.ends.append(now)
                path.local += error
                grown = step * min(GROW, SHARE * (tolerance / max(error, 1e-300)) ** POWER)
                # A step that ends at a sample says nothing of longer ones.
                h = min(longest, max(h if step < h else least, grown))
            if path.good < len(t) and stop >= t[path.good] * (1 - SAME):
                path.q[path.good], path.L[path.good, :3], path.L[path.good, 3:] = q, L, supplied
                path.good += 1
        if path.good == len(t):
            break
    return path


def work_of_try(method: Method) -> float:
    """Return the work of a step that is tried, ns by `MethodInfo.cost`: three steps."""
    return 3 * method.method_info.cost(method).step


def run_adaptively(
    scene: Scene, grid: Grid, label: str, start: PrincipalStart, model: Any, find: Callable[[float], Any], tolerance: float
) -> Callable[[], Trajectory]:
    """Return the run with a tolerance that has the samples of a grid."""
    return lambda: trajectory_of(scene, label, start, walk(scene, model, find, tolerance, grid.t))


def trajectory_of(scene: Scene, label: str, start: PrincipalStart, path: Walk) -> Trajectory:
    """Return the trajectory of a walk."""
    n, good = len(path.t), path.good
    R_WB, w_WB_B = np.empty((good, 3, 3)), np.empty((good, 3))
    L = np.ascontiguousarray(path.L[:good])
    finite = kernels("samples").fill(path.t[:good], 1, good, path.q[:good].copy(), L, start.axes(0.0), R_WB, w_WB_B)
    failure: IntegrationFailed | None = None
    if finite < n:
        time = float(path.t[max(finite - 1, 0)])
        failure = NotConverged(len(path.h) + 1, time, 0.0, path.reason) if path.reason else Diverged(time)
    counters = Counters(3 * path.tries, 36 * path.tries, path.corrections, 36 * path.tries)
    supplied = L[:finite, 3:].copy() if scene.loaded else None
    samples = path.t[:finite].copy(), R_WB[:finite], w_WB_B[:finite]
    return Trajectory(scene, *samples, label, counters, failure, None, supplied, control=path.control)
