"""Without extras the package integrates, and errors name the extra that provides a missing package."""

import sys
from importlib.metadata import packages_distributions
from pathlib import Path

import numpy as np
import pytest

import conservative as cv
from conservative.references.exact.method import free_body

from .environments import LEAN, run_python

BODY = cv.RigidBody([2e-3, 6e-3, 7e-3])
REFUSE = """
import sys

class Refuse:
    def find_spec(self, name, path=None, target=None):
        if path is None and name in refused:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

refused = set(sys.argv.pop(1).split(","))
sys.meta_path.insert(0, Refuse())
"""
LOOK = """
import importlib.util
find_spec = importlib.util.find_spec
importlib.util.find_spec = lambda name, package=None: None if name in refused else find_spec(name, package)
"""
"""For code that looks for a package without importing it."""


def others():
    """Return the importable names of the packages that the package does not require."""
    lean = {*LEAN, "llvmlite", "pygments", "markdown-it-py", "mdurl", "conservative-rotation"}
    return ",".join(
        name for name, packages in packages_distributions().items() if not lean & {package.lower() for package in packages}
    )


LEAN_RUN = """
import conservative as cv
from conservative.references.exact.method import free_body
assert cv.integrate(cv.scenes.brick_flip(), dt=0.01).outcome.ok
from conservative import registry
registry.method("exact"), registry.method("scipy")
"""
SHOWN = """
import conservative as cv
from conservative.references.exact.method import free_body
cv.integrate(cv.scenes.brick_flip(), dt=0.01, t_end=0.1).to_pandas()
"""
COMMAND = """
sys.argv[0] = "conservative"
from conservative.reports.cli.launch import launch
launch()
"""


def test_a_lean_environment_integrates():
    code, _, error = run_python(REFUSE + LEAN_RUN, others())
    assert code == 0, error


@pytest.mark.parametrize(
    ("program", "messages"),
    [
        pytest.param("import pandas", ["No module named 'pandas'"], marks=pytest.mark.slow),
        (LOOK + SHOWN, ["Trajectory.to_pandas needs pandas", "pip install 'conservative-rotation[report]'"]),
    ],
    ids=["import", "table"],
)
def test_a_lean_environment_lacks_pandas_and_names_its_extra(program, messages):
    code, _, error = run_python(REFUSE + program, others())
    assert code == 1
    assert all(message in error.splitlines()[-1] for message in messages)


COMMANDS = [
    ("report --quick", "altair", "report"),
    ("recommend brick_flip", "vl_convert", "report"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("arguments", "without", "extra"), COMMANDS, ids=[row[0] or "conservative" for row in COMMANDS])
def test_a_command_without_its_extra_names_it_in_one_line(arguments, without, extra):
    code, out, error = run_python(REFUSE + LOOK + COMMAND, without, *arguments.split())
    assert (code, out) == (2, "")
    assert len(error.splitlines()) == 1
    what = " ".join(["conservative", *arguments.split()[:1]])
    assert f"{what} needs {without}" in error
    assert f"pip install 'conservative-rotation[{extra}]'" in error


@pytest.mark.parametrize(("faster", "without", "expected"), [(1.0, ",numba,llvmlite", 0), (1.001, "", 1)])
def test_a_file_is_verified_in_a_lean_environment(faster, without, expected, tmp_path):
    """A right file without a load needs no kernels; the search for a mistake does."""
    t = np.linspace(0, 2, 101)
    R, w = free_body(BODY, np.eye(3), [0.2, 2.0, 0.3], faster * t)  # attitudes turn by 1.001 times the rates
    header = ",".join(["t", *(f"R_{i}{j}" for i in "123" for j in "123"), *(f"w_{i} (rad/s)" for i in "xyz")])
    run, body, folder = tmp_path / "run.csv", tmp_path / "body.toml", tmp_path / "found"
    np.savetxt(run, np.column_stack([t, R.reshape(-1, 9), w]), delimiter=",", header=header, comments="", fmt="%.17g")
    body.write_text("t_end = 2\n[body]\ninertia = [2e-3, 6e-3, 7e-3]\n[start]\nw_WB_B = [0.2, 2.0, 0.3]\n")
    arguments = ["verify", str(run), "--body", str(body), "--out", str(folder)]
    code, _, error = run_python(REFUSE + LOOK + COMMAND, others() + without, *arguments)
    assert code == expected, error
    assert sorted(path.name for path in folder.iterdir()) == ["errors.csv", "verify.csv", "verify.json", "verify.md"]


@pytest.mark.slow
def test_the_gate_needs_no_table_library():
    gate = "import conservative.benchmarks.suite.test_speed, conservative.reports.cli.gate, conservative.reports.cli.main"
    code, _, error = run_python(REFUSE + gate, "pandas,altair,vl_convert,jinja2,rich,mujoco,pinocchio")
    assert code == 0, error


@pytest.mark.slow
def test_a_program_that_cannot_be_run_without_an_extra_is_not_wrong():
    program = Path(__file__).parent / "references" / "programs" / "engine.py"
    arguments = ["verify", f"{sys.executable} {program}", "--only", "protocol"]
    code, out, error = run_python(REFUSE + LOOK + COMMAND, "platformdirs", *arguments)
    assert (code, out) == (2, ""), error
    assert "pip install 'conservative-rotation[environments]'" in error
