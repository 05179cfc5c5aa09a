"""Runs that overlap give what the same runs give one after the other, bit for bit."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

import conservative as cv

THREADS = 4


def quartic(k):
    """A potential whose Python functions hand the interpreter over to other threads in the middle of every answer."""
    hook = np.array([0.0, 0.1 * k, 0.4])

    def energy(R):
        return sum(x**4 for x in (R @ hook).tolist())

    def gradient(R):
        return np.outer(4 * (R @ hook) ** 3, hook)

    return cv.FunctionPotential(energy, gradient)


def states(trajectory):
    return trajectory.R_WB.tobytes() + trajectory.w_WB_B.tobytes()


def in_threads(runs):
    """Call the runs at once, all of them prepared here, and return their states."""
    with ThreadPoolExecutor(len(runs)) as pool:
        return [states(trajectory) for trajectory in pool.map(lambda run: run(), runs)]


def test_one_potential_of_functions_serves_several_runs_at_once():
    potential, body, grid = quartic(1), cv.RigidBody((1.0, 2.0, 2.5)), cv.Grid(0.01, 12)
    scenes = [cv.Scene("own", body, np.eye(3), (0.1, k, 1.0), 1.0, potential) for k in range(THREADS)]
    for method in (cv.Reduced(), cv.Convected()):
        alone = [states(method.prepare(scene, grid)()) for scene in scenes]
        assert in_threads([method.prepare(scene, grid) for scene in scenes] * 2) == alone * 2


def test_one_scene_of_functions_runs_several_times_at_once():
    scene = cv.Scene("own", cv.RigidBody((1.0, 2.0, 2.5)), np.eye(3), (0.1, 2.0, 1.0), 1.0, quartic(2))
    run = cv.Reduced().prepare(scene, cv.Grid(0.01, 12))
    assert in_threads([run] * THREADS) == [states(run())] * THREADS
