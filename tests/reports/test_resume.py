"""Files of unfinished reports, their resumption, and interruptions of a real process."""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from conservative import BadInput, NotConverged, Torque
from conservative.benchmarks.measures.measurement import Samples
from conservative.method import Role
from conservative.reports import report
from conservative.reports.charts import style
from conservative.reports.cli.main import main
from conservative.reports.document.model import Document
from conservative.reports.run import checkpoint
from conservative.reports.run import measure as measurements
from conservative.reports.run.measure import measure
from conservative.reports.run.plan import plan_report
from conservative.reports.run.provenance import provenance
from conservative.reports.sections import report as sections

from ..environments import PATIENCE, programs
from .made_up import convergence
from .rows import row

OUTCOME = NotConverged(3, 0.02, 0.5, "why").outcome
SMALL = ["report", "--quick", "--scenes", "brick_flip", "--methods", "reduced:order=4,moser_veselov:order=2"]


@pytest.fixture
def unfinished(tmp_path, monkeypatch):
    """A folder with the file of a report that has finished one study."""
    monkeypatch.chdir(tmp_path)
    made = plan_report(["brick_flip"], ["reduced:order=4", "moser_veselov:order=2"], quick=True)
    source = provenance(SMALL)
    kept = checkpoint.begin(made, Path("report"), source, resume=False)
    line = {
        "study": "paper",
        "scene": "brick_flip",
        "method": "reduced",
        "label": "reduced",
        "series": "reduced",
        "role": Role.OURS,
        "dt": 0.1,
    }
    lines = Samples(**line, quantity="energy", t=np.array([0.1 + 0.2]), value=np.array([np.nan]))
    kept.store("paper", [row("paper", "reduced", "energy drift max", np.nan, outcome=OUTCOME), lines])
    return tmp_path


def test_floats_come_back_as_they_are(unfinished):
    *_, found = checkpoint.read(unfinished / "report.partial.json")
    row, *_, line = found["paper"].findings
    assert row.dt == 0.1
    assert row.value != row.value
    assert row.outcome == OUTCOME
    assert line.t[0] == 0.1 + 0.2
    assert np.isnan(line.value[0])


@pytest.mark.parametrize(
    ("changed", "parts"),
    [
        (SMALL[:1] + SMALL[2:], ["--quick True, now False"]),
        ([*SMALL[:3], "turned_brick", *SMALL[4:]], ["scenes: brick_flip (now without)", "turned_brick missing (now with)"]),
        ([*SMALL[:5], "reduced:order=4"], ["methods: moser_veselov:order=2 (now without)"]),
        ([*SMALL, "--time-limit", "7"], ["--time-limit ", "now 7"]),
        ([*SMALL, "--bodies", "2", "--seed", "5"], ["--bodies ", "--seed 0, now 5"]),
        ([*SMALL, "--skip-missing"], ["--skip-missing False, now True"]),
        ([*SMALL[:3], "brick_flip:disturbance=1e-6", *SMALL[4:]], ["scenes: brick_flip"]),
    ],
)
def test_a_report_with_other_terms_is_not_resumed(changed, parts, unfinished):
    done = CliRunner().invoke(main, [*changed, "--resume"])
    assert done.exit_code == 2
    assert done.stderr.count("\n") == 1
    for part in [*parts, "resume: got 'report.partial.json'", f"it was `conservative {' '.join(SMALL)}`", "no --resume"]:
        assert part in done.stderr
    assert [path.name for path in unfinished.iterdir()] == ["report.partial.json"]


@pytest.mark.parametrize(("key", "part"), [("source", "source: hash abc, now"), ("versions", "versions: numpy 1.0, now 2")])
def test_a_report_with_other_versions_or_source_is_not_resumed(key, part, unfinished):
    path = unfinished / "report.partial.json"
    content = json.loads(path.read_text())
    content["terms"][key] |= {"hash": "abc"} if key == "source" else {"numpy": "1.0"}
    path.write_text(json.dumps(content))
    done = CliRunner().invoke(main, [*SMALL, "--resume"])
    assert done.exit_code == 2
    assert part in done.stderr


def test_a_report_of_a_changed_scene_is_not_resumed(unfinished):
    """Its step, or a torque beside the field, or a torque that cannot be compared; the name is the same."""
    source, made = provenance(SMALL), plan_report(["brick_flip"], ["reduced:order=4", "moser_veselov:order=2"], quick=True)
    (brick,) = made.scenes
    environment = Torque(lambda t: (0, 0, float(os.environ.get("TEST_GAIN", "1"))))
    changes = {
        "step 0.02 s": {"dt": 0.02},
        "scenes: brick_flip": {"torque": Torque((0, 0, 1e-9))},
        "'brick_flip' with": {"torque": environment},
    }
    assert checkpoint.begin(made, Path("report"), source, resume=True).results
    for part, change in changes.items():
        other = replace(made, scenes=(brick.rename("brick_flip", **change),))
        with pytest.raises(BadInput, match=f"^resume: got .*{part}"):
            checkpoint.begin(other, Path("report"), source, resume=True)


def test_there_has_to_be_something_to_resume(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, [*SMALL, "--resume"])
    assert done.exit_code == 2
    assert done.stderr.startswith("Error: resume: got no 'report.partial.json'; expected ")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("content", ["mine", "[]", ""])
@pytest.mark.parametrize("resume", [[], ["--resume"]])
def test_a_file_that_is_something_else_stays(content, resume, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "report.partial.json").write_text(content)
    done = CliRunner().invoke(main, [*SMALL, *resume])
    assert done.exit_code == 2
    assert "out: got 'report.partial.json'" in done.stderr
    assert (tmp_path / "report.partial.json").read_text() == content


@pytest.fixture
def made_up_rows(monkeypatch):
    """Reports of made-up rows, without pictures."""
    monkeypatch.setattr(style, "picture_file", lambda picture, kind: b"")
    monkeypatch.setattr(measurements, "compile_kernels", lambda *_: None)
    found = convergence("moser_veselov:order=2", 2)
    monkeypatch.setattr(measurements.studies, "findings", lambda study, tell: (row for row in found if row.study == study.name))


@pytest.mark.parametrize(
    "content", ['{"format": 99, "studies": {}}', '{"format": 4, "studies": {"paper": {}}}', '{"format": 4, "comm']
)
def test_a_damaged_file_is_replaced_and_cannot_be_resumed(content, tmp_path, monkeypatch, made_up_rows):
    monkeypatch.setattr(sections, "build", lambda *_: Document("", "", ()))
    monkeypatch.chdir(tmp_path)
    kept = tmp_path / "report.partial.json"
    kept.write_text(content)
    done = CliRunner().invoke(main, [*SMALL, "--resume"])
    assert (done.exit_code, kept.read_text()) == (2, content)
    assert "resume: got 'report.partial.json', which is damaged" in done.stderr
    again = CliRunner().invoke(main, [*SMALL[:-1], "moser_veselov:order=2"])
    assert again.exit_code == 0, again.output
    assert not kept.exists()


def test_a_new_report_replaces_unfinished_work_after_its_first_study(unfinished):
    before = (unfinished / "report.partial.json").read_text()

    def stop(share, what):
        raise KeyboardInterrupt

    made = plan_report(["brick_flip"], ["reduced:order=4"], quick=True)
    with pytest.raises(KeyboardInterrupt):
        report.write(made, unfinished / "report", stop)
    assert (unfinished / "report.partial.json").read_text() == before


def test_finished_studies_survive_an_error(tmp_path):
    def fail(share, what):
        if "convergence" in what:
            raise BadInput("dt", "0", "above 0")

    made = plan_report(["brick_flip"], ["moser_veselov:order=2"], quick=True)
    with pytest.raises(BadInput) as caught:
        report.write(made, tmp_path / "report", fail)
    assert "2 of 6 studies are finished (motion, paper)" in caught.value.__notes__[0]
    assert list(json.loads((tmp_path / "report.partial.json").read_text())["studies"]) == ["motion", "paper"]


@pytest.mark.parametrize("out", ["/", ".", "..", "deep/report", "report/"])
def test_unfinished_work_is_stored_next_to_the_folder(out, tmp_path, monkeypatch):
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    found = (here / checkpoint.path_for(Path(out))).resolve()
    folder = (here / out).resolve()
    assert found == folder.parent / f"{folder.name}.partial.json"


# Interruptions of a real process.

TIMES = ("s", "s/s")


INTERRUPTED = """
import os, signal, sys
from conservative.benchmarks.studies import studies
from conservative.reports.cli.launch import launch
number, name, findings = int(sys.argv.pop(1)), sys.argv.pop(1), studies.findings
def interrupted(study, tell):
    for finding in findings(study, tell):
        if study.name == name: os.kill(os.getpid(), number)
        yield finding
studies.findings = interrupted
launch()
"""
"""The command, which gets a signal in the middle of a study."""


def run_command(folder, *arguments, code="from conservative.reports.cli.launch import launch; launch()"):
    """Run a command in a folder, and return its exit code, stdout and stderr."""
    command = [sys.executable, "-X", "faulthandler", "-c", code, *arguments]
    with programs() as start:
        process = start(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        out, err = process.communicate(timeout=PATIENCE)
    return process.returncode, out, err


def an_earlier_report(folder):
    folder.mkdir()
    (folder / "measurements.json").write_text(json.dumps({"files": ["report.md", "measurements.json"]}))
    (folder / "report.md").write_text("earlier")
    (folder / "mine.txt").write_text("mine")


@pytest.fixture(scope="module")
def resumed(tmp_path_factory):
    """The folder of a report that was interrupted and resumed, and the output of both processes."""
    folder = tmp_path_factory.mktemp("resumed")
    an_earlier_report(folder / "report")
    kept = folder / "report.partial.json"
    code, out, err = run_command(folder, str(int(signal.SIGINT)), "work_precision", *SMALL, code=INTERRUPTED)
    left = {path.name for path in folder.iterdir()}
    earlier = {path.name: path.read_text() for path in (folder / "report").iterdir()}
    content = json.loads(kept.read_text())
    again = shlex.split(err.partition("continue with: ")[2])
    return folder, (code, out, err), left, earlier, content, again, run_command(folder, *again[1:])


@pytest.mark.slow
def test_an_interrupt_stores_finished_studies_and_prints_the_command_that_continues(resumed):
    _, (code, out, err), left, earlier, content, again, _ = resumed
    assert code == 130, err
    assert out == ""
    assert "\nInterrupted; " in err
    said = re.search(r"(\d) of 6 studies are finished \((.*)\) and stored", err)
    names = said[2].split(", ")
    assert names == list(content["studies"])
    assert len(names) == int(said[1])
    assert names[-1] == "speed"
    assert again == ["conservative", *SMALL, "--resume"]
    assert left == {"report", "report.partial.json"}
    assert earlier["report.md"] == "earlier"
    assert len(earlier) == 3


@pytest.mark.slow
def test_a_resumed_report_is_complete_and_names_its_origin(resumed):
    folder, _, _, _, content, _, (code, out, err) = resumed
    assert code == 0, err
    assert out.endswith("report/index.html\n")
    assert {path.name for path in folder.iterdir()} == {"report"}
    listed = json.loads((folder / "report" / "measurements.json").read_text())["files"]
    assert {path.name for path in (folder / "report").iterdir()} == {*listed, "mine.txt"}
    assert (folder / "report" / "mine.txt").read_text() == "mine"
    made = json.loads((folder / "report" / "measurements.json").read_text())
    (earlier,) = made["resumed"]
    assert earlier.startswith(f"{', '.join(content['studies'])}: measured by an earlier process")
    assert content["studies"]["paper"]["by"]["start"] in earlier
    assert made["command"].endswith("--resume")


@pytest.mark.slow
def test_a_resumed_report_has_the_measurements_of_one_that_was_not_interrupted(resumed, tmp_path):
    made = plan_report(["brick_flip"], ["reduced:order=4", "moser_veselov:order=2"], quick=True)
    kept = checkpoint.begin(made, tmp_path / "report", provenance(SMALL), resume=False)
    measure(made, lambda share, what: None, kept).table.to_csv(tmp_path / "whole.csv", index=False)
    found, whole = (pd.read_csv(path) for path in (resumed[0] / "report" / "measurements.csv", tmp_path / "whole.csv"))
    assert len(found) > 100
    timed = found["unit"].isin(TIMES)
    assert timed.any()
    pd.testing.assert_frame_equal(found[~timed], whole[~timed], check_exact=True)
    same = ["study", "scene", "method", "label", "role", "dt", "quantity", "measure", "unit", "outcome"]
    pd.testing.assert_frame_equal(found.loc[timed, same], whole.loc[timed, same], check_exact=True)


@pytest.mark.slow
def test_finished_studies_are_not_measured_again(resumed):
    folder, content = resumed[0], resumed[4]
    rows = json.loads((folder / "report" / "measurements.json").read_text())["rows"]
    kept = content["studies"]["speed"]["rows"]
    names = ("scene", "method", "label", "family", "setting", "role", "series", "measure")
    measured = [[row[name] for name in names] for row in rows if row["study"] == "speed"]
    assert measured == [[row[name] for name in names] for row in kept]
    times = [row["value"] for row in rows if row["study"] == "speed"]
    assert times == pytest.approx([row["value"] for row in kept], rel=1e-9)  # JSON of pandas keeps 15 decimal places


@pytest.mark.slow
def test_sigterm_before_anything_is_finished_leaves_nothing(tmp_path):
    first = plan_report(["brick_flip"], ["reduced:order=4"], quick=True).names[0]
    code, out, err = run_command(tmp_path, str(int(signal.SIGTERM)), first, *SMALL, code=INTERRUPTED)
    assert (code, out) == (143, "")
    assert err.endswith("Interrupted; no study was finished\n")
    assert list(tmp_path.iterdir()) == []
