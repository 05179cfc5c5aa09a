"""`gate --against REF --build COMMAND`: two versions of a program in any language."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from conservative import deferred_imports
from conservative.reports.cli.main import main

pytestmark = pytest.mark.slow
PROGRAM = Path(__file__).parents[2] / "references" / "programs" / "planted.py"


def git(*words):
    subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@b", *words], check=True, capture_output=True)


@pytest.fixture(autouse=True)
def project(tmp_path, monkeypatch):
    """Return the folder of a project whose first commit has the program, and whose build copies it."""
    for name in ("CONFIG", "CACHE"):
        monkeypatch.setenv(f"XDG_{name}_HOME", str(tmp_path / name))
    folder = tmp_path / "project"
    folder.mkdir()
    monkeypatch.chdir(folder)
    shutil.copy(PROGRAM, "source.py")
    git("init", "-q")
    git("add", "-A")
    git("commit", "-qm", "first")
    Path("conservative.toml").write_text(f'[engines]\nmine = "{sys.executable} -I built.py rk4"\n')
    deferred_imports.list_entries.cache_clear()
    yield folder
    deferred_imports.list_entries.cache_clear()


def gate(build):
    arguments = ["gate", "--against", "HEAD", "--build", build, "--scenes", "brick_flip", "--processes", "2"]
    return CliRunner().invoke(main, arguments)


def test_a_change_of_the_errors_is_found(project):
    source = Path("source.py").read_text()
    Path("source.py").write_text(source.replace("h / 6", "h / 6.001"))
    done = gate("cp source.py built.py")
    assert done.exit_code == 1
    assert "another motion, brick_flip, mine: was 4.29e" in done.output
    assert "first row" not in done.output  # the start is given, so that no other one explains anything


def test_a_build_that_fails_is_named():
    done = gate("echo no compiler; exit 3")
    assert (done.exit_code, "which ends with exit code 3 for HEAD (no compiler)" in done.output) == (2, True)
