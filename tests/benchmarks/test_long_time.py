"""The study of growth: exponents of known growth, lengths of runs, errors against the closed form, and the section."""

import math
from dataclasses import replace

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import Measurement, frame, samples_frame
from conservative.benchmarks.measures.timing import Preparation
from conservative.benchmarks.studies import long_time, studies
from conservative.benchmarks.studies.case import Success
from conservative.benchmarks.studies.long_time import exponent, grid_of
from conservative.benchmarks.studies.study import Study
from conservative.reports.rows.names import with_names
from conservative.reports.sections import long_time as page

from .generic_study import truth

BRICK = cv.scenes.brick_flip()


@pytest.mark.parametrize(("power", "kind"), [(0, "bounded"), (0.5, "random walk"), (1, "linear"), (2, "quadratic or faster")])
def test_the_exponent_of_a_power(power, kind):
    t = np.logspace(0, 5, 41)
    grown = exponent(t, np.minimum(1e-12 * t**power, 3.0))
    assert grown == pytest.approx(power, abs=1e-12)
    assert next(name for limit, name in long_time.KINDS.items() if grown <= limit) == kind
    late = exponent(t, np.where(t < 1e3, 1e-12, 1e-18 * t**2))  # only the last two decades count
    assert late == pytest.approx(2, abs=0.05)
    assert math.isnan(exponent(t, np.full(41, 3.0)))  # lost from the first sample on


COSTS = {"moser_veselov": 1e-7, "convected": 1e-4}
"""Wall time of a step, s, whatever the machine does: so a budget of 0.2 s is 2e6 and 2000 steps."""


@pytest.fixture(scope="module")
def findings():
    methods = (cv.MoserVeselov(2), cv.MoserVeselov(4), cv.Convected(tol=1e-6), cv.Convected())
    attempt = Study.attempt

    def attempt_at_cost(study, case):
        return replace(attempt(study, case), cost=Preparation(0.0, COSTS[case.method.family] * case.grid.n_steps))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Study, "attempt", attempt_at_cost)
        return list(studies.findings(Study("long_time", (BRICK,), methods, quick=True, time_limit=0.2, truth=truth)))


def test_each_family_runs_once_and_stops_within_its_time(findings):
    turns = {row.method: row.value for row in findings if isinstance(row, Measurement) and row.measure is Measure.TURNS}
    assert list(turns) == ["moser_veselov:order=2", "convected"]
    assert turns["convected"] == pytest.approx(100, rel=0.1)  # the shortest
    assert turns["moser_veselov:order=2"] > 1e4


def test_attitude_grows_linearly_and_energy_does_not(findings):
    rows = {(row.method, row.quantity): row for row in findings if getattr(row, "measure", None) is Measure.GROWTH}
    assert rows["convected", "attitude"].value == pytest.approx(1, abs=0.1)  # measured 1.02
    assert rows["convected", "attitude"].detail == "linear"
    assert rows["moser_veselov:order=2", "energy"].detail in ("bounded", "random walk")


def test_the_run_after_a_shortened_one_is_not_made(monkeypatch):
    lengths = []

    def attempt(study, case):
        lengths.append(case.grid.n_steps * case.grid.dt / (2 * math.pi / np.linalg.norm(BRICK.w_WB_B0)))
        return Success(
            None, cv.MoserVeselov().solve(BRICK, case.grid), Preparation(0.0, 0.02)
        )  # not proportional to its length

    monkeypatch.setattr(Study, "attempt", attempt)
    list(long_time.measure_growth(Study("long_time", (BRICK,), (cv.Reduced(),)), BRICK, cv.Reduced(), 0.1))
    assert lengths[1:] == pytest.approx([100, 316], rel=0.1)  # and the first, which may compile


def test_errors_are_the_largest_until_each_time():
    duration = 2 * math.pi / np.linalg.norm(BRICK.w_WB_B0) * 100
    grid = grid_of(BRICK, duration)
    trajectory = cv.Reduced().solve(BRICK, grid)
    study = Study("long_time", (BRICK,), (cv.Reduced(),))
    exact = study.truth(BRICK, grid).trajectory
    growth = long_time.errors(study, [trajectory])
    off = angle_between(exact.R_WB, trajectory.R_WB)
    for t, error in zip(*growth["attitude"], strict=True):
        assert error == off[trajectory.t <= t].max()
    assert growth["energy"][0][-1] == trajectory.t[-1]


def test_the_section_has_a_picture_and_the_exponents(findings):
    rows = with_names(frame([row for row in findings if isinstance(row, Measurement)]))
    lines = with_names(samples_frame([line for line in findings if not isinstance(line, Measurement)]))
    figure, table, _ = page.section(rows, lines).blocks
    assert len(figure.panels) == 3  # energy, momentum, attitude
    assert [row[1] for row in table.rows] == ["moser_veselov order=2", "convected"]
