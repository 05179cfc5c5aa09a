"""`conservative study`: any study of the table by its name, its rows shown and written."""

import csv
import json
from concurrent.futures import Future
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from conservative import BadInput
from conservative.benchmarks.measures import measurement
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import Measurement
from conservative.benchmarks.studies import hard_cases, on_cluster, stability, studies
from conservative.pickling import dump, load
from conservative.reports.cli.main import main
from conservative.reports.run import single_study
from conservative.reports.run.measure import Measurements
from conservative.reports.run.single_study import plan_study
from conservative.reports.sections.study import rows_table
from conservative.scenes.random_body import FIELDS

from ..sampling import sampled
from .rows import frame, row
from .test_random_ratios import SLOWER, TWICE

RANDOM = ("study", "random", "--bodies", "2", "--seed", "7", "--methods", "projected,heyoka")


def conservative(*arguments):
    return CliRunner(env={"COLUMNS": "200"}).invoke(main, [str(argument) for argument in arguments])


@pytest.fixture
def made_up(monkeypatch):
    """Measure nothing: two bodies of a field, on one of which ours is slower."""
    table = measurement.frame([line for lines in (*TWICE, *SLOWER) for line in lines])
    monkeypatch.setattr(single_study, "measure_study", lambda study, progress, scheduler: Measurements(table, pd.DataFrame()))
    return table


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
    line = "| spring | 1e-2 | 2 of 2 | 1 | 0 | 1 | ≈ 1.00 (0.500 to 2.00) | ✗ 0.500 | ✓ 2.00 | 1 | gauss | heyoka |"
    assert line in (tmp_path / "a.md").read_text()
    pictures = [f"random_bodies.{kind}" for kind in ("png", "svg")]
    names = [*pictures, "study.csv", "study.json", "study.md"]
    assert sorted(path.name for path in (tmp_path / "folder").iterdir()) == names
    assert "](random_bodies.svg)" in (tmp_path / "folder" / "study.md").read_text()
    assert ".svg" not in (tmp_path / "a.md").read_text()


def test_a_place_that_cannot_be_written_is_an_error_before_any_work(monkeypatch, tmp_path):
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
        (("speed", "--sizes", "3"), "sizes"),
        (("random", "--sizes", "3"), "sizes"),
        (("throughput", "--sizes", "1,half"), "sizes"),
        (("throughput", "--scenes", "brick_flip"), "scenes"),
        (("random", "--methods", "nonsense"), "method"),
    ],
)
def test_arguments_that_do_not_fit_the_study_are_refused(arguments, argument):
    done = conservative("study", *arguments)
    assert done.exit_code == 2
    assert done.stderr.startswith(f"Error: {argument}")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("name", studies.STUDIES)
def test_every_study_has_scenes_and_methods_of_its_own(name):
    planned = plan_study(name, skip_missing=True, bodies=1 if name == "random" else None, engines=("scipy",))
    assert planned.name == name
    assert planned.scenes
    assert planned.competitors


def test_studies_of_hard_cases_have_their_own_scenes():
    assert [scene.name for scene in plan_study("stability", methods=("reduced",)).scenes] == list(stability.SCENES)
    assert len(plan_study("hard_cases", methods=("reduced",)).scenes) == len(hard_cases.scenes())


def test_the_number_of_bodies_is_that_in_each_field():
    assert len(plan_study("random", methods=("projected",), bodies=2, seed=5).scenes) == 2 * len(FIELDS)
    assert "seed=5" in plan_study("random", methods=("projected",), bodies=1, seed=5).scenes[0].name
    with pytest.raises(BadInput):
        plan_study("random", methods=("projected",), bodies=0)


def test_numbers_of_bodies_are_read_as_people_write_them():
    planned = plan_study("throughput", methods=("mujoco:RK4",), sizes=("1", "1e3"), bodies=3, seed=2, quick=True)
    assert (planned.sizes, planned.bodies, planned.seed, planned.quick) == ((1, 1000), 3, 2, True)
    assert [method.name for method in planned.methods] == ["mujoco"]
    assert [scene.name for scene in planned.scenes] == ["heavy_tops", "free_bodies", "one_body"]


def test_a_failed_row_has_its_reason():
    table = frame([row("paper", "reduced", "energy drift max", float("nan"), outcome="unsupported"), *TWICE[0]])
    failed, good, *_ = rows_table("paper", table).rows
    assert failed[3:] == ["energy drift max", "–", "1", "unsupported"]
    assert good[-1] == ""


class Here:
    """A cluster that runs its tasks in this process, from bytes and to bytes as a real one does."""

    def __init__(self):
        self.tasks = 0

    def submit(self, fn, *args):
        self.tasks += 1
        future = Future()
        future.set_result(load(dump(load(dump((fn, args)))[0](*args))))
        return future


def numbers(finding):
    """What a finding is, to the last bit."""
    return [value.tobytes() if isinstance(value, np.ndarray) else repr(value) for value in vars(finding).values()]


@pytest.mark.parametrize("name", sampled(["paper", "long_runs"], 1, ["long_runs"]))
def test_a_study_on_a_cluster_finds_the_same_rows(monkeypatch, name):
    study = plan_study(name, ("brick_flip", "symmetric_body"), ("gauss",))
    here, told = Here(), []
    monkeypatch.setattr(on_cluster, "open_client", nullcontext)
    monkeypatch.setattr(on_cluster, "start_executor", lambda client: nullcontext(here))
    found = list(on_cluster.find_on_cluster("", study, lambda *each: told.append(each)))
    assert list(map(numbers, found)) == list(map(numbers, studies.findings(study)))
    assert here.tasks == 2
    assert told == [(0.0, "brick_flip"), (0.5, "symmetric_body")]


@pytest.mark.parametrize("name", [name for name, each in studies.STUDIES.items() if not each.timed])
def test_a_study_that_is_not_timed_has_no_times(name):
    planned = plan_study(name, () if studies.STUDIES[name].scenes else ("brick_flip",), ("reduced:order=4",), quick=True)
    found = studies.findings(replace(planned, scenes=planned.scenes[:1]))
    measures = {each.measure for each in found if isinstance(each, Measurement)}
    assert not {measure for measure in measures if measure.unit in ("s", "s/s") or measure is Measure.BODY_STEPS}


@pytest.mark.parametrize(("name", "words"), [("speed", "got one for the study 'speed'"), ("long_runs", "got 'nowhere'")])
def test_a_scheduler_that_cannot_be_used_is_refused(name, words):
    done = conservative("study", name, "--scenes", "brick_flip", "--methods", "gauss", "--scheduler", "nowhere")
    assert done.exit_code == 2
    assert done.stderr.splitlines()[-1].startswith(f"Error: scheduler: {words}")
