"""Signals and other threads during a compiled run; results do not depend on its blocks of steps."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.deferred_imports import kernels
from conservative.grid import Grid
from conservative.method import Run
from conservative.methods.principal_axes import principal_start
from conservative.methods.run_kernel import prepare_run

from ..environments import PATIENCE, run_python
from ..sampling import sampled

INTERRUPT = """
import os, signal, sys, threading
import conservative as cv
from conservative import registry

for text in sys.argv[1:]:
    scene, method = (find(name) for find, name in zip((registry.scene, registry.method), text.split()))
    cv.integrate(scene, 1e-9, method, 2e-8)
    try:
        threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
        dt = 1.0 if "tolerance" in text else 1e-9  # steps of a tolerance do not depend on dt
        cv.integrate(scene, dt, method, 1e9 * dt, sample_every=10**9)
    except KeyboardInterrupt:
        print(text)
"""
LONG_RUNS = (
    ("brick_flip", "reduced"),
    ("lagrange_top", "reduced:order=8"),
    ("sprung_body", "reduced"),
    ("lagrange_top", "gauss:stages=6"),
    ("lagrange_top", "lame"),
    ("brick_flip", "moser_veselov"),
    ("sprung_body", "projected"),
    ("sprung_body", "taylor"),
    ("sprung_body", "splitting"),
    ("sprung_body", "taylor:tolerance=1e-9"),
    ("lagrange_top", "substepped"),
    ("brick_flip", "convected"),
)


@pytest.mark.parametrize("every", [6, pytest.param(1, marks=pytest.mark.slow)])
def test_an_interrupt_ends_runs_of_a_billion_steps(every: int) -> None:
    """The signals come from another thread, which therefore runs while the kernel does."""
    chosen = LONG_RUNS[::every]
    for scene, method in chosen:  # compiled here, it counts for no hang
        cv.integrate(registry.scene(scene), 1e-9, registry.method(method), 2e-8)
    runs = [f"{scene} {method}" for scene, method in chosen]
    command = [sys.executable, "-P", "-c", INTERRUPT, *runs]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, timeout=PATIENCE)
    assert done.stdout.splitlines() == runs


THREADS = 4


def quartic(k):
    """Return a potential whose Python functions let other threads run in the middle of every evaluation."""
    hook = np.array([0.0, 0.1 * k, 0.4])

    def energy(R):
        return sum(x**4 for x in (R @ hook).tolist())

    def gradient(R):
        return np.outer(4 * (R @ hook) ** 3, hook)

    return cv.FunctionPotential(energy, gradient)


class Stop(BaseException):
    """An exception raised by a handler."""


@contextmanager
def signals(handler: Callable[[], object], wait: float = 0.05, times: int = 1) -> Iterator[None]:
    """Send signals from another thread, each after the last one was handled; none comes after the block.

    `wait`, s, lets the block get to its work. If it does not, the signal comes a little early. No signal comes before the
    clean-up is prepared.
    """
    begun, handled, over = threading.Event(), threading.Event(), threading.Event()

    def handle(number: int, frame: object) -> None:
        handled.set()
        if not over.is_set():
            handler()

    def send() -> None:
        begun.wait()
        over.wait(wait)
        for _ in range(times):
            if over.is_set():
                return
            handled.clear()
            os.kill(os.getpid(), signal.SIGUSR1)
            handled.wait()

    before, sender = signal.signal(signal.SIGUSR1, handle), threading.Thread(target=send)
    sender.start()
    try:
        begun.set()
        yield
    finally:
        over.set()
        sender.join()
        signal.signal(signal.SIGUSR1, before)


def stop() -> None:
    raise Stop("reason")


def long_run(n_steps: int = 10**9) -> cv.Trajectory:
    return cv.Reduced().prepare(cv.scenes.brick_flip(), Grid(1e-6, n_steps, n_steps))()


def test_exceptions_of_a_handler_are_not_changed() -> None:
    with pytest.raises(Stop, match="reason"), signals(stop):
        long_run()


def test_a_handler_that_raises_nothing_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels("reduced"), "PAUSE", 1000)
    reference = states(long_run(10**5))
    calls: list[int] = []
    with signals(lambda: calls.append(1), 0.0, times=5):
        while len(calls) < 5:
            assert states(long_run(10**5)) == reference


def repeat(run: Run) -> None:
    """Make runs without end."""
    while True:
        run()


def test_samples_without_end_are_interrupted_too() -> None:
    """With one step per sample, most of the time is spent on the conversion of samples to body axes."""
    run = cv.MoserVeselov().prepare(cv.scenes.brick_flip(), Grid(1e-6, 3 * 10**5))
    reference = states(run())
    with pytest.raises(Stop), signals(stop):
        repeat(run)
    assert states(run()) == reference


def test_an_interrupt_within_functions_of_a_potential_is_not_theirs() -> None:
    """Signals come before, during and after the Python functions; an unfinished evaluation does not affect later runs."""
    scene = cv.Scene("own", cv.RigidBody((1.0, 2.0, 2.5)), np.eye(3), (0.1, 2.0, 1.0), 1.0, quartic(1))
    short, long = (cv.Reduced().prepare(scene, Grid(1e-6, n, n)) for n in (5, 10**9))
    reference = states(short())
    for k in range(0, 20, 4):
        with pytest.raises(Stop), signals(stop, 0.01 + 1e-4 * k):
            long()
        assert states(short()) == reference


LIMITED = """
import threading
import conservative as cv
from conservative.grid import Grid

def run(n_steps, begun=lambda: None):
    made = cv.Reduced().prepare(cv.scenes.brick_flip(), Grid(1e-6, n_steps, n_steps))
    begun()
    made()

run(10)
begun = threading.Event()
thread = threading.Thread(target=run, args=(10**10, begun.set), daemon=True)  # it takes a quarter of an hour
thread.start()
begun.wait()
thread.join(0.1)
print(thread.is_alive())
"""


def test_another_thread_can_enforce_a_time_limit() -> None:
    """The run continues in a daemon thread, which ends with its process."""
    assert run_python(LIMITED) == (0, "True\n", "")


def states(trajectory: cv.Trajectory) -> tuple[bytes, bytes, object, str]:
    return trajectory.R_WB.tobytes(), trajectory.w_WB_B.tobytes(), trajectory.counters, str(trajectory.outcome)


BLOCKS = (
    *((scene, method, 1) for scene, method in LONG_RUNS if registry.method(method).method_info.kernel),
    ("lagrange_top", "reduced", 30),
    ("lagrange_top", "reduced", 55),
    ("asymmetric_top", "reduced:order=4", 12),
    ("lagrange_top", "gauss:stages=2", 40),
    ("lagrange_top", "lame", 60),
    ("brick_flip", "gauss:stages=3", 60),
)


FEW = (
    *(("sprung_body", method, 1) for method in ("projected", "taylor", "splitting")),
    *(("brick_flip", "moser_veselov", 1), ("lagrange_top", "reduced", 55), ("lagrange_top", "gauss:stages=2", 40)),
)
"""One of each kernel, but for those that take long to compile."""


@pytest.mark.parametrize(("scene", "method", "factor"), sampled(BLOCKS, len(FEW), FEW))
def test_results_do_not_depend_on_blocks(scene: str, method: str, factor: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Short steps, long steps that the solver reaches in parts, and steps that fail."""
    chosen, motion = registry.method(method), registry.scene(scene)
    dt = min(factor * motion.dt, 0.9 * chosen.longest_step(motion))
    run, kernel = chosen.prepare(motion, Grid(dt, 400, 3)), kernels(chosen.method_info.kernel)
    monkeypatch.setattr(kernel, "PAUSE", 0)
    whole = states(run())
    for pause in (1, 2, 7, 100):
        monkeypatch.setattr(kernel, "PAUSE", pause)
        assert states(run()) == whole


@pytest.mark.parametrize(
    "name", sorted({family.method_info.kernel for family in registry.list_families().values() if family.method_info.kernel})
)
def test_handlers_are_asked_for_every_so_often_in_the_main_thread_alone(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    class Kernel:
        PAUSE, FAILURE, pauses = kernels(name).PAUSE, "", []

        def enter(self, n_steps: int, every: int, pause: int, *arrays: np.ndarray) -> tuple[object, ...]:
            self.pauses.append(pause)
            return n_steps, n_steps, 0, None, 0.0, False, len(arrays[-1])

    scene, kernel = cv.scenes.brick_flip(), Kernel()
    run = prepare_run(scene, Grid(0.1, 3), "label", principal_start(scene), kernel, (), ())
    run()
    with ThreadPoolExecutor(1) as pool:
        pool.submit(run).result()
    assert kernel.pauses == [kernel.PAUSE, 0]
    assert kernel.PAUSE > 1000


def in_threads(runs):
    """Make prepared runs in concurrent threads and return their states."""
    with ThreadPoolExecutor(len(runs)) as pool:
        return [states(trajectory) for trajectory in pool.map(lambda run: run(), runs)]


def test_one_potential_of_functions_serves_several_runs_at_once():
    potential, body, grid = quartic(1), cv.RigidBody((1.0, 2.0, 2.5)), cv.Grid(0.01, 12)
    scenes = [cv.Scene("own", body, np.eye(3), (0.1, k, 1.0), 1.0, potential) for k in range(THREADS)]
    alone = [states(cv.Reduced().prepare(scene, grid)()) for scene in scenes]
    assert in_threads([cv.Reduced().prepare(scene, grid) for scene in scenes] * 2) == alone * 2


def test_one_scene_of_functions_runs_several_times_at_once():
    scene = cv.Scene("own", cv.RigidBody((1.0, 2.0, 2.5)), np.eye(3), (0.1, 2.0, 1.0), 1.0, quartic(2))
    run = cv.Reduced().prepare(scene, cv.Grid(0.01, 12))
    assert in_threads([run] * THREADS) == [states(run())] * THREADS
