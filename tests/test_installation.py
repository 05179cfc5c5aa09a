"""The installed package has each module once under one name, and requires few others."""

import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from email import message_from_string
from pathlib import PurePosixPath

import pytest
from trove_classifiers import classifiers

from conservative.errors import EXTRAS
from conservative.version import VERSION

from .environments import LEAN, PATIENCE, ROOT, run_python, variables

PACKAGES = ("references", "benchmarks", "reports")
IMPORTED_AS = {
    "pin": "pinocchio",
    "vl-convert-python": "vl_convert",
    "pytest-benchmark": "pytest_benchmark",
    "usd-core": "pxr",
    "pillow": "PIL",
    "myst-nb": "myst_nb",
    "sphinx-click": "sphinx_click",
}


def modules():
    """Return the files of the package in this checkout, by their paths below its root."""
    links = [ROOT / "conservative", *(ROOT / "conservative" / room for room in PACKAGES)]
    return sorted({str(file.relative_to(ROOT)) for link in links for file in link.rglob("*.py")})


@pytest.mark.slow
def test_a_wheel_out_of_the_sdist_has_every_module_once_below_conservative(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert len(names) == len(set(names))
    assert {PurePosixPath(name).parts[0].partition("-")[0] for name in names} == {"conservative", "conservative_rotation"}
    assert sorted(name for name in names if name.endswith(".py")) == modules()
    assert {"conservative/py.typed", "conservative/reference.md"} <= set(names)
    assert not [name for name in names if name.endswith(".gif")]


@pytest.mark.slow
def test_the_sdist_has_no_doubles(sdist):
    with tarfile.open(sdist) as archive:
        members = archive.getmembers()
    assert not [member.name for member in members if member.issym() or member.islnk()]
    names = [str(PurePosixPath(member.name).relative_to(PurePosixPath(member.name).parts[0])) for member in members]
    assert len(names) == len(set(names))
    assert sorted(name for name in names if name.startswith("conservative/") and name.endswith(".py")) == modules()
    assert not [name for name in names if PurePosixPath(name).parts[0] in PACKAGES]


@pytest.fixture(scope="module")
def requirements(wheel):
    """Return the names of the required packages by extra; those without an extra have the key ""."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = [name for name in archive.namelist() if name.endswith("METADATA")]
        lines = message_from_string(archive.read(name).decode()).get_all("Requires-Dist")
    found = {}
    for line in lines:
        package, extra = re.match(r"([\w-]+)", line)[1], re.search(r"extra == '(\w+)'", line)
        found.setdefault(extra[1] if extra else "", set()).add(package.lower())
    return found


@pytest.mark.slow
def test_seven_packages_are_required_and_no_more(requirements):
    assert requirements[""] == LEAN
    assert set(requirements) == {"", "all", "dev", *EXTRAS}


@pytest.mark.slow
@pytest.mark.parametrize("extra", EXTRAS)
def test_an_extra_is_checked_for_its_own_packages(requirements, extra):
    assert set(EXTRAS[extra]) == {IMPORTED_AS.get(package, package) for package in requirements[extra]}


def check_schema(name, *paths):
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", f"vendor.{name}", *map(str, paths)]
    return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)


def test_citation_and_workflows_follow_their_schemas(tmp_path):
    for name, paths in {
        "citation-file-format": [ROOT / "CITATION.cff"],
        "github-workflows": [*(ROOT / ".github" / "workflows").glob("*.yml"), *(ROOT / "tests/example_package").glob("*.yml")],
        "github-actions": [*(ROOT / ".github" / "actions").glob("*/action.yml")],
    }.items():
        assert paths
        done = check_schema(name, *paths)
        assert done.returncode == 0, done.stdout
    broken = tmp_path / "CITATION.cff"
    broken.write_text((ROOT / "CITATION.cff").read_text().replace("title: ", "heading: "))
    assert check_schema("citation-file-format", broken).returncode == 1


def test_classifiers_exist():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert not set(project["classifiers"]) - {*classifiers}
    assert project["classifiers"] == sorted(project["classifiers"])


def test_the_commands_in_the_readme_name_extras_that_exist():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    texts = [(ROOT / name).read_text() for name in ("README.md", ".github/CONTRIBUTING.md", ".ci/run")]
    found = [names for text in texts for names in re.findall(r"(?:-e '\.|conservative-rotation)\[([\w,]+)\]", text)]
    assert "report,engines,environments" in found
    assert {name for names in found for name in names.split(",")} <= set(extras)


@pytest.mark.parametrize("room", PACKAGES)
def test_a_room_has_one_name(room):
    code, _, error = run_python(f"import {room}")
    assert code == 1
    assert error.splitlines()[-1] == f"ImportError: {room} is part of another package. Use: import conservative.{room}"
    code, out, error = run_python(f"import conservative.{room}; print(conservative.{room}.__name__)")
    assert (code, out.strip()) == (0, f"conservative.{room}"), error


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
    place = Path(file or sys.prefix).resolve()
    if place.is_relative_to(sys.argv[1]) and not place.is_relative_to(sys.prefix):  # an environment may be in the checkout
        names.setdefault(Path(file).resolve(), set()).add(name)
assert names, "nothing of ours was imported"
print(*(sorted(each) for each in names.values() if len(each) > 1))
"""


TWICE = """
import sys, importlib.util
from pathlib import Path
import conservative.version
spec = importlib.util.spec_from_file_location("other", conservative.version.__file__)
sys.modules["other"] = importlib.util.module_from_spec(spec)
"""


@pytest.mark.parametrize(
    ("program", "doubles"),
    [(EVERYTHING, ""), pytest.param(TWICE, "['conservative.version', 'other']", marks=pytest.mark.slow)],
)
def test_no_module_is_imported_under_two_names(program, doubles):
    code, out, error = run_python(program + DOUBLES, str(ROOT))
    assert (code, out.strip()) == (0, doubles), error


@pytest.mark.slow
@pytest.mark.parametrize("path", ["benchmarks/suite/test_speed.py", "benchmarks"])
def test_the_suite_has_one_name_for_any_path(path):
    command = [sys.executable, "-m", "pytest", "--benchmark", "--collect-only", "-q", "-k", "lagrange_top-lame", path]
    done = subprocess.run(
        command, cwd=ROOT, env=variables(PYTHONPATH=str(ROOT)), capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "benchmarks/suite/test_speed.py::test_speed[lagrange_top-lame-dt0.01]" in done.stdout
    assert "1/" in done.stdout.splitlines()[-1]


def test_the_citation_is_of_this_version():
    assert f"\nversion: {VERSION}\n" in (ROOT / "CITATION.cff").read_text()
