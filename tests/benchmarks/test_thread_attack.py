"""The attack by threads finds what is shared and what raises, and nothing in our own methods."""

import time
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from click.testing import CliRunner

import conservative as cv
from conservative.benchmarks.verification import threads

SHARED = np.empty(3)


@dataclass(frozen=True)
class Still(cv.Method):
    """The start as the end, by way of a buffer: one that all runs share, or one of each."""

    shared: bool = True
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


@dataclass(frozen=True)
class Busy(Still):
    """The same, which raises an exception where another run is under way."""

    family: ClassVar[str] = "busy"
    running: ClassVar[list[int]] = []

    def prepare(self, scene, grid):
        run = Still(shared=False).prepare(scene, grid)

        def run_alone():
            self.running.append(1)
            try:
                assert len(self.running) == 1, "two at a time"
                return run()
            finally:
                self.running.pop()

        return run_alone


def test_a_buffer_that_runs_share_is_found():
    found = threads.find(400, 1, [Still()])
    assert found.wrong["still"] > 10  # measured 200 to 300
    assert found.raised.total() == 0
    assert found.runs == {"still": 400}


def test_a_buffer_of_each_run_is_not():
    assert threads.find(400, 1, [Still(shared=False)]).bad == 0


def test_what_runs_raise_is_found_and_told():
    found = threads.find(400, 1, [Busy()])
    assert found.raised["busy"] > 10
    assert "two at a time" in str(found)
    assert str(found).endswith(f"400 runs in 8 threads: 0 wrong, {found.raised.total()} raised")


def test_our_compiled_methods_and_potentials_of_functions_share_nothing():
    ours = (cv.Reduced(), cv.Gauss(2), cv.Lame(), cv.MoserVeselov(), cv.Projected(), cv.Taylor())
    found = threads.find(600, 1, ours)
    assert found.bad == 0
    assert found.runs.total() == 600
    assert set(found.runs) == {method.name for method in ours}


@pytest.mark.parametrize(("shared", "code"), [(True, 1), (False, 0)])
def test_the_exit_code_says_whether_anything_was_wrong(shared, code, monkeypatch):
    monkeypatch.setattr(threads, "list_methods", lambda: (Still(shared),))
    done = CliRunner().invoke(threads.main, ["--count", "200", "--seed", "3"])
    assert done.exit_code == code
    assert done.output.splitlines()[-1].startswith("200 runs in 8 threads: ")


def test_the_same_seed_draws_the_same_runs():
    def drawn(seed):
        rng = np.random.default_rng(seed)
        runs = threads.draw_runs(threads.list_runs([cv.Reduced(), cv.Lame()], threads.list_scenes(rng)), 50, rng)
        return [(run.method.name, run.scene.name, tuple(run.scene.w_WB_B0), run.n_steps) for run in runs]

    assert drawn(1) == drawn(1)
    assert drawn(1) != drawn(2)
