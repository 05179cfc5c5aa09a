"""Runs of functions with corners and jumps by `integrate(error=)`: what is called ok is as accurate as was asked.

`pytest` tries a few scenes, `pytest --attack` all kinds, and smooth likes of them, of which few may be warned of needlessly.
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import conservative as cv
from conservative.methods import search, trials

from ..independent import angle_between
from ..sampling import sampled
from .corners import draw, truth_of
from .effort import SEED, count

ERRORS = (1e-2, 1e-4, 1e-7)
TIMES = 9
FEW = (0, 1, 2, 7)
"""Seeds of the usual test: torques of time, of attitude and of both, and a wave."""
ALL, SMOOTH = 100, 60
SHARE = 0.1
"""Largest share of runs of smooth functions with a warning although the error is reached. Measured 0 of the first 56."""


def run(case, error, t):
    """Return the trajectory, and the warnings that its error is not reached."""
    options = {"t_eval": t} if len(case.what) % 2 else {"dt": case.scene.t_end / (TIMES - 1)}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = cv.integrate(case.scene, error=error, **options)
    assert {each.category for each in caught} <= {cv.AccuracyNotReached}
    assert bool(caught) is not found.choice.reached
    return found, [each.message for each in caught]


def complain(case, errors=ERRORS):
    """Return the runs that are called ok and are less accurate than asked, and those that are warned of although accurate."""
    t = np.linspace(0, case.scene.t_end, TIMES)
    truth, uncertainty = truth_of(case, t)
    assert uncertainty < 1e-7, case.what  # measured: below 2e-9
    wrong, needless = [], []
    for error in errors:
        found, warned = run(case, error, t)
        off = float(angle_between(truth, found.R_WB).max())
        said = f"{case.what}, {error:g}: {found.choice.method.name}, off by {off:.2e}, estimate {found.choice.estimate:.2e}"
        print(said, *warned)
        wrong += [said] if off > error + uncertainty and not warned else []
        needless += [said] if off <= error and warned else []
    return wrong, needless


@pytest.mark.parametrize(
    "seed",
    [*sampled(FEW, 1, keep=(7,)), *(pytest.param(1000 * SEED + i, marks=pytest.mark.attack) for i in range(count(ALL)))],
)
def test_a_run_called_ok_is_as_accurate_as_was_asked(seed):
    wrong, _ = complain(draw(seed), ERRORS if seed >= 1000 else ERRORS[1:2])
    assert not wrong


@pytest.mark.slow
def test_an_order_that_is_presumed_is_found(monkeypatch):
    """The negative control: the differences of corners are divided as if functions were smooth, and are not adapted to."""
    monkeypatch.setattr(trials, "presumed_smooth", lambda scene: True)
    monkeypatch.setattr(search, "parts_for", lambda scene: 2)
    assert any(complain(draw(seed), (1e-3,))[0] for seed in (1, 11, 21, 31))


@pytest.mark.attack
def test_smooth_functions_are_rarely_warned_of():
    found = [complain(draw(2000 * SEED + i, smooth=True)) for i in range(count(SMOOTH))]
    assert not [each for wrong, _ in found for each in wrong]
    needless = [each for _, some in found for each in some]
    assert len(needless) <= SHARE * len(found) * len(ERRORS), needless
