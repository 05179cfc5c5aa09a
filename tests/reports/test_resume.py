"""A report that is interrupted keeps what is finished, and --resume goes on with it: tried with real signals."""

import json
import re
import shlex
import signal
import subprocess
import sys
import time

import pandas as pd
import pytest

from conservative.reports.run import checkpoint
from conservative.reports.run.measure import measure
from conservative.reports.run.plan import plan_report
from conservative.reports.run.provenance import provenance

from ..environments import programs

pytestmark = pytest.mark.slow

SMALL = ["report", "--quick", "--scenes", "brick_flip", "--methods", "reduced:order=4,moser_veselov:order=2"]
TIMES = ("s", "s/s")
HANG = 600
"""Time, s, after which a process hangs for sure."""


def started(start, arguments, folder):
    code = [sys.executable, "-c", "from conservative.reports.cli.launch import launch; launch()"]
    return start([*code, *arguments], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def stopped(arguments, folder, number, ready):
    """Start a command, send it a signal once `ready`, and return its exit code, stdout and stderr."""
    with programs() as start:
        process = started(start, arguments, folder)
        end = time.monotonic() + HANG
        while not ready() and process.poll() is None and time.monotonic() < end:
            time.sleep(0.005)
        process.send_signal(number)
        out, err = process.communicate(timeout=HANG)
    return process.returncode, out, err


def pieces(path):
    return list(json.loads(path.read_text())["pieces"]) if path.exists() else []


def an_earlier_report(folder):
    folder.mkdir()
    (folder / "measurements.json").write_text(json.dumps({"files": ["report.md", "measurements.json"]}))
    (folder / "report.md").write_text("earlier")
    (folder / "mine.txt").write_text("mine")


@pytest.fixture(scope="module")
def resumed(tmp_path_factory):
    """The folder of a report that was interrupted and resumed, and what was said on the way."""
    folder = tmp_path_factory.mktemp("resumed")
    an_earlier_report(folder / "report")
    kept = folder / "report.partial.json"
    code, out, err = stopped(SMALL, folder, signal.SIGINT, lambda: "speed" in pieces(kept))
    left = {path.name for path in folder.iterdir()}
    earlier = {path.name: path.read_text() for path in (folder / "report").iterdir()}
    content = json.loads(kept.read_text())
    again = shlex.split(err.partition("go on with: ")[2])
    with programs() as start:
        done = started(start, again[1:], folder)
        said = done.communicate(timeout=HANG)
    return folder, (code, out, err), left, earlier, content, again, (done.returncode, *said)


def test_an_interrupt_keeps_what_is_finished_and_says_how_to_go_on(resumed):
    _, (code, out, err), left, earlier, content, again, _ = resumed
    assert code == 130
    assert out == ""
    assert "\nInterrupted; " in err
    said = re.search(r"(\d) of 5 studies are finished \((.*)\) and kept", err)
    names = said[2].split(", ")
    assert names == list(content["pieces"])[: int(said[1])]  # a kill can come when a study is kept and not yet said to be
    assert "convergence" in names
    assert again == ["conservative", *SMALL, "--resume"]
    assert left == {"report", "report.partial.json"}
    assert earlier["report.md"] == "earlier"
    assert len(earlier) == 3


def test_resume_does_the_rest_and_tidies_up(resumed):
    folder, *_, (code, out, err) = resumed
    assert code == 0, err
    assert out.endswith("report/index.html\n")
    assert {path.name for path in folder.iterdir()} == {"report"}
    listed = json.loads((folder / "report" / "measurements.json").read_text())["files"]
    assert {path.name for path in (folder / "report").iterdir()} == {*listed, "mine.txt"}
    assert (folder / "report" / "mine.txt").read_text() == "mine"


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


def test_what_was_finished_is_not_measured_again(resumed):
    folder, content = resumed[0], resumed[4]
    rows = json.loads((folder / "report" / "measurements.json").read_text())["rows"]
    kept = content["pieces"]["speed"]["rows"]
    assert [list(row.values())[:9] for row in rows if row["study"] == "speed"] == [list(row.values())[:9] for row in kept]
    times = [row["value"] for row in rows if row["study"] == "speed"]
    assert times == pytest.approx([row["value"] for row in kept], rel=1e-9)  # JSON of pandas keeps 15 decimal places


def test_a_resumed_report_says_so(resumed):
    folder, content = resumed[0], resumed[4]
    by = content["pieces"]["paper"]["by"]
    made = json.loads((folder / "report" / "measurements.json").read_text())
    assert len(made["resumed"]) == 1
    assert made["resumed"][0].startswith(f"{', '.join(content['pieces'])}: measured by an earlier process")
    assert by["start"] in made["resumed"][0]
    assert made["command"].endswith("--resume")


def test_sigterm_before_anything_is_finished_leaves_nothing(tmp_path):
    def at_work():
        return any(path.name.startswith(".report-") for path in tmp_path.iterdir())

    code, out, err = stopped(SMALL, tmp_path, signal.SIGTERM, at_work)
    assert (code, out) == (143, "")
    assert err.endswith("Interrupted; nothing was finished, nothing is kept\n")
    assert list(tmp_path.iterdir()) == []
