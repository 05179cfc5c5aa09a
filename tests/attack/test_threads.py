"""Runs in concurrent threads return the same results as consecutive runs, bit for bit.

All variants of all registered methods run on registered scenes, random bodies, and two scenes that share a potential of Python
functions. Half of the runs share their scene with other threads, half have a copy.
"""

import hashlib
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Barrier
from typing import ClassVar

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.attitude import rotation_about

from .effort import SEED, count

pytestmark = pytest.mark.attack
THREADS = 8
SCENES = ("brick_flip", "symmetric_body", "lagrange_top", "sleeping_top", "asymmetric_top", "hanging_rest", "sprung_body")
STEPS = {True: (5, 40, 300), False: (2, 12)}  # of methods with a kernel, which runs without the interpreter's lock, and others
SHARES = {cv.Role.OURS: 0.7, cv.Role.ENGINE: 0.29, cv.Role.TRUTH: 0.01}  # of the runs, because some are slow
SHARE_OF_FUNCTIONS = 0.005  # of a method's runs, in a potential of Python functions
SWITCH_INTERVAL = 1e-5  # s after which a thread hands the interpreter over: 500 times as often as usual


@dataclass(frozen=True, eq=False)
class Run:
    method: cv.Method
    scene: cv.Scene
    dt: float
    n_steps: int

    def digest(self, scene):
        """Return a digest of the whole result on a scene, the run's own or a copy."""
        found = cv.integrate(scene, self.dt, self.method, self.dt * self.n_steps, 2, on_failure="return")
        rest = f"{found.label} {found.counters} {found.outcome}"
        return hashlib.sha256(found.t.tobytes() + found.R_WB.tobytes() + found.w_WB_B.tobytes() + rest.encode()).hexdigest()


def random_scene(name, rng, potential=None):
    second = rng.uniform(0.2, 1.0, 3)
    start = rotation_about(rng.normal(size=3), rng.uniform(0, np.pi))
    return cv.Scene(name, cv.RigidBody(second.sum() - second), start, rng.normal(size=3), 2.0, potential)


def list_methods():
    for family in registry.list_families().values():
        try:
            yield from family.settings_for("variants")
        except cv.MissingEngine:
            continue


def list_runs(method, scenes):
    for scene in scenes:
        if method.unsupported(scene) is None:
            dt = min(scene.dt, 0.9 * method.longest_step(scene))
            for n_steps in STEPS[bool(method.method_info.kernel) and not isinstance(scene.potential, cv.FunctionPotential)]:
                yield Run(method, scene, dt, n_steps)


def draw_runs(methods, number, rng):
    """Return runs in random order; within a role every method is as likely as any other."""
    hook = np.array([0.0, 0.1, 0.4])
    shared = cv.FunctionPotential(
        lambda R: float(sum(x**4 for x in (R @ hook).tolist())), lambda R: np.outer(4 * (R @ hook) ** 3, hook)
    )
    scenes = [registry.scene(name) for name in SCENES]
    scenes += [random_scene(f"random {k}", rng) for k in range(4)]
    scenes += [random_scene(f"functions {k}", rng, shared) for k in range(2)]
    known = {method: runs for method in methods if (runs := list(list_runs(method, scenes)))}
    of_role = Counter(method.role for method in known)
    weights = np.array([SHARES[method.role] / of_role[method.role] for method in known])
    found = []
    for runs, n in zip(known.values(), rng.multinomial(number, weights / weights.sum()), strict=True):
        functions = [isinstance(run.scene.potential, cv.FunctionPotential) for run in runs]
        chances = np.where(functions, SHARE_OF_FUNCTIONS, 1.0)
        found += [runs[k] for k in rng.choice(len(runs), n, p=chances / chances.sum())]
    return [found[k] for k in rng.permutation(len(found))]


def attack(methods, number):
    """Return a line for each run whose result in threads differs from the run alone, or that raises an exception."""
    runs = draw_runs(methods, number, np.random.default_rng(SEED))
    alone = {run: run.digest(run.scene) for run in dict.fromkeys(runs)}
    start = Barrier(THREADS)

    def compare(part):
        start.wait()
        wrong = []
        for k in range(part, len(runs), THREADS):
            run = runs[k]
            try:
                found = run.digest(run.scene if k // THREADS % 2 == 0 else run.scene.rename(run.scene.name))
            except Exception as error:
                found = repr(error)
            if found != alone[run]:
                wrong.append(f"{run.method.name} on {run.scene.name}: {found}")
        return wrong

    before = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_INTERVAL)
    try:
        with ThreadPoolExecutor(THREADS) as pool:
            return [line for part in pool.map(compare, range(THREADS)) for line in part]
    finally:
        sys.setswitchinterval(before)


def test_runs_in_threads_are_the_same():
    assert attack(list(list_methods()), count(5000)) == []


SHARED = np.empty(3)


@dataclass(frozen=True)
class Still(cv.Method):
    """Return the initial state through a buffer that all runs share, or that each run has for itself."""

    shared: bool
    family: ClassVar[str] = "still"
    role: ClassVar[cv.Role] = cv.Role.OURS

    @property
    def order(self):
        return None

    def prepare(self, scene, grid):
        def run():
            buffer = SHARED if self.shared else np.empty(3)
            buffer[:] = scene.w_WB_B0
            time.sleep(1e-4)
            states = np.stack([scene.R_WB0] * grid.n_samples), np.stack([buffer] * grid.n_samples)
            return cv.Trajectory(scene, grid.t, *states, self.label)

        return run


def test_a_buffer_that_runs_share_is_found():
    assert attack([Still(shared=False)], 400) == []
    assert len(attack([Still(shared=True)], 400)) > 10  # measured 200 to 300
