"""`conservative published`: what it prints, and how it exits."""

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import conservative as cv
from conservative.benchmarks.published import figure
from conservative.reports.cli.main import main

SOURCE = figure.Source("here", "somebody", "https://example.org", "page 1")
OTHER = figure.Source("there", "somebody else", "https://example.org", "page 2", original=False)
SPIN = cv.Scene("spin", cv.RigidBody((2, 2, 1)), np.eye(3), (0, 0, 1), 1.0)
RIGHT = figure.Figure("energy", SOURCE, "energy at the end", "any", ("0.50",), SPIN, dt=0.1, quantity="energy")
BOUND = replace(RIGHT, name="drift", quantity="energy_drift", printed=("1e-10",), relation=figure.Relation.BELOW)
WRONG = replace(RIGHT, name="wrong", printed=("0.60",))
EXPLAINED = replace(WRONG, name="explained", explanation="a misprint", instead="it is not at hand")
NEEDLESS = replace(RIGHT, name="needless", explanation="a misprint")
CANNOT = figure.Figure("whale", OTHER, "length", "in water", ("30",), cannot="it is of a whale")


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))

    def call(*figures, options=()):
        monkeypatch.setattr(figure, "read", lambda: figures)
        done = CliRunner().invoke(main, ["published", *options])
        return done.exit_code, done.output

    return call


@pytest.mark.parametrize(
    ("figures", "expected", "closing"),
    [
        ((RIGHT, BOUND, CANNOT), 0, "3 figures: 2 reproduced; 1 cannot be done"),
        ((RIGHT, EXPLAINED), 0, "2 figures: 1 reproduced; 1 differs, explained"),
        ((RIGHT, WRONG), 1, "2 figures: 1 reproduced; 1 differs, not explained"),
        ((WRONG, WRONG), 1, "2 figures: 2 differ, not explained"),
        ((RIGHT, NEEDLESS), 1, "2 figures: 1 reproduced; 1 explained, but reproduced"),
    ],
)
def test_a_difference_without_an_explanation_and_the_other_way_round_exit_1(run, figures, expected, closing):
    code, text = run(*figures)
    assert code == expected
    assert text.splitlines()[-1] == closing


def test_the_table_has_figure_source_and_reason(run):
    _, text = run(RIGHT, BOUND, EXPLAINED, CANNOT)
    for part in (
        "here: somebody",
        "  https://example.org",
        "  page 2 (taken from an account of it: the original was not at hand)",
        "    printed   0.50",
        "    measured  0.5  by the two truths",
        "    printed   < 1e-10",
        "    differs, explained, off by 0.1",
        "      explanation: a misprint",
        "      instead: it is not at hand",
        "    cannot be done: it is of a whale",
    ):
        assert part in text.splitlines(), part


def test_json_has_every_number(run):
    code, text = run(WRONG, CANNOT, options=["--json"])
    found = json.loads(text)
    assert (code, found["passed"]) == (1, False)
    assert found["counts"] == {"differs, not explained": 1, "cannot be done": 1}
    assert found["figures"][0]["off"] == pytest.approx(0.1)
    assert found["figures"][0]["source"]["url"] == "https://example.org"
    assert found["figures"][1]["reason"] == "it is of a whale"


def test_only_the_figures_of_a_source(run):
    assert run(WRONG, CANNOT, options=["--only", "there"])[1].splitlines()[-1] == "1 figures: 1 cannot be done"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--only", "nowhere"), "only: got 'nowhere'; allowed: sources: here, there"),
        (("--engines", "hammer"), "engines: got 'hammer'; allowed: one of all, none"),
        (("--engines", ""), "it names nothing"),
    ],
)
def test_what_cannot_be_used_exits_2(run, options, message):
    code, text = run(RIGHT, CANNOT, options=options)
    assert code == 2
    assert message in text


def test_an_engine_that_is_left_out_is_named(run):
    code, text = run(replace(RIGHT, method="mujoco:RK4"), options=["--engines", "none"])
    assert code == 0
    assert "cannot be done: mujoco is left out by --engines" in text
