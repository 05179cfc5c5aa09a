"""Random scenes over all that a scene can have, `integrate(error=)` against an independent truth.

A run that is called ok is as accurate as was asked, and every run ends. `pytest` tries three scenes, `pytest --all` ten,
`pytest --attack` 400, and ATTACK_EFFORT times as many.
"""

from __future__ import annotations

import signal
import time
import warnings
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv

from ..environments import PATIENCE
from ..independent import Case, angle_between, dop853, extrapolate, motion
from ..sampling import sampled
from .effort import SEED, count
from .random_scenes import THEMES, random_case

ERRORS = (1e-6, 1e-9, 1e-12)
LONGEST = PATIENCE  # s of processor time
SAMPLES = 8
USUAL, ALL = 8, 400
FOUND = (350, 394)
"""Scenes whose runs were ok and up to ten times less accurate than asked, because their steps are divided at corners."""


class TooLong(KeyboardInterrupt):
    """Not an Exception: nothing on the way takes it for a fault of a function of the scene."""


@contextmanager
def limited(seconds):
    """Raise `TooLong` after so many seconds of processor time, in compiled loops too, where the system can."""

    def stop(number, frame):
        raise TooLong

    start = time.process_time()
    if hasattr(signal, "setitimer"):
        previous = signal.signal(signal.SIGPROF, stop)
        signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_PROF, 0)
            signal.signal(signal.SIGPROF, previous)
    if time.process_time() - start > seconds:
        raise TooLong


@dataclass(frozen=True)
class Truth:
    """Attitudes at times, s, and their uncertainty, rad."""

    t: Any
    R_WB: Any
    uncertainty: float


def truth_of(case: Case) -> Truth:
    """Return the truth at eight times; its uncertainty has the rounding of the initial attitude, which is no exact rotation."""
    t = np.linspace(0, case.t_end, SAMPLES)
    x = case.R0[:, 0] / np.linalg.norm(case.R0[:, 0])
    z = np.cross(x, case.R0[:, 1])
    z /= np.linalg.norm(z)
    other = replace(case, R0=np.stack([x, np.cross(z, x), z], axis=1))
    R_WB = motion(case, t, extrapolate)[0]
    second = motion(other, t, lambda *each: extrapolate(*each, tolerance=1e-15))[0]
    return Truth(t, R_WB, float(angle_between(R_WB, second).max()) + 4e-16)


def run(case, error, times):
    """Return the run that `integrate` chooses, and whether it says that the error was not reached."""
    scene = case.scene()
    options = {"t_eval": times} if int(1e6 * case.t_end) % 2 else {"dt": case.t_end / (SAMPLES - 1)}
    with warnings.catch_warnings(record=True) as caught, limited(LONGEST):
        warnings.simplefilter("always")
        found = cv.integrate(scene, error=error, **options)
    assert {each.category for each in caught} <= {cv.AccuracyNotReached}, [str(each.message) for each in caught]
    return found, bool(caught)


def complaint(case, truth, error):
    """Return the fault of a run (called ok and less accurate than asked, or without an end), or ""."""
    try:
        found, warned = run(case, error, truth.t)
    except TooLong:
        return f"{error:.0e}: no end in {LONGEST:g} s"
    except cv.IntegrationFailed as failure:
        return f"{error:.0e}: {failure}"
    assert len(found) == len(truth.t)
    off, choice = float(angle_between(found.R_WB, truth.R_WB).max()), found.choice
    said = f"{choice.method.name}, {choice.dt:.3g} s: off by {off:.2e} rad, estimate {choice.estimate:.2e}"
    print(f"{error:.0e}: {said}" + ", warned" * warned)
    return "" if warned or off <= error + truth.uncertainty else f"{error:.0e}: {said}, uncertainty {truth.uncertainty:.1e}"


def check(case):
    truth = truth_of(case)
    complaints = [each for each in (complaint(case, truth, error) for error in ERRORS) if each]
    assert not complaints, "; ".join(complaints)


OTHERS = [pytest.param(seed, marks=pytest.mark.attack) for seed in range(USUAL, count(ALL)) if seed not in FOUND]


@pytest.mark.parametrize("seed", [*sampled([*range(USUAL), *FOUND], 2, keep=(4, 6)), *OTHERS])
def test_a_run_called_ok_is_as_accurate_as_was_asked(seed):
    case, what = random_case(seed + (SEED - 1) * 1_000_000)
    print(what)
    check(case)


def test_a_wrong_run_is_found():
    case, _ = random_case(6)
    assert not complaint(case, truth_of(case), 1e-6)
    other = replace(case, w0=case.w0 * (1 + 1e-5))
    assert "off by" in complaint(case, truth_of(other), 1e-6)


def needle(ratio):
    """A body whose smallest moment is known to some per mille of itself only where its axes are rounded."""
    R = Rotation.from_rotvec(0.7 * np.array((1, 2, 3)) / np.sqrt(14)).as_matrix()
    J = R @ np.diag((1.0, 1.1, 1 / ratio)) @ R.T
    return Case((J + J.T) / 2, np.eye(3), R @ np.array((0.3, 0.2, 5.0)), 2.0, ("gravity", 1.0, np.array((0.1, 0.2, 0.3))))


@pytest.mark.attack
@pytest.mark.parametrize(("ratio", "error"), [(1e4, 1e-9), (1e5, 1e-8), (1e5, 1e-9)])
def test_needles(ratio, error):
    case = needle(ratio)
    found = complaint(case, truth_of(case), error)
    assert not found, found


@pytest.mark.attack
def test_a_chaotic_motion_ends():
    J = np.array([[0.8561473151436181, -0.1399209844619009, 0.2596232291707036]])
    J = np.vstack([J, [[-0.1399209844619009, 0.8639032569163886, 0.2525273535979581]]])
    J = np.vstack([J, [[0.2596232291707036, 0.2525273535979581, 0.531435779649731]]])
    R0 = [[-0.36137691973756003, -0.46339656708943133, 0.8091170147084557]]
    R0 += [[0.748683825368686, -0.661436587819048, -0.04443203851147]]
    R0 += [[0.5555690631119225, 0.5897162554178279, 0.5859654312190021]]
    b, A = (
        [0.13666859642970388, -0.0930140741058145, -0.6886305645960864],
        [-0.5202606179382248, -0.5662843993318173, 0.152834159],
    )
    w0 = np.array((0.34078729040002304, -1.5690401418883404, -1.021436630924228))
    R0 = Rotation.from_matrix(R0).as_matrix()
    case = Case(J, R0, w0, 208.07820450168416, ("attraction", 0.5198954949249285, np.array(b), np.array(A)))
    _, warned = run(case, 1e-8, np.linspace(0, case.t_end, SAMPLES))
    assert warned  # rounding the scene moves its end by more


@pytest.mark.parametrize("seed", sampled(range(len(THEMES)), 2, keep=(0,), leave=(3, 7, 11, 13, 18)))
def test_the_truth_is_that_of_another_solver(seed):
    case, _ = random_case(seed)
    t = np.linspace(0, case.t_end, SAMPLES)
    assert angle_between(motion(case, t, extrapolate)[0], motion(case, t, dop853)[0]).max() < 1e-10  # measured 1.6e-11
