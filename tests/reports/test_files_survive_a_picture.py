"""A picture, chart or section that fails is a sentence: the measurements of the command are written, and its exit code is 1."""

import csv
import json
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner

from conservative.benchmarks.measures import measurement
from conservative.reports.charts import style
from conservative.reports.cli import options
from conservative.reports.cli.main import main
from conservative.reports.run import single_study
from conservative.reports.run.measure import Measurements
from conservative.reports.sections import random_bodies, scenes

from ..sampling import sampled
from . import made_up
from .test_random_ratios import SLOWER, TWICE

RUN = ("run", "brick_flip", "-m", "reduced", "--dt", "0.01", "--t-end", "0.1")
SWEEP = ("sweep", "brick_flip", "--starts", "3", "--spread", "rate=1%", "--dt", "0.1", "-m", "reduced", "--t-end", "1")
COMMANDS = {  # words, files that are written, and those that are not
    "run": ((*RUN, "--picture", "p.svg", "--csv", "a.csv", "--out", "o"), {"a.csv", "o/run.csv", "o/run.json"}, "p.svg"),
    "sweep": ((*SWEEP, "--picture", "p.svg", "--out", "o"), {"o/t/zarr.json"}, "p.svg"),
    "recommend": (
        ("recommend", "brick_flip", "--error", "1e-3", "--t-end", "1", "--engines", "mujoco:RK4", "--picture", "p.svg"),
        set(),
        "p.svg",
    ),
    "recommend --out": (
        ("recommend", "brick_flip", "--error", "1e-3", "--t-end", "1", "--engines", "mujoco:RK4", "--out", "o"),
        {"o/recommendation.json"},
        "o/recommendation.svg",
    ),
}


def fault(*_, **__):
    raise ZeroDivisionError("planted")


def conservative(*words):
    return CliRunner().invoke(main, words)


def written(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("name", sampled(COMMANDS, 2))
def test_a_command_writes_what_it_measured(name, tmp_path, monkeypatch):
    words, kept, lost = COMMANDS[name]
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(style, "picture_file", fault)
    done = conservative(*words)
    assert done.exit_code == 1, (done.output, done.exception)
    assert f"The file '{lost}' could not be made (ZeroDivisionError: planted)" in done.stderr
    assert "brick_flip" in done.stdout  # the tables
    assert kept <= written(tmp_path)
    assert lost not in written(tmp_path)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is full")
def test_a_full_disk_loses_no_file_on_another_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = conservative(*RUN, "--csv", "/dev/full", "--picture", "p.svg", "--out", "o")
    assert done.exit_code == 2
    assert "csv: got '/dev/full'" in done.stderr
    assert written(tmp_path) == {"p.svg", "o/run.csv", "o/run.json"}


@pytest.fixture
def rows_of(monkeypatch):
    """Measure nothing: rows of random bodies, and of the convergence of a method."""

    def take(name):
        rows = (
            made_up.convergence("reduced", 2) if name == "convergence" else [row for rows in (*TWICE, *SLOWER) for row in rows]
        )
        table = measurement.frame(rows)
        monkeypatch.setattr(single_study, "measure_study", lambda *_: Measurements(table, pd.DataFrame()))
        return len(table)

    return take


PLANTED = {"picture": (style, "picture_file"), "chart": (scenes, "convergence_figure"), "ratios": (random_bodies, "figure")}


@pytest.mark.parametrize(
    ("study", "what"), [("convergence", "picture"), ("convergence", "chart"), ("random", "picture"), ("random", "ratios")]
)
def test_a_study_writes_its_rows(study, what, rows_of, tmp_path, monkeypatch):
    n = rows_of(study)
    monkeypatch.setattr(*PLANTED[what], fault)
    done = conservative("study", study, "--out", str(tmp_path / "o"), "--csv", str(tmp_path / "a.csv"))
    assert done.exit_code == 1, (done.output, done.exception)
    assert done.stderr.count("ZeroDivisionError: planted") == 1
    for file in (tmp_path / "a.csv", tmp_path / "o" / "study.csv"):
        with file.open(newline="") as stream:
            assert len(list(csv.DictReader(stream))) == n
    assert len(json.loads((tmp_path / "o" / "study.json").read_text())["rows"]) == n
    assert "planted" in (tmp_path / "o" / "study.md").read_text()


def test_a_file_that_cannot_be_made_keeps_its_content_and_the_others_are_new(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert conservative(*RUN, "--picture", "p.svg", "--csv", "a.csv").exit_code == 0
    before = (tmp_path / "p.svg").read_bytes()
    with monkeypatch.context() as patch:
        patch.setattr(options, "picture_file", fault)
        patch.setattr(style, "picture_file", fault)
        assert conservative(*RUN[:-1], "0.2", "--picture", "p.svg", "--csv", "a.csv").exit_code == 1
    assert (tmp_path / "p.svg").read_bytes() == before
    assert len((tmp_path / "a.csv").read_text().splitlines()) == 22
    assert written(tmp_path) == {"p.svg", "a.csv"}
