"""A version of a project out of a git ref, a folder or a wheel, and the environment that is kept of it."""

import pytest

from conservative.benchmarks.comparison.version import install_version
from conservative.errors import BadInput
from conservative.references.environments import projects as environments
from conservative.references.environments.environment import folder_of_projects
from conservative.references.environments.lock import Source

from ...references.local_wheels import write_numpy, write_wheel
from .projects import commit, git, write_project

pytestmark = pytest.mark.slow

NAME, MODULE = "made-up-integrator", "conservative"
"""Its module is called as the package that environments of projects have to have."""


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


def test_a_ref_is_what_was_committed(project, source):
    (project / f"{MODULE}.py").write_text("VALUE = 3\n")
    first, second, now = (install_version(name, project, source) for name in ("first", "HEAD", str(project)))
    assert [value_of(each) for each in (first, second, now)] == ["VALUE = 1\n", "VALUE = 2\n", "VALUE = 3\n"]
    assert first.commit == git(project, "rev-parse", "first")
    assert first.title == f"first ({first.commit[:9]})"
    assert (now.name, now.commit) == ("project", f"{second.commit}+changes")
    assert now.packages == ("made_up_integrator-1.0-py3-none-any.whl", *now.environment.packages[1:])


def test_an_environment_is_made_once_for_a_commit(project, source, monkeypatch):
    first = install_version("first", project, source)
    monkeypatch.setattr(environments, "build_wheel", None)
    monkeypatch.setattr(environments, "make", None)
    assert install_version(first.commit, project, source).environment == first.environment
    assert first.environment.folder.name == first.commit


def test_a_folder_that_did_not_change_keeps_its_environment(project, source):
    first, second = (install_version(str(project), project, source) for _ in range(2))
    assert first.environment == second.environment
    (project / f"{MODULE}.py").write_text("VALUE = 4\n")
    assert install_version(str(project), project, source).environment != first.environment


def test_what_an_environment_has_changes_with_what_is_asked_for(project, source, tmp_path):
    write_wheel(source.find_links, "1.0")
    plain, more = (install_version("first", project, source, wanted) for wanted in ((), ("trial",)))
    assert set(more.packages) - set(plain.packages) == {"trial==1.0"}


def test_a_project_below_the_top_of_its_repository(tmp_path, source):
    write_project(tmp_path / "top" / "part", NAME, MODULE, "VALUE = 5\n")
    commit(tmp_path / "top")
    assert value_of(install_version("HEAD", tmp_path / "top" / "part", source)) == "VALUE = 5\n"
    with pytest.raises(BadInput, match="allowed: a git ref, a wheel, or a folder with pyproject"):
        install_version("HEAD", tmp_path / "top", source)


def test_a_wheel(project, source, tmp_path):
    environment = install_version("first", project, source).environment
    (wheel,) = (folder_of_projects() / "wheels" / environment.version).glob("*.whl")
    version = install_version(str(wheel), tmp_path, source)
    assert (version.title, value_of(version)) == (wheel.name, "VALUE = 1\n")


def test_the_oldest_environments_go(project, source, monkeypatch):
    monkeypatch.setattr(environments, "KEPT", 2)
    for value in range(3):
        (project / f"{MODULE}.py").write_text(f"VALUE = {value}\n")
        last = install_version(str(project), project, source)
    kept = sorted(path.name for path in last.environment.folder.parent.iterdir())
    assert len(kept) == 2
    assert last.environment.folder.name in kept


@pytest.mark.parametrize("name", ["nowhere", "-x", "HEAD~9", "", "first:pyproject.toml"])
def test_what_is_no_version_is_refused(project, source, name):
    with pytest.raises(BadInput, match=r"against: got .*allowed: a git ref of the project's repository, a wheel, or a folder"):
        install_version(name, project, source)


def test_a_version_without_us_is_refused(tmp_path, source):
    write_project(tmp_path / "other", "other", "other_module", "VALUE = 1\n")
    with pytest.raises(BadInput, match=r"against: got .*No module named 'conservative'.*allowed: a version that needs conserv"):
        install_version(str(tmp_path / "other"), tmp_path, source)


def test_a_wheel_with_another_name_is_refused(tmp_path, source):
    (tmp_path / "wheel.whl").write_bytes(b"")
    with pytest.raises(BadInput, match="allowed: the name that a wheel has"):
        install_version(str(tmp_path / "wheel.whl"), tmp_path, source)
