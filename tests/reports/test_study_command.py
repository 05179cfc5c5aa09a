"""`conservative study`: any study of the table by its name, its rows shown and written."""

import csv
import json

import pandas as pd
import pytest
from click.testing import CliRunner

from conservative import BadInput
from conservative.benchmarks.measures import measurement
from conservative.benchmarks.studies import hard_cases, stability, studies
from conservative.reports.cli.main import main
from conservative.reports.run import single_study
from conservative.reports.run.measure import Measurements
from conservative.reports.run.single_study import Extent, plan_study
from conservative.reports.tables.study_rows import rows_table

from .rows import row
from .test_random_ratios import SLOWER, TWICE

RANDOM = ("study", "random", "--bodies", "2", "--seed", "7", "--methods", "projected,heyoka")


def conservative(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@pytest.fixture
def made_up(monkeypatch):
    """Measure nothing: two bodies of a field, on one of which ours is slower."""
    table = measurement.frame([each for lines in (*TWICE, *SLOWER) for each in lines])
    monkeypatch.setattr(single_study, "measure_study", lambda study, progress: Measurements(table, pd.DataFrame()))
    return table


def test_a_study_of_random_bodies_shows_its_ratios(made_up):
    done = conservative(*RANDOM)
    assert done.exit_code == 0, done.output
    text = " ".join(done.stdout.split())
    assert "spring 1e-2 2 of 2 ✓ 1.00 ✗ 0.50 ✓ 2.00 1" in text
    assert "on the worst body 0.50 times" in text


def test_json_has_ratios_and_rows(made_up):
    found = json.loads(conservative(*RANDOM, "--json").stdout)
    assert (found["study"], len(found["rows"])) == ("random", len(made_up))
    assert found["ratios"][0]["worst"] == 0.5
    assert found["command"]


def test_files_have_the_rows_and_the_tables(made_up, tmp_path):
    done = conservative(*RANDOM, "--csv", tmp_path / "a.csv", "--markdown", tmp_path / "a.md", "--out", tmp_path / "folder")
    assert done.exit_code == 0, done.output
    with (tmp_path / "a.csv").open(newline="") as file:
        assert len(list(csv.DictReader(file))) == len(made_up)
    assert "| spring | 1e-2 | 2 of 2 | ✓ 1.00 | ✗ 0.50 | ✓ 2.00 | 1 | gauss | heyoka |" in (tmp_path / "a.md").read_text()
    assert sorted(path.name for path in (tmp_path / "folder").iterdir()) == ["study.csv", "study.json", "study.md"]


def test_a_place_that_cannot_be_written_is_told_before_any_work(monkeypatch, tmp_path):
    monkeypatch.setattr(single_study, "measure_study", lambda *_: pytest.fail("it measures"))
    done = conservative(*RANDOM, "--csv", tmp_path)
    assert (done.exit_code, "csv" in done.stderr) == (2, True)


def test_any_other_study_shows_its_rows(tmp_path):
    done = conservative(
        "study", "speed", "--scenes", "brick_flip", "--methods", "reduced:order=4", "--quick", "--csv", tmp_path / "a"
    )
    assert done.exit_code == 0, done.output
    assert "time per" in done.stdout  # the names of methods wrap
    assert set(pd.read_csv(tmp_path / "a")["study"]) == {"speed"}


@pytest.mark.parametrize(
    ("arguments", "argument"),
    [
        (("nonsense",), "name"),
        (("random", "--scenes", "brick_flip"), "scenes"),
        (("speed", "--seed", "3"), "seed"),
        (("speed", "--bodies", "3"), "bodies"),
        (("engines_at_one_step", "--methods", "reduced"), "methods"),
        (("random", "--methods", "nonsense"), "method"),
    ],
)
def test_what_is_not_for_the_study_is_refused(arguments, argument):
    done = conservative("study", *arguments)
    assert done.exit_code == 2
    assert done.stderr.startswith(f"Error: {argument}")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("name", studies.MAKERS)
def test_every_study_has_scenes_and_methods_of_its_own(name):
    planned = plan_study(name, Extent(skip_missing=True, bodies=1 if name == "random" else None, engines=("scipy",)))
    assert planned.name == name
    assert planned.scenes
    assert planned.competitors


def test_studies_of_hard_cases_have_their_own_scenes():
    assert [scene.name for scene in plan_study("stability", Extent(methods=("reduced",))).scenes] == list(stability.SCENES)
    assert len(plan_study("hard_cases", Extent(methods=("reduced",))).scenes) == len(hard_cases.scenes())


def test_the_number_of_bodies_is_that_in_each_field():
    assert len(plan_study("random", Extent(methods=("projected",), bodies=2, seed=5)).scenes) == 8
    assert "seed=5" in plan_study("random", Extent(methods=("projected",), bodies=1, seed=5)).scenes[0].name
    with pytest.raises(BadInput):
        plan_study("random", Extent(methods=("projected",), bodies=0))


def test_a_row_that_failed_says_why():
    table = measurement.frame([row("paper", "reduced", "energy drift max", float("nan"), outcome="unsupported"), *TWICE[0]])
    _, (failed, good, *_) = rows_table(table)
    assert failed[3:] == ["energy drift max", "–", "1", "unsupported"]
    assert good[-1] == ""
