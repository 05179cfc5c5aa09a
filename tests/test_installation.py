"""What is installed: one package, each of its modules once and under one name, and as little beside it as it needs."""

import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from email import message_from_string
from importlib.metadata import packages_distributions
from pathlib import Path, PurePosixPath

import pytest

from conservative.errors import EXTRAS

from .environments import ROOT, variables

ROOMS = ("references", "benchmarks", "reports")
LEAN = {"numpy", "scipy", "numba", "mpmath"}
IMPORTED_AS = {"pin": "pinocchio", "vl-convert-python": "vl_convert", "pytest-benchmark": "pytest_benchmark"}
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
"""For code that only looks whether a package is there."""


def modules():
    """The files of the package in this checkout, by their paths below its root."""
    links = [ROOT / "conservative", *(ROOT / "conservative" / room for room in ROOMS)]
    return sorted(str(file.relative_to(ROOT)) for link in links for file in link.rglob("*.py") if link == nearest(file, links))


def nearest(file, links):
    return max((link for link in links if file.is_relative_to(link)), key=lambda link: len(link.parts))


def test_a_wheel_out_of_the_sdist_has_every_module_once_below_conservative(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert len(names) == len(set(names))
    assert {PurePosixPath(name).parts[0].partition("-")[0] for name in names} == {"conservative", "conservative_rotation"}
    assert sorted(name for name in names if name.endswith(".py")) == modules()
    assert "conservative/py.typed" in names


def test_the_sdist_has_no_doubles(sdist):
    with tarfile.open(sdist) as archive:
        members = archive.getmembers()
    assert not [member.name for member in members if member.issym() or member.islnk()]
    names = [str(PurePosixPath(member.name).relative_to(PurePosixPath(member.name).parts[0])) for member in members]
    assert len(names) == len(set(names))
    assert sorted(name for name in names if name.startswith("conservative/") and name.endswith(".py")) == modules()
    assert not [name for name in names if PurePosixPath(name).parts[0] in ROOMS]


@pytest.fixture(scope="module")
def requirements(wheel):
    """The names of what the wheel requires, by extra; without one under ""."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = [name for name in archive.namelist() if name.endswith("METADATA")]
        lines = message_from_string(archive.read(name).decode()).get_all("Requires-Dist")
    found = {}
    for line in lines:
        package, extra = re.match(r"([\w-]+)", line)[1], re.search(r"extra == '(\w+)'", line)
        found.setdefault(extra[1] if extra else "", set()).add(package.lower())
    return found


def test_four_packages_are_required_and_no_more(requirements):
    assert requirements[""] == LEAN
    assert set(requirements) == {"", "engines", "report", "gate", "all", "dev"}


@pytest.mark.parametrize("extra", EXTRAS)
def test_what_an_extra_is_checked_for_is_what_it_brings(requirements, extra):
    assert set(EXTRAS[extra]) == {IMPORTED_AS.get(package, package) for package in requirements[extra]}


def test_the_commands_in_the_readme_name_extras_that_exist():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    texts = [(ROOT / name).read_text() for name in ("README.md", ".github/CONTRIBUTING.md", ".ci/run")]
    named = {extra for text in texts for extra in re.findall(r"(?:-e '\.|conservative-rotation)\[(\w+)\]", text)}
    assert named
    assert named <= set(extras)


def python(code, *arguments, **changed):
    """Run code in a fresh interpreter, with this checkout in front; return its exit code, output and errors."""
    command = [sys.executable, "-c", code, *arguments]
    environment = variables(**{"PYTHONPATH": str(ROOT), **changed})
    done = subprocess.run(command, env=environment, cwd="/", capture_output=True, text=True, timeout=300, check=False)
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_has_one_name(room):
    code, _, error = python(f"import {room}")
    assert code == 1
    assert error.splitlines()[-1] == f"ImportError: {room}: got another name than its own; allowed: import conservative.{room}"
    code, out, error = python(f"import conservative.{room}; print(conservative.{room}.__name__)")
    assert (code, out.strip()) == (0, f"conservative.{room}"), error


@pytest.mark.parametrize("room", ROOMS)
def test_the_package_of_another_project_comes_first(room, tmp_path):
    (tmp_path / room).mkdir()
    (tmp_path / room / "__init__.py").write_text("OWNER = 'another project'\n")
    code, out, error = python(f"import {room}; print({room}.OWNER)", PYTHONPATH=f"{tmp_path}:{ROOT}")
    assert (code, out.strip()) == (0, "another project"), error


EVERYTHING = """
import importlib, pkgutil, sys
from pathlib import Path
import conservative
for found in pkgutil.walk_packages(conservative.__path__, "conservative."):
    importlib.import_module(found.name)
"""
DOUBLES = """
names = {}
for name, module in sys.modules.items():
    file = getattr(module, "__file__", None)
    if file and Path(file).resolve().is_relative_to(sys.argv[1]):
        names.setdefault(Path(file).resolve(), set()).add(name)
assert names, "nothing of ours was imported"
print(*(sorted(each) for each in names.values() if len(each) > 1))
"""


TWICE = """
import importlib.util, sys
from pathlib import Path
import conservative.version
spec = importlib.util.spec_from_file_location("other", conservative.version.__file__)
sys.modules["other"] = importlib.util.module_from_spec(spec)
"""


def test_no_module_is_imported_under_two_names():
    code, out, error = python(EVERYTHING + DOUBLES, str(ROOT))
    assert (code, out.strip()) == (0, ""), error


def test_a_module_under_two_names_would_be_seen():
    twice = "import importlib.util as u\nspec = u.spec_from_file_location('other', conservative.version.__file__)\n"
    twice += "sys.modules['other'] = u.module_from_spec(spec)\n"
    code, out, error = python(
        "import sys\nfrom pathlib import Path\nimport conservative.version\n" + twice + DOUBLES, str(ROOT)
    )
    assert (code, out.strip()) == (0, "['conservative.version', 'other']"), error


PATHS = ["benchmarks/suite/test_speed.py", "benchmarks"]


@pytest.mark.parametrize("path", PATHS)
def test_the_suite_has_one_name_whatever_its_path_is(path):
    command = [sys.executable, "-m", "pytest", "--benchmark", "--collect-only", "-q", "-k", "ratios", path]
    done = subprocess.run(
        command, cwd=ROOT, env=variables(PYTHONPATH=str(ROOT)), capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "benchmarks/suite/test_speed.py::test_step_ratios" in done.stdout
    assert "1/" in done.stdout.splitlines()[-1]


def others():
    """Packages of this environment that a lean one does not have, under the names they are imported by."""
    lean = {*LEAN, "llvmlite", "conservative-rotation"}
    return ",".join(
        name for name, packages in packages_distributions().items() if not lean & {each.lower() for each in packages}
    )


LEAN_RUN = """
import conservative as cv
assert cv.integrate(cv.scenes.brick_flip(), dt=0.01).outcome.ok
from conservative import registry
registry.method("exact"), registry.method("scipy")
"""
SHOWN = """
import conservative as cv
cv.integrate(cv.scenes.brick_flip(), dt=0.01, t_end=0.1).to_pandas()
"""
COMMAND = """
sys.argv[0] = "conservative"
from conservative.reports.cli.launch import launch
launch()
"""


def test_a_lean_environment_integrates():
    code, _, error = python(REFUSE + LEAN_RUN, others())
    assert code == 0, error


def test_what_a_lean_environment_lacks_is_refused():
    code, _, error = python(REFUSE + "import pandas", others())
    assert code == 1
    assert "No module named 'pandas'" in error


def test_a_table_names_its_extra():
    code, _, error = python(REFUSE + LOOK + SHOWN, others())
    assert code == 1
    assert "Trajectory.to_pandas: got an environment without pandas" in error.splitlines()[-1]
    assert "pip install 'conservative-rotation[report]'" in error.splitlines()[-1]


COMMANDS = [
    ("", "click", "report"),
    ("list", "rich", "report"),
    ("run brick_flip", "rich", "report"),
    ("report --quick", "altair", "report"),
    ("recommend brick_flip", "vl_convert", "report"),
]


@pytest.mark.parametrize(("arguments", "without", "extra"), COMMANDS, ids=[row[0] or "conservative" for row in COMMANDS])
def test_a_command_without_its_extra_names_it_in_one_line(arguments, without, extra):
    code, out, error = python(REFUSE + LOOK + COMMAND, without, *arguments.split())
    assert (code, out) == (2, "")
    assert len(error.splitlines()) == 1
    what = " ".join(["conservative", *arguments.split()[:1]])
    assert f"{what}: got an environment without {without}" in error
    assert f"pip install 'conservative-rotation[{extra}]'" in error


def test_the_gate_needs_no_table_library():
    gate = "import conservative.benchmarks.suite.test_speed, conservative.reports.cli.gate, conservative.reports.cli.main"
    code, _, error = python(REFUSE + gate, "pandas,altair,vl_convert,jinja2,rich,mujoco,pinocchio")
    assert code == 0, error


def test_the_citation_is_of_this_version():
    from conservative.version import VERSION

    assert f"\nversion: {VERSION}\n" in (ROOT / "CITATION.cff").read_text()


def test_nothing_else_lies_at_the_top():
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, timeout=60, check=False).stdout
    if not tracked:
        pytest.skip("not a git checkout")
    top = {Path(line).parts[0] for line in tracked.splitlines() if not line.startswith(".")}
    files = {"pyproject.toml", "README.md", "LICENSE", "CHANGELOG.md", "CITATION.cff"}
    assert top <= files | {"conservative", "tests", *ROOMS}
