"""The time grid of a run: steps of one length, and the steps whose states are stored."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial

import numpy as np

from .attitude import Array
from .check import SMALLEST, build_unchecked, describe, positive_integer, positive_number, real_number, set_fields
from .errors import BadInput
from .posix import physical_memory
from .scene import Scene

MOST_STEPS = 2**53
"""Largest number of steps of a run: times are multiples of dt, and larger integers are not exact in floats."""
SAMPLE_BYTES = 1000
"""Memory that a run takes for a sample, bytes, including intermediate results."""
MEMORY_SHARE = 0.5
"""Share of a machine's memory that the samples of a run may take."""
USUAL_MEMORY = 4 * 2**30
"""Memory, bytes, assumed where the system does not report its size."""
ROUNDING = 2.0**-50
"""Times that differ by less than this share are equal: rounding of two times and of their quotient makes up to 1.5 * 2^-52."""

_DURATION = "a finite duration above 0, s"


@dataclass(frozen=True, init=False)
class Grid:
    """Steps of length dt, s, and the stored samples: the initial state, every `every`-th step, and the last one.

    The last step is the first one at or after the requested end, so `t[-1]` can be up to one step later.

    Raises
    ------
    BadInput
        dt is not a finite number above 0, n_steps or every is not an integer of 1 to 2^53, or samples do not fit in memory.
    """

    dt: float
    n_steps: int
    every: int = 1

    def __init__(self, dt: float, n_steps: int, every: int = 1) -> None:
        step = real_number(dt)  # any size: methods integrate very large and very small scenes in other units than SI
        if step is None or not 0 < step < math.inf:
            raise BadInput("dt", describe(dt), "a finite step above 0, s")
        counts = []
        for name, value in (("n_steps", n_steps), ("every", every)):
            allowed = f"an integer of 1 to 2^53 = {MOST_STEPS}, the largest that floats count to"
            counts.append(positive_integer(name, value, allowed))
            if counts[-1] > MOST_STEPS:
                raise BadInput(name, describe(value), allowed)
        if not math.isfinite(step * counts[0]):
            raise BadInput("dt", f"{step:g}, for {counts[0]} steps", "a step whose multiples are finite, s")
        require_memory("every", *counts)
        set_fields(self, dt=step, n_steps=counts[0], every=counts[1])

    @property
    def steps(self) -> Array:
        """Number of steps (n,) after which each sample is stored, from 0."""
        steps = np.arange(0, self.n_samples * self.every, self.every, dtype=float)
        steps[-1] = self.n_steps
        return steps

    @property
    def last(self) -> float:
        """Time at which the last step starts, s."""
        return (self.n_steps - 1) * self.dt

    @cached_property
    def _times(self) -> Array:
        return self.steps * self.dt

    @property
    def t(self) -> Array:
        """Times (n,) of the samples, s, as a new array."""
        return self._times.copy()

    def count_samples(self, done: int) -> int:
        """Return the number of samples in the first `done` steps."""
        return self.n_samples if done == self.n_steps else 1 + done // self.every

    @cached_property
    def n_samples(self) -> int:
        """Number of samples."""
        return 1 + -(-self.n_steps // self.every)


def grid_for(scene: Scene, dt: object = None, t_end: object = None, sample_every: object = 1) -> Grid:
    """Return the checked grid of a run of steps dt up to t_end, both in s; the duration is by default the scene's.

    The step is by default the scene's, at most the duration, and a part of it if there are functions of time.

    Raise `BadInput` if dt or t_end is not a finite number above 0, dt is larger than t_end, sample_every is not an integer of 1
    or more, the samples would not fit in memory, or the table of a load ends before the last step.
    """
    if dt is None:
        end = read_end(scene, t_end)
        dt = min(scene.dt, end)
        dt = end / count_steps(end, dt) if scene.asks_time else dt
    else:
        end = scene.t_end if t_end is None else positive_number("t_end", t_end, _DURATION)
    if type(dt) is float and SMALLEST <= dt <= end:
        step = dt
    else:
        allowed = f"a finite step above 0 and at most t_end = {end:g}, s"
        step = positive_number("dt", dt, allowed)
        if step > end:
            raise BadInput("dt", f"{step:g}", allowed)
    n_steps = count_steps(end, step)
    if n_steps > MOST_STEPS:
        raise BadInput("dt", f"{step:g}, {n_steps:.3g} steps", f"{end / MOST_STEPS:.3g} s or more, for up to 2^53 steps")
    for load in scene.loads:
        load.require_times((n_steps - 1) * step)  # the last step may end after it
    every = min(positive_integer("sample_every", sample_every), n_steps)
    require_memory("sample_every", n_steps, every)
    return _recall_grid(dt=step, n_steps=n_steps, every=every)


def read_end(scene: Scene, t_end: object) -> float:
    """Return the duration of a run, s; the scene's if t_end is None."""
    end = scene.t_end if t_end is None else positive_number("t_end", t_end, _DURATION)
    for load in scene.loads:
        load.require_times(end)
    return end


def count_steps(t_end: float, dt: float) -> int:
    """Return the number of steps dt, s, 1 or more, of a run that ends with the first one at or after t_end, s.

    A step that ends before t_end by no more than rounding ends at it: 0.7 / 0.1 s are 7 steps.
    """
    return max(1, math.ceil(t_end / dt * (1 - ROUNDING)))


def count_whole_steps(t: float, dt: float) -> int:
    """Return the number of steps dt that have ended at a time t, both in s, to rounding."""
    return math.floor(t / dt * (1 + ROUNDING))


_recall_grid = lru_cache(maxsize=16)(partial(build_unchecked, Grid))
"""Returns a checked grid: the same one for runs of several scenes, so that its times are computed once."""


@lru_cache(maxsize=1)
def most_samples() -> int:
    """Return the number of samples that fit into `MEMORY_SHARE` of this machine's memory."""
    return int((physical_memory() or USUAL_MEMORY) * MEMORY_SHARE / SAMPLE_BYTES)


def require_memory(argument: str, n_steps: int, every: int) -> None:
    """Raise `BadInput` if a run of n_steps steps stores more than `most_samples`, one after every `every` steps."""
    most, samples = most_samples(), 1 + -(-n_steps // every)
    if samples > most:
        fits = f"up to {most:.3g} samples fit in memory, {SAMPLE_BYTES} bytes each"
        fits = f"{-(-n_steps // (most - 1))} or more, or longer steps: {fits}"
        raise BadInput(argument, f"{every}, for {samples} samples of {n_steps} steps", fits)
