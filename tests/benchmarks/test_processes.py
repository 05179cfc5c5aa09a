"""Times from several processes: each has a time of every run, and none outlives the block."""

import math
import os
from functools import partial
from threading import Lock

import pytest

from conservative.benchmarks.measures.processes import Processes
from conservative.benchmarks.measures.timing import Timing
from conservative.outcome import OutcomeKind

from ..environments import PATIENCE

HOW = {"limit": PATIENCE, "rounds": 3, "min_time": 1e-4, "budget": 0.1}


class Fixed:
    """A run with a given wall time of a call, s; away from the process `home`, the wall time is the number of the process."""

    def __init__(self, seconds, home=0):
        self.seconds = seconds if home in (0, os.getpid()) else float(os.getpid())

    def wall_time(self, calls):
        return self.seconds * calls


class Crashing:
    """A run that ends every process but its own."""

    def __init__(self, home):
        if os.getpid() != home:
            os._exit(7)

    def __call__(self):
        return None


def minimums(timings):
    return [timing.minimum for timing in timings]


def test_every_process_times_every_run():
    with Processes(3) as processes:
        pids = [other.pid for other in processes._others]
        assert pids == [None, None]  # started with the first timing
        prepares = {name: partial(Fixed, seconds, os.getpid()) for name, seconds in (("a", 0.5), ("b", 0.25))}
        for _ in range(2):  # the same processes live over all scenes
            found = processes.time({name: prepare() for name, prepare in prepares.items()}, prepares, **HOW)
            pids = [other.pid for other in processes._others]
            assert minimums(found["a"]) == [0.5, *pids]
            assert minimums(found["b"]) == [0.25, *pids]
            assert [other.starts for other in processes._others] == [1, 1]
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


def time_and_interrupt(pids):
    with Processes(2) as processes:
        processes.time({0: Fixed(0.5)}, {0: partial(Fixed, 0.5)}, **HOW)
        pids += [other.pid for other in processes._others]
        raise KeyboardInterrupt


def test_no_process_outlives_an_interrupt():
    pids = []
    with pytest.raises(KeyboardInterrupt):
        time_and_interrupt(pids)
    with pytest.raises(ProcessLookupError):
        os.kill(*pids, 0)


def test_a_process_that_crashes_has_no_times():
    with Processes(2) as processes:
        found = processes.time({0: Fixed(0.5)}, {0: partial(Crashing, os.getpid())}, **HOW)[0]
    assert found[0].minimum == 0.5
    assert math.isnan(found[1].minimum)
    assert found[1].outcome.kind is OutcomeKind.CRASHED


def test_a_run_that_cannot_be_sent_is_timed_here_only():
    with Processes(2) as processes:
        (timing,) = processes.time({0: Fixed(0.5)}, {0: partial(print, Lock())}, **HOW)[0]
    assert isinstance(timing, Timing)
