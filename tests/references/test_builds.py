"""Environments of builds that are no release, and of several releases at once."""

import zipfile

import pytest

import conservative as cv
from conservative import registry
from conservative.references.environments import environment, install
from conservative.references.environments.builds import install_build, install_releases, newest_releases
from conservative.references.environments.lock import Source

from .local_wheels import write_numpy, write_wheel

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def cache(no_environments):
    return no_environments


def build(wheels, folder, version="1.10", code="VALUE = 2\n"):
    write_wheel(folder, version, code=code)
    return install_build("trial", folder / f"trial-{version}-py3-none-any.whl", Source(wheels))


def test_a_build_has_a_version_of_its_own_and_integrates(wheels, tmp_path):
    found = build(wheels, tmp_path)
    assert (found.new, found.trouble) == (True, "")
    version = found.environment.version
    assert version.startswith("1.10+build.")
    assert found.environment.is_build
    assert not install_build("trial", tmp_path / "trial-1.10-py3-none-any.whl", Source(wheels)).new
    method = registry.method(f"trial@{version}")
    assert method.label == f"trial=={version}/integrate"
    assert cv.integrate(cv.scenes.brick_flip(t_end=0.1), 0.01, method=method).ok


def test_another_build_of_the_same_version_is_another_environment(wheels, tmp_path):
    first, second = build(wheels, tmp_path), build(wheels, tmp_path, code="VALUE = 3\n")
    assert second.new
    assert first.environment.version != second.environment.version


def test_a_version_with_a_local_part_keeps_it(wheels, tmp_path):
    assert build(wheels, tmp_path, "2.0+g12").environment.version.startswith("2.0+g12.build.")


def test_no_build_is_taken_for_the_newest_release(wheels, tmp_path):
    install.install("trial==1.0", Source(wheels))
    build(wheels, tmp_path, "9.0")
    assert environment.find_environment("trial").version == "1.0"


@pytest.mark.parametrize("name", ["other-1.0-py3-none-any.whl", "trial.whl", "trial-1.0.whl"])
def test_a_file_that_is_no_wheel_of_the_engine_is_refused(name, tmp_path):
    with zipfile.ZipFile(tmp_path / name, "w"):
        pass
    with pytest.raises(cv.BadInput, match=r"against: got .*allowed: a wheel of trial"):
        install_build("trial", tmp_path / name, Source())


def test_what_is_neither_wheel_nor_sources_is_refused(tmp_path):
    for path in (tmp_path, tmp_path / "nothing.whl"):
        with pytest.raises(cv.BadInput, match="allowed: a wheel, or a folder with"):
            install_build("trial", path, Source())


def test_a_wheel_for_another_python_is_refused(cache, tmp_path):
    write_wheel(tmp_path, "2.0", "cp27-cp27m-any")
    write_numpy(tmp_path)
    with pytest.raises(cv.BadInput, match=r"no wheel|uv can install"):
        install_build("trial", tmp_path / "trial-2.0-cp27-cp27m-any.whl", Source(tmp_path))
    assert environment.list_environments() == ()


def test_sources_are_built_only_where_that_is_allowed(tmp_path):
    marker = tmp_path / "it_ran"
    (tmp_path / "setup.py").write_text(f"open({str(marker)!r}, 'w')\n")
    with pytest.raises(cv.BadInput, match="has to be built; allowed: a wheel, or --allow-build"):
        install_build("trial", tmp_path, Source())
    assert not marker.exists()


BACKEND = """import shutil, pathlib
def build_wheel(folder, settings=None, metadata=None):
    name = "trial-3.0-py3-none-any.whl"
    shutil.copy({source!r}, pathlib.Path(folder) / name)
    return name
"""
PROJECT = """[build-system]
requires = []
build-backend = "backend"
backend-path = ["."]
[project]
name = "trial"
version = "3.0"
"""


def test_sources_are_built_where_that_is_allowed(wheels, tmp_path):
    write_wheel(tmp_path, "3.0")
    project = tmp_path / "project"
    project.mkdir()
    (project / "pyproject.toml").write_text(PROJECT)
    (project / "backend.py").write_text(BACKEND.format(source=str(tmp_path / "trial-3.0-py3-none-any.whl")))
    found = install_build("trial", project, Source(wheels, allow_build=True))
    assert found.environment.version.startswith("3.0+build.")
    assert found.trouble == ""


def test_sources_that_do_not_build_are_refused(wheels, tmp_path):
    (tmp_path / "pyproject.toml").write_text(PROJECT)
    (tmp_path / "backend.py").write_text("def build_wheel(*_):\n    raise SystemExit('no compiler')\n")
    with pytest.raises(cv.BadInput, match="a folder that uv can build"):
        install_build("trial", tmp_path, Source(wheels, allow_build=True))


def test_the_newest_releases_are_those_of_the_index_oldest_first(wheels):
    assert newest_releases("trial", 2, Source(wheels)) == ("1.9", "1.10")
    assert newest_releases("trial", 9, Source(wheels)) == ("1.0", "1.9", "1.10")


def test_releases_that_nobody_can_list_are_said(tmp_path):
    with pytest.raises(cv.BadInput, match=r"no list of versions of trial .*allowed: a network, --find-links FOLDER"):
        newest_releases("trial", 2, Source(tmp_path))


def test_releases_are_installed_once_and_told_before(wheels):
    told = []
    for _ in range(2):
        found = install_releases("trial", ("1.9", "1.0"), Source(wheels), told.append)
        assert [each.version for each in found] == ["1.9", "1.0"]
    assert told == ["installing trial==1.9", "installing trial==1.0"]
    with pytest.raises(cv.BadInput, match="NAME or NAME==VERSION"):
        install_releases("trial", ("1.10", "; true"), Source(wheels), told.append)
    assert len(told) == 2
