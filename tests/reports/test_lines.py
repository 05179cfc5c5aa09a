"""Samples of the studies as lines of pictures."""

import numpy as np

from conservative.benchmarks.measures import samples
from conservative.benchmarks.measures.samples import Samples
from conservative.method import Role
from conservative.reports.labels import with_names
from conservative.reports.tables import lines

T = np.linspace(0.5, 60, 120)


def drifts(*settings):
    """The drifts of one engine with some settings: what it shares with others, and a tolerance."""
    common = {
        "study": "long_runs",
        "scene": "made_up",
        "family": "engine",
        "role": Role.ENGINE,
        "dt": 0.1,
        "quantity": "energy",
    }
    found = [
        Samples(
            method=f"{kept}{tol}",
            label="",
            series=kept,
            setting=f"{kept},tol={tol}",
            series_setting=kept,
            t=T,
            value=T,
            **common,
        )
        for kept, tol in settings
    ]
    return lines.drifts(with_names(samples.frame(found)))


def test_of_several_tolerances_the_loosest_and_the_tightest_are_drawn():
    found = drifts(("stol=3", 1e-3), ("stol=3", 1e-6), ("stol=3", 1e-9), ("stol=4", 1e-3))
    names = ["engine stol=3,tol=0.001", "engine stol=3,tol=1e-9", "engine stol=4,tol=0.001"]
    assert found["name"].unique().tolist() == names


def test_fewer_samples_keep_the_last_of_each_line():
    found = lines.thin(drifts(("a", 1e-3), ("b", 1e-3)))
    assert found.groupby("name")["t"].max().tolist() == [60, 60]
    assert found.groupby("name").size().tolist() == [lines.THIN] * 2
