import platform
import subprocess

import pytest
from llvmlite.binding import get_host_cpu_name

from conservative.benchmarks.measures import origin
from conservative.benchmarks.measures.origin import commit, commit_title, machine, machine_title

CPU = """processor\t: 0
cpu family\t: 25
model\t\t: 1
model name\t: AMD EPYC

processor\t: 1
cpu family\t: 26
model\t\t: 2
model name\t: another
"""


@pytest.fixture
def linux(tmp_path, monkeypatch):
    """The folder of a machine with these files in /proc."""
    (tmp_path / "cpuinfo").write_text(CPU)
    (tmp_path / "meminfo").write_text("MemTotal:       16000000 kB\nMemFree: 1 kB\n")
    read = origin.first_values
    monkeypatch.setattr(origin, "first_values", lambda path: read(str(tmp_path / path.rpartition("/")[2])))
    return tmp_path


def test_a_machine_is_described_by_its_first_processor(linux):
    described = machine()
    assert (described["processor"], described["memory"]) == ("AMD EPYC", "16000000 kB")
    assert set(described) == {"processor", "architecture", "cores", "memory", "system"}


def test_the_title_contains_what_affects_round_off(linux):
    known, architecture = machine_title(), platform.machine()
    assert known.startswith(f"AMD EPYC cpu family 25 model 1, {architecture}, numba ")
    (linux / "meminfo").write_text("MemTotal: 1 kB\n")
    assert machine_title() == known
    (linux / "cpuinfo").write_text("model name: AMD EPYC\n")
    assert machine_title().startswith(f"AMD EPYC, {architecture}, numba ")


def test_other_systems_are_described_by_python(tmp_path, monkeypatch):
    monkeypatch.setattr(origin, "first_values", lambda path: {})
    described = machine()
    assert get_host_cpu_name() in described["processor"]
    assert 2**20 < int(described["memory"].removesuffix(" kB")) < 2**40
    monkeypatch.setattr(origin, "physical_memory", lambda: 0)
    assert machine()["memory"] == "unknown"
    assert origin.first_values(str(tmp_path / "nothing")) == {}


def test_commit(tmp_path):
    assert commit(tmp_path) == ""
    who = ["-c", "user.name=a", "-c", "user.email=a@b"]
    for words in (["init", "-q"], [*who, "commit", "-q", "--allow-empty", "-m", "first"]):
        subprocess.run(["git", "-C", tmp_path, *words], check=True)
    assert len(commit(tmp_path)) == 40
    assert commit(tmp_path, mark_changes=True) == commit(tmp_path)
    (tmp_path / "file").write_text("new")
    subprocess.run(["git", "-C", tmp_path, "add", "file"], check=True)
    assert commit(tmp_path, mark_changes=True) == f"{commit(tmp_path)}+changes"
    assert origin.git(tmp_path, "no-such-command") == ""


def test_the_title_of_a_commit_is_the_one_that_was_pushed(tmp_path):
    def git(*arguments):
        who = ["-c", "user.name=a", "-c", "user.email=a@b"]
        done = subprocess.run(["git", "-C", tmp_path, *who, *arguments], check=True, capture_output=True, text=True)
        return done.stdout.strip()

    git("init", "--quiet", "--initial-branch=main")
    hashes = []
    for text in ("First", "Turn faster"):
        git("commit", "--quiet", "--allow-empty", "--message", text)
        hashes.append(git("rev-parse", "HEAD"))
    base, pushed = hashes
    assert commit_title(tmp_path, base) == f"{base[:9]} First"
    assert commit_title(tmp_path, f"{pushed}+changes") == f"{pushed[:9]}+changes Turn faster"
    git("commit", "--quiet", "--allow-empty", "--message", f"Merge {pushed} into {base}")  # as GitHub tests a pull request
    assert commit_title(tmp_path, git("rev-parse", "HEAD")) == f"{pushed[:9]} Turn faster"
    git("commit", "--quiet", "--allow-empty", "--message", f"Merge {'1' * 40} into {base}")  # which was not fetched
    assert commit_title(tmp_path, git("rev-parse", "HEAD")) == "1" * 9
    assert commit_title(tmp_path, "") == commit_title(tmp_path / "nowhere", "") == ""
