"""The library, the commands and reports on a system without fork, fcntl, resource, /proc, process groups and signals of POSIX.

`other_system/sitecustomize.py` takes them away from a Python process and from those that it starts. macOS and Windows
themselves are in the matrix of the workflow only.
"""

import ast
import os
import sys
from pathlib import Path

import pytest

from .environments import ROOT, run_python

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="it is another system already")
SYSTEM = Path(__file__).parent / "other_system"
PATHS = os.pathsep.join([str(SYSTEM), str(ROOT)])
OF_ONE_SYSTEM = {"fcntl", "resource", "pwd", "grp", "termios", "tty", "pty", "posix", "msvcrt", "winreg"}
PLACES = {"conservative/posix.py", "references/worker/program.py"}
"""The file for them, and the program of a worker, which imports nothing of this package."""
COMMAND = "import sys; from conservative.reports.cli.launch import launch; sys.argv[0] = 'conservative'; launch()"


def run(code, *arguments, **changed):
    exit_code, out, error = run_python(code, *map(str, arguments), PYTHONPATH=PATHS, **changed)
    assert exit_code == 0, error
    return out


def test_it_is_another_system():
    code = (
        "import os, signal, sys; print(sys.platform, hasattr(os, 'fork'), hasattr(signal, 'SIGHUP'), os.path.exists('/proc'))"
    )
    assert run(code).split() == ["unknown", "False", "False", "False"]
    for module in ("fcntl", "resource", "pwd"):
        exit_code, _, error = run_python(f"import {module}", PYTHONPATH=PATHS)
        assert (exit_code, "ModuleNotFoundError" in error) == (1, True)


def test_every_module_is_imported():
    code = """import conservative, importlib, pkgutil
names = [each.name for each in pkgutil.walk_packages(conservative.__path__, "conservative.")]
for name in names:
    if not name.endswith(("__main__", "pytest_plugin")) and ".engines." not in name:
        importlib.import_module(name)
print(len(names))"""
    assert int(run(code)) > 200


def test_bodies_move_and_samples_are_written(tmp_path):
    code = """import conservative as cv
for method in ("reduced", "taylor", "heyoka", "mujoco"):
    assert cv.integrate(cv.scenes.asymmetric_top(), 0.01, method, t_end=0.3).ok, method
bodies = cv.integrate_many(cv.scenes.brick_flip(t_end=0.3), dt=0.01, w_WB_B0=[[0, 0.05, 10], [0, 0.1, 10]])
assert bodies.ok.all()"""
    run(code)
    run(COMMAND, "run", "brick_flip", "-m", "reduced", "--csv", tmp_path / "run.csv")
    assert (tmp_path / "run.csv").read_text().count("\n") == 602
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv"]


@pytest.mark.slow
def test_a_program_runs_in_a_process_of_its_own(tmp_path):
    program = ROOT / "tests" / "references" / "programs" / "engine.py"
    places = {name: str(tmp_path) for name in ("XDG_CACHE_HOME", "XDG_CONFIG_HOME")}
    run(COMMAND, "engines", "add", f"{sys.executable} {program}", "--name", "mine", **places)
    out = run(COMMAND, "run", "brick_flip", "-m", "mine", "--t-end", "0.1", "--no-truth", **places)
    assert "10 steps" in out


@pytest.mark.slow
def test_a_report_is_written(tmp_path):
    choice = ("--scenes", "brick_flip", "--methods", "reduced,mujoco:RK4", "--out", tmp_path / "report")
    run(COMMAND, "report", "--quick", *choice)
    assert "</html>" in (tmp_path / "report" / "index.html").read_text()
    assert sorted(path.suffix for path in tmp_path.iterdir()) == [""]  # nothing is left beside it


def test_modules_of_one_system_have_one_place():
    found = set()
    for folder in ("conservative", "references", "benchmarks", "reports"):
        for path in (ROOT / folder).rglob("*.py"):
            if any(parent.is_symlink() for parent in path.parents):
                continue
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                names: list[str] = []
                if isinstance(node, ast.Import):
                    names = [name.name for name in node.names]
                elif isinstance(node, ast.ImportFrom) and not node.level:
                    names = [node.module or ""]
                elif isinstance(node, ast.Call):
                    names = [argument.value for argument in node.args if isinstance(argument, ast.Constant)]
                if OF_ONE_SYSTEM & set(names):
                    found.add(str(path.relative_to(ROOT)))
    assert found <= PLACES
    assert "conservative/posix.py" in found  # the search finds what there is
