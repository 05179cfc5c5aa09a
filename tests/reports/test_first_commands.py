"""The commands that the page of the commands begins with: they end well, and the motions that they show are right."""

import csv
import json
import re
import shlex
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import conservative as cv
from conservative import deferred_imports, registry
from conservative.attitude import from_quaternion
from conservative.references.environments import install
from conservative.references.environments.environment import Environment
from conservative.reports.cli.main import main

from ..independent import Case, angle_between, motion
from ..pages import ROOT, shell_lines
from ..sampling import sampled

PAGE = (ROOT / "reports" / "README.md").read_text(encoding="utf-8")
BLOCK = PAGE.partition("## Commands\n")[2].partition("On other pages")[0]
COMMANDS = {
    " ".join(words[1:3] if words[1] in ("engines", "verify") else words[1:2]): words[1:] for words in shell_lines(BLOCK)
}


def invoke(*words, code=0):
    done = CliRunner(env={"COLUMNS": "200"}).invoke(main, [str(word) for word in words])
    assert done.exit_code == code, (done.output[-2000:], done.exception)
    return done.stdout


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return an empty folder of a user who has nothing, with the scene file of `new`."""
    for name in ("CONFIG", "CACHE"):
        monkeypatch.setenv(f"XDG_{name}_HOME", str(tmp_path / name))
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    deferred_imports.list_entries.cache_clear()
    (tmp_path / "work" / "my_body.toml").write_text(invoke(*COMMANDS["new"]))
    yield tmp_path / "work"
    deferred_imports.list_entries.cache_clear()


def right(t, w_WB_B0=None, R_WB0=None):
    """Return the attitudes of the body of `new` at times, s, by an integration that shares nothing with the package."""
    scene = registry.scene("my_body.toml")
    field = ("gravity", scene.potential.weight, scene.potential.com_B)
    start = scene.R_WB0 if R_WB0 is None else R_WB0
    rates = scene.w_WB_B0 if w_WB_B0 is None else w_WB_B0
    return motion(Case(scene.body.inertia, start, rates, scene.t_end, field), t)[0]


def new(shown):
    assert right([0.0, 2.0])[1].shape == (3, 3)


def run(shown):
    rows = list(csv.DictReader(Path("run.csv").read_text(encoding="utf-8").splitlines()))
    t = [float(row["t (s)"]) for row in rows[::100]]
    R_WB = [[[float(row[f"R_WB_{i}{j}"]) for j in "123"] for i in "123"] for row in rows[::100]]
    assert (len(rows), t[-1]) == (1001, 2.0)
    assert angle_between(right(t), np.array(R_WB)).max() < 1e-10  # measured 4e-12: of the integration that it is compared with


def watch(shown):
    page = Path("watch.html").read_text(encoding="utf-8")
    data = json.loads(re.search(r'class="data">(.*?)</script>', page, re.DOTALL)[1])
    q = np.roll(np.reshape(data["panels"][1]["q"], (-1, 4)), 1, axis=1)  # the player has the scalar last
    R_WP, R_BP = from_quaternion(q / np.linalg.norm(q, axis=1, keepdims=True)), registry.scene("my_body.toml").body.R_BP
    frames = np.linspace(0, data["duration"], data["frames"])[::50]
    assert data["duration"] == pytest.approx(2.0)
    assert angle_between(right(frames) @ R_BP, R_WP[::50]).max() < 3e-3  # measured 7e-4: the page has four digits


def recommend(shown):
    """The advised command reaches the error over all of the hour."""
    (line,) = re.findall(r"^Run: conservative (.*)$", shown, re.MULTILINE)
    found = json.loads(invoke(*shlex.split(line), "--json"))
    assert found["error"]["attitude"] < 1e-6  # measured 1.2e-10
    assert found["t_end"] == pytest.approx(3600)


def sweep(shown):
    assert "1,000: 1,000 ok" in shown
    invoke(*COMMANDS["sweep"], "--starts", "3", "--out", "swept.zarr")
    scene, found = registry.scene("my_body.toml"), cv.open_ensemble("swept.zarr")
    starts = cv.spread(scene, 3, attitude="5deg", rate="2%", seed=0)
    for i in range(3):
        expected = right(found.t, starts["w_WB_B0"][i], starts["R_WB0"][i])
        assert angle_between(expected, np.asarray(found.R_WB[i])).max() < 1e-10  # measured 5e-12


def add(shown):
    found = json.loads(invoke("run", "brick_flip", "-m", "my_engine", "--json"))
    assert found["error"]["attitude"] < 2e-5  # measured 4e-6


def verify(shown):
    assert any(" is right: " in line for line in shown.splitlines()[:3])  # after two lines on what the recording is


CHECKS = {"new": new, "run": run, "watch": watch, "sweep": sweep, "verify run.csv": verify, "verify my_body.urdf": verify}
CHECKS |= {"engines add": add, "recommend": recommend, "verify my_engine": verify}
ELSEWHERE = {"engines install", "gate", "list", "track", "report", "study", "motions"}
"""The first is below, the others in tests of their own."""


def test_every_command_of_the_block_is_checked():
    assert set(COMMANDS) == set(CHECKS) | ELSEWHERE
    assert len(COMMANDS) == 16


DEFAULT = ["run", "watch", "verify run.csv", "verify my_body.urdf", "engines add"]


@pytest.mark.parametrize("name", sampled(CHECKS, len(DEFAULT), DEFAULT))
def test_a_command_ends_well_and_shows_a_right_motion(name, folder):
    if name == "verify run.csv":
        invoke(*COMMANDS["run"])
    shutil.copy(ROOT / "references/model_files/models/fixed_child.urdf", "my_body.urdf")
    program = (ROOT / "tests/references/programs/engine.py").read_text(encoding="utf-8")
    (folder / "my_engine").write_text(f"#!{sys.executable} -I\n{program}")
    (folder / "my_engine").chmod(0o755)
    if name == "verify my_engine":
        invoke(*COMMANDS["engines add"])
    CHECKS[name](invoke(*COMMANDS[name]))


def test_the_engines_of_the_page_are_installed(monkeypatch):
    """Without a network: their names are known, and each gets to the installation."""

    def made(name, *options):
        return install.Installation(Environment(name, "1", ROOT, "3", ()), True, "")

    monkeypatch.setattr(install, "install", made)
    shown = invoke(*COMMANDS["engines install"])
    assert [line.partition("@")[0] for line in shown.splitlines()] == ["exudyn", "drake"]
