"""Versions of a project out of a git ref, a folder or a wheel, and two commits of one that the command compares."""

import json
import os
import subprocess

import pytest
from click.testing import CliRunner

from conservative.benchmarks.versions import version
from conservative.benchmarks.versions.version import install_version
from conservative.errors import BadInput
from conservative.references.environments import projects
from conservative.references.environments.environment import Environment
from conservative.references.environments.folders import folder_of_projects
from conservative.references.environments.kind import Source
from conservative.reports.cli.main import main

from ...environments import PATIENCE, ROOT
from ...environments import Environment as WheelEnvironment
from ...pages import shell_lines
from ...references.local_wheels import write_numpy, write_wheel

pytestmark = pytest.mark.slow

PROJECT = """[build-system]
requires = []
build-backend = "backend"
backend-path = ["."]
[project]
name = "{name}"
version = "1.0"
"""
BACKEND = '''"""Builds a wheel of the module next to it."""
import pathlib, zipfile

NAME, MODULE, ENTRY = "{name}", "{module}", "{entry}"
INFO = f"{{NAME}}-1.0.dist-info"


def build_wheel(folder, settings=None, metadata=None):
    files = {{
        f"{{MODULE}}.py": pathlib.Path(f"{{MODULE}}.py").read_text(),
        f"{{INFO}}/METADATA": f"Metadata-Version: 2.1\\nName: {{NAME}}\\nVersion: 1.0\\n",
        f"{{INFO}}/WHEEL": "Wheel-Version: 1.0\\nGenerator: tests\\nRoot-Is-Purelib: true\\nTag: py3-none-any\\n",
        f"{{INFO}}/entry_points.txt": ENTRY,
    }}
    files[f"{{INFO}}/RECORD"] = "".join(f"{{name}},,\\n" for name in [*files, f"{{INFO}}/RECORD"])
    wheel = f"{{NAME}}-1.0-py3-none-any.whl"
    with zipfile.ZipFile(pathlib.Path(folder) / wheel, "w") as archive:
        for name, text in files.items():
            archive.writestr(zipfile.ZipInfo(name), text)
    return wheel
'''


def write_project(folder, name, module, code, entry=""):
    """Write a project of one module."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "pyproject.toml").write_text(PROJECT.format(name=name))
    (folder / "backend.py").write_text(BACKEND.format(name=name.replace("-", "_"), module=module, entry=entry))
    (folder / f"{module}.py").write_text(code)


def commit(folder, message="change"):
    """Commit all files of a folder, in a new repository if there is none; return the commit."""
    if not (folder / ".git").exists():
        git(folder, "init", "--quiet", "--initial-branch=main")
    git(folder, "add", "--all")
    git(folder, "commit", "--quiet", "--message", message)
    return git(folder, "rev-parse", "HEAD")


def git(folder, *arguments):
    who = {f"GIT_{role}_{what}": "somebody@example.org" for role in ("AUTHOR", "COMMITTER") for what in ("NAME", "EMAIL")}
    kept = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    command = ["git", "-C", str(folder), *arguments]
    return subprocess.run(command, env=kept | who, check=True, capture_output=True, text=True, timeout=PATIENCE).stdout.strip()


NAME, MODULE = "made-up-integrator", "conservative"
"""The module has the name of the package that environments of projects must have."""


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheels")
    write_numpy(folder)
    return Source(folder)


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def project(tmp_path):
    """A project with two commits, the first of which has a name."""
    folder = tmp_path / "project"
    write_project(folder, NAME, MODULE, "VALUE = 1\n")
    commit(folder)
    git(folder, "tag", "first")
    (folder / f"{MODULE}.py").write_text("VALUE = 2\n")
    commit(folder)
    return folder


def value_of(version):
    (site,) = version.environment.folder.glob("lib/python*/site-packages")
    return (site / f"{MODULE}.py").read_text()


def test_a_ref_is_the_committed_version(project, source):
    (project / f"{MODULE}.py").write_text("VALUE = 3\n")
    first, second, now = (install_version(name, project, source) for name in ("first", "HEAD", str(project)))
    assert [value_of(each) for each in (first, second, now)] == ["VALUE = 1\n", "VALUE = 2\n", "VALUE = 3\n"]
    assert first.commit == git(project, "rev-parse", "first")
    assert first.title == f"first ({first.commit[:9]})"
    assert (now.name, now.commit) == ("project", f"{second.commit}+changes")
    assert now.packages == ("made_up_integrator-1.0-py3-none-any.whl", *now.environment.packages[1:])


def test_an_environment_is_made_once_for_a_commit(project, source, monkeypatch):
    first = install_version("first", project, source)
    monkeypatch.setattr(projects, "build_wheel", None)
    monkeypatch.setattr(projects, "make", None)
    assert install_version(first.commit, project, source).environment == first.environment
    assert first.environment.folder.name == first.commit


def test_a_folder_that_did_not_change_keeps_its_environment(project, source):
    first, second = (install_version(str(project), project, source) for _ in range(2))
    assert first.environment == second.environment
    (project / f"{MODULE}.py").write_text("VALUE = 4\n")
    assert install_version(str(project), project, source).environment != first.environment


def test_an_environment_has_the_additional_requirements(project, source, tmp_path):
    write_wheel(source.find_links, "1.0")
    plain, more = (install_version("first", project, source, wanted) for wanted in ((), ("trial",)))
    assert set(more.packages) - set(plain.packages) == {"trial==1.0"}


def test_a_project_below_the_top_of_its_repository(tmp_path, source):
    write_project(tmp_path / "top" / "part", NAME, MODULE, "VALUE = 5\n")
    commit(tmp_path / "top")
    assert value_of(install_version("HEAD", tmp_path / "top" / "part", source)) == "VALUE = 5\n"
    with pytest.raises(BadInput, match="expected a git ref, a wheel, or a folder with pyproject"):
        install_version("HEAD", tmp_path / "top", source)


def test_a_wheel(project, source, tmp_path):
    environment = install_version("first", project, source).environment
    (wheel,) = (folder_of_projects() / "wheels" / environment.version).glob("*.whl")
    version = install_version(str(wheel), tmp_path, source)
    assert (version.title, value_of(version)) == (wheel.name, "VALUE = 1\n")


def test_the_oldest_environments_go(project, source, monkeypatch):
    monkeypatch.setattr(projects, "KEPT", 2)
    for value in range(3):
        (project / f"{MODULE}.py").write_text(f"VALUE = {value}\n")
        last = install_version(str(project), project, source)
    kept = sorted(path.name for path in last.environment.folder.parent.iterdir())
    assert len(kept) == 2
    assert last.environment.folder.name in kept


@pytest.mark.parametrize("name", ["nowhere", "-x", "HEAD~9", "", "first:pyproject.toml"])
def test_invalid_versions_are_refused(project, source, name):
    with pytest.raises(BadInput, match=r"against: got .*expected a git ref of the project's repository, a wheel, or a folder"):
        install_version(name, project, source)


def test_a_version_without_us_is_refused(tmp_path, source):
    write_project(tmp_path / "other", "other", "other_module", "VALUE = 1\n")
    with pytest.raises(BadInput, match=r"against: got other-1.0.*without conservative-rotation; expected a version that"):
        install_version(str(tmp_path / "other"), tmp_path, source)


def test_a_project_that_does_not_require_us_gets_the_running_version(tmp_path, source, monkeypatch):
    write_wheel(tmp_path, "7.0", name="conservative")
    wheel = tmp_path / "conservative-7.0-py3-none-any.whl"
    monkeypatch.setattr(projects, "PACKAGE", "conservative")
    monkeypatch.setattr(projects, "_running_version", lambda source: f"conservative @ {wheel.as_uri()}")
    write_project(tmp_path / "other", "other", "other_module", "VALUE = 1\n")
    first = install_version(str(tmp_path / "other"), tmp_path, source)
    assert "conservative" in str(first.packages)
    monkeypatch.setattr(projects, "make", None)  # the second comparison uses the same environment
    assert install_version(str(tmp_path / "other"), tmp_path, source).environment == first.environment


def test_a_wheel_with_another_name_is_refused(tmp_path, source):
    (tmp_path / "wheel.whl").write_bytes(b"")
    with pytest.raises(BadInput, match="expected a wheel with its original file name"):
        install_version(str(tmp_path / "wheel.whl"), tmp_path, source)


EXAMPLE = ROOT / "tests" / "example_package" / "example_integrator.py"
ENTRY = "[conservative.methods]\\nexample = example_integrator:Example\\n"
STEP = "middle = w + h / 2 * inverse @ (hat(J @ w) @ w)"
OPTIONS = ("--scenes", "brick_flip:t_end=1", "--methods", "example", "--processes", "3")


@pytest.fixture(scope="module")
def example(tmp_path_factory):
    """The project at its first commit."""
    folder = tmp_path_factory.mktemp("project")
    write_project(folder, "example-integrator", "example_integrator", EXAMPLE.read_text(), ENTRY)
    commit(folder)
    return folder


@pytest.fixture(scope="module")
def install(wheel, tmp_path_factory):
    """Return a function that makes an environment of a wheel from the packages installed here and a wheel of this package."""
    home, made = tmp_path_factory.mktemp("environments"), {}

    def environment_of(wheel_of_project, requirements, source):
        key = wheel_of_project.parent.name
        if key not in made:
            made[key] = WheelEnvironment.create(home / key, wheel, wheel_of_project)
        return Environment("example-integrator", key, made[key].folder, "3", ())

    return environment_of


@pytest.fixture
def gate(example, install, tmp_path, monkeypatch):
    """Return exit code and answer of the command, for the example with its module changed."""
    monkeypatch.setattr(version, "environment_of", install)

    def run(before, after):
        text = EXAMPLE.read_text()
        assert before in text
        (example / "example_integrator.py").write_text(text.replace(before, after))
        done = CliRunner().invoke(main, ["gate", "--against", "HEAD", "--project", str(example), *OPTIONS, "--json"])
        assert done.exit_code in (0, 1), done.output
        return done.exit_code, json.loads(done.stdout)

    return run


def test_the_command_of_readme_passes_in_a_project_without_changes(example, install, monkeypatch):
    monkeypatch.setattr(version, "environment_of", install)
    monkeypatch.chdir(example)
    git(example, "checkout", "--quiet", "--", ".")
    (words,) = (words for words in shell_lines((ROOT / "README.md").read_text(encoding="utf-8")) if "gate" in words)
    done = CliRunner().invoke(main, [*words[1:], *OPTIONS])
    assert done.exit_code == 0, done.output


def measures(answer):
    return {each["measure"] for each in answer["violations"]}


def test_a_change_of_a_comment_passes(gate):
    code, answer = gate("for free bodies only.", "for free bodies alone.")
    assert (code, answer["violations"]) == (0, [])
    (row,) = answer["rows"]
    assert row["is"]["values"] == row["was"]["values"]
    assert row["is"]["values"]["observed order"] == pytest.approx(2, abs=0.1)
    assert row["time"]["first"]["processes"] >= 3


def test_a_step_of_another_order_fails(gate):
    code, answer = gate(STEP, "middle = w")
    assert code == 1
    assert {"attitude error max", "energy drift max", "observed order"} <= measures(answer)


def test_a_slower_step_fails(gate):
    # About twice the work: three processes of each are enough for that on a busy machine.
    code, answer = gate(STEP, f"{STEP}\n                for _ in range(12):\n                    hat(w)")
    assert (code, measures(answer)) == (1, {"time of a step"})
    assert answer["rows"][0]["time"]["again"]["low"] > 1.05


def test_a_step_that_raises_fails(gate):
    code, answer = gate(STEP, "raise ZeroDivisionError('no step')")
    assert (code, measures(answer)) == (1, {"row"})
    assert any("ZeroDivisionError: no step" in note for note in answer["notes"])
