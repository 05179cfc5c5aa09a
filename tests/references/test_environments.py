"""Environments of releases and of builds are created completely or not at all, from local wheels without a network."""

import os
import re
import shutil
import signal
import subprocess
import sys
import tomllib
import zipfile

import pytest

import conservative as cv
from conservative import registry
from conservative.errors import MissingEngine
from conservative.references.environments import environment, folders, install, uv_command
from conservative.references.environments.install import install_build, install_releases, newest_releases
from conservative.references.environments.kind import Distribution, Source
from conservative.references.worker.client import close_workers

from ..environments import PATIENCE, ROOT, variables
from .local_wheels import write_numpy, write_sdist, write_wheel

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def cache(no_environments):
    return no_environments


def installed(wheels, name="trial"):
    return install.install(name, Source(wheels))


def everything(folder):
    """Return all files below a folder, without compiled Python files."""
    names = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file() or path.is_symlink()}
    return {name for name in names if "__pycache__" not in name}


def test_the_newest_version_is_installed_with_numpy_and_recorded(cache, wheels):
    done = installed(wheels)
    created = done.environment
    assert (created.engine, created.version, done.new, done.trouble) == ("trial", "1.10", True, "")
    assert [package.partition("==")[0] for package in created.packages] == ["numpy", "trial"]
    assert environment.list_environments() == (created,)
    lock = tomllib.loads((created.folder / "pylock.toml").read_text())
    (package,) = (each for each in lock["packages"] if each["name"] == "trial")
    assert (lock["lock-version"], package["version"], len(package["wheels"][0]["hashes"]["sha256"])) == ("1.0", "1.10", 64)
    stamp = (created.folder / environment.RECORD).stat().st_mtime_ns
    assert not installed(wheels).new
    assert (created.folder / environment.RECORD).stat().st_mtime_ns == stamp


def test_versions_are_installed_and_removed_independently(cache, wheels):
    for version in ("1.0", "1.10", "1.9"):
        installed(wheels, f"trial=={version}")
    assert [each.version for each in environment.list_environments("trial")] == ["1.0", "1.9", "1.10"]
    assert registry.method("trial").label == "trial==1.10/integrate"
    with pytest.raises(cv.BadInput, match=r"'trial@1\.9' \(nearest\)"):
        install.remove("trial==1.99")
    assert [each.version for each in install.remove("trial==1.10")] == ["1.10"]
    assert registry.method("trial").label == "trial==1.9/integrate"
    assert len(install.remove("trial")) == 2
    with pytest.raises(MissingEngine, match="conservative engines install trial"):
        registry.method("trial")
    with pytest.raises(cv.BadInput, match="none is installed"):
        install.remove("trial")


def test_all_files_are_in_the_cache_folder(cache, wheels, tmp_path):
    before = everything(tmp_path) | everything(wheels)
    installed(wheels)
    outside = everything(tmp_path) | everything(wheels)
    assert {name for name in outside - before if not name.startswith("cache/conservative-rotation/")} == set()


BAD = [
    "trial; rm -rf /",
    "trial==1.0 && true",
    "$(id)",
    "../trial",
    "",
    "trial==",
    "trial@",
    "trial@1.0@2.0",
    "trial==1.0==2.0",
    "trial=1",
    "-r",
    "trial==1.0;x",
    "a b",
    "trial>1",
]


@pytest.mark.parametrize("text", BAD)
def test_a_name_with_other_characters_is_refused(text):
    with pytest.raises(cv.BadInput, match=f"engine: got {re.escape(repr(text))}; expected"):
        install.check(text)


def test_an_unknown_engine_names_the_nearest(cache):
    with pytest.raises(cv.BadInput, match=r"'trail'; expected 'trial' \(nearest\)"):
        install.install("trail")


def test_an_unknown_version_names_those_that_exist(cache, wheels):
    with pytest.raises(cv.BadInput, match=r"'trial==1.9.5'; expected 1.9 \(nearest\), or one of 1.10, 1.9, 1.0"):
        installed(wheels, "trial==1.9.5")
    with pytest.raises(cv.BadInput, match=r"'trial==0.1'; expected 1.0 \(nearest\)"):
        installed(wheels, "trial==0.1")


def test_a_version_for_other_pythons_only_is_refused(cache, tmp_path):
    write_wheel(tmp_path, "2.0", "cp27-cp27m-any")
    write_numpy(tmp_path)
    with pytest.raises(cv.BadInput, match=r"'trial==2.0', which has no wheel for Python 3\.\d+.*--allow-build"):
        installed(tmp_path, "trial==2.0")


def test_no_code_of_a_package_runs_unless_allowed(cache, tmp_path):
    marker = tmp_path / "it_ran"
    write_sdist(tmp_path, marker)
    write_numpy(tmp_path)
    with pytest.raises(cv.BadInput, match="--allow-build"):
        installed(tmp_path, "trial==3.0")
    assert not marker.exists()


def test_a_missing_network_is_reported(cache, monkeypatch):
    monkeypatch.setenv("UV_DEFAULT_INDEX", "https://127.0.0.1:9/simple")
    monkeypatch.setenv("UV_HTTP_RETRIES", "0")
    with pytest.raises(
        cv.BadInput, match="no answer for 'trial' from the package index; expected a network, or --find-links FOLDER"
    ):
        install.install("trial")


def test_errors_of_uv_contain_no_password():
    failure = uv_command.UvFailed("error: Failed to fetch: https://me:secret@somewhere/simple/x/")
    assert "secret" not in str(failure)


def test_an_engine_that_cannot_be_imported_is_reported(tmp_path, monkeypatch):
    write_wheel(tmp_path, "4.0", code="import os\nos.abort()\n")
    write_numpy(tmp_path)
    monkeypatch.setattr(registry.engine("trial"), "data", Distribution("trial", "trial"))
    assert installed(tmp_path, "trial==4.0").trouble.startswith("crashed (signal 6 (SIGABRT)")


def test_force_rebuilds_from_the_lock(cache, wheels):
    before = installed(wheels, "trial==1.9").environment
    for module in before.folder.glob("lib/python*/site-packages/numpy*"):
        shutil.rmtree(module) if module.is_dir() else module.unlink()
    close_workers()  # the running one has imported the package
    assert installed(wheels, "trial==1.9").trouble
    lock = before.folder / before.kind.lock_file
    there = re.sub(r'\b(path|url) = "[^"]*/', 'url = "http://127.0.0.1:9/', lock.read_text())  # as from an index
    assert there != lock.read_text()
    lock.write_text(there)
    rebuilt = install.install("trial", Source(wheels), force=True)  # not 1.10, the newest in the folder of wheels
    assert (rebuilt.environment, rebuilt.new, rebuilt.trouble) == (before, True, "")
    assert cv.integrate(cv.scenes.brick_flip(t_end=0.1), 0.01, method=registry.method("trial")).ok
    assert [path.name for path in (cache / "trial").iterdir()] == ["1.9"]


def test_an_environment_without_a_lock_is_not_rebuilt(cache, wheels):
    before = installed(wheels).environment
    (before.folder / before.kind.lock_file).unlink()  # as of an environment that somebody made by hand
    with pytest.raises(cv.BadInput, match=r"without a lock; expected pylock.toml.* engines remove trial@1.10, then install it"):
        install.install("trial", Source(wheels), force=True)
    assert environment.list_environments() == (before,)


@pytest.mark.parametrize("step", ["_fill", "_replace"])
def test_a_rebuild_that_fails_leaves_the_environment(cache, wheels, monkeypatch, step):
    before = installed(wheels).environment
    if step == "_fill":
        lock = before.folder / before.kind.lock_file
        lock.write_text(re.sub('(?<=sha256 = ").', "x", lock.read_text()))
    else:
        monkeypatch.setattr(install.Path, "rename", renamed_never_from(install.Path.rename, ".1.10-"))
    with pytest.raises(cv.BadInput):
        install.install("trial", Source(wheels), force=True)
    assert environment.list_environments() == (before,)
    assert installed(wheels).trouble == ""


def renamed_never_from(rename, start):
    def fail(path, target):
        if path.name.startswith(start):
            raise PermissionError(13, "Permission denied")
        return rename(path, target)

    return fail


def test_an_environment_without_a_record_is_created_again(cache, wheels):
    (installed(wheels).environment.folder / environment.RECORD).unlink()
    assert environment.list_environments() == ()
    again = installed(wheels)
    assert (again.new, again.trouble) == (True, "")


INSTALL = """
import os, signal, sys
from pathlib import Path
from conservative.references.environments.install import install
from conservative.references.environments.kind import Source
changes, last = [], int(sys.argv[2])
def note(event, arguments):
    if event in ("os.rename", "subprocess.Popen"):
        changes.append(event)
        if len(changes) == last:
            os.killpg(0, signal.SIGKILL)
sys.addaudithook(note)
install("trial", Source(Path(sys.argv[1])))
print(*changes)
"""
"""It is killed before one of its changes: the start of a program, or the new name of a file or folder."""


def install_until(start, wheels, last=0):
    """Install up to a change, or to the end; return the changes of an installation that ended."""
    command = [sys.executable, "-c", INSTALL, str(wheels), str(last)]
    path = os.pathsep.join([str(ROOT), *sys.path])
    process = start(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=variables(PYTHONPATH=path), text=True)
    out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == (-signal.SIGKILL if last else 0), err
    return out.split()


def test_a_kill_leaves_no_incomplete_environment(cache, wheels, start):
    changes = install_until(start, wheels)
    whole = len(changes) - changes[::-1].index("os.rename")  # it has its name after the last of these
    assert len(changes) > whole > 6  # measured 9 and 8
    for last in range(1, len(changes) + 1):
        install.remove("trial")
        install_until(start, wheels, last)
        assert len(environment.list_environments()) == (last > whole)
        assert installed(wheels).trouble == ""
        assert [path.name for path in (cache / "trial").iterdir()] == ["1.10"]


def test_a_full_disk_leaves_nothing_and_is_reported(wheels, tmp_path, monkeypatch, trial_registered):
    small = tmp_path / "small"
    small.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=8m", "none", small], capture_output=True, check=False).returncode:
        pytest.skip("a small file system cannot be mounted here")
    try:
        monkeypatch.setenv("XDG_CACHE_HOME", str(small))
        with pytest.raises(cv.BadInput, match=r"room"):
            installed(wheels)
        assert environment.list_environments() == ()
        assert not list(folders.folder_of_all().glob("trial/*"))
    finally:
        subprocess.run(["umount", small], check=True)


def build(wheels, folder, version="1.10", code="VALUE = 2\n"):
    write_wheel(folder, version, code=code)
    return install_build("trial", folder / f"trial-{version}-py3-none-any.whl", Source(wheels))


def test_a_build_has_its_own_version_and_integrates(wheels, tmp_path):
    installation = build(wheels, tmp_path)
    assert (installation.new, installation.trouble) == (True, "")
    version = installation.environment.version
    assert version.startswith("1.10+build.")
    assert installation.environment.is_build
    assert not install_build("trial", tmp_path / "trial-1.10-py3-none-any.whl", Source(wheels)).new
    method = registry.method(f"trial@{version}")
    assert method.label == f"trial=={version}/integrate"
    assert cv.integrate(cv.scenes.brick_flip(t_end=0.1), 0.01, method=method).ok


def test_builds_of_one_version_have_different_environments(wheels, tmp_path):
    first, second = build(wheels, tmp_path), build(wheels, tmp_path, code="VALUE = 3\n")
    assert second.new
    assert first.environment.version != second.environment.version
    assert build(wheels, tmp_path, "2.0+g12").environment.version.startswith("2.0+g12.build.")  # a local part stays


def test_a_build_is_not_the_newest_release(wheels, tmp_path):
    install.install("trial==1.0", Source(wheels))
    build(wheels, tmp_path, "9.0")
    assert environment.find_environment("trial").version == "1.0"


@pytest.mark.parametrize("name", ["other-1.0-py3-none-any.whl", "trial.whl", "trial-1.0.whl"])
def test_wheels_of_other_packages_are_refused(name, tmp_path):
    with zipfile.ZipFile(tmp_path / name, "w"):
        pass
    with pytest.raises(cv.BadInput, match=r"against: got .*expected a wheel of trial"):
        install_build("trial", tmp_path / name, Source())


def test_a_path_without_wheel_or_sources_is_refused(tmp_path):
    for path in (tmp_path, tmp_path / "nothing.whl"):
        with pytest.raises(cv.BadInput, match="expected a wheel, or a folder with"):
            install_build("trial", path, Source())


def test_a_wheel_for_another_python_is_refused(cache, tmp_path):
    write_wheel(tmp_path, "2.0", "cp27-cp27m-any")
    write_numpy(tmp_path)
    with pytest.raises(cv.BadInput, match=r"no wheel|uv can install"):
        install_build("trial", tmp_path / "trial-2.0-cp27-cp27m-any.whl", Source(tmp_path))
    assert environment.list_environments() == ()


def test_sources_are_not_built_without_permission(tmp_path):
    marker = tmp_path / "it_ran"
    (tmp_path / "setup.py").write_text(f"open({str(marker)!r}, 'w')\n")
    with pytest.raises(cv.BadInput, match="has to be built; expected a wheel, or --allow-build"):
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


def test_sources_are_built_with_permission(wheels, tmp_path):
    write_wheel(tmp_path, "3.0")
    project = tmp_path / "project"
    project.mkdir()
    (project / "pyproject.toml").write_text(PROJECT)
    (project / "backend.py").write_text(BACKEND.format(source=str(tmp_path / "trial-3.0-py3-none-any.whl")))
    installation = install_build("trial", project, Source(wheels, allow_build=True))
    assert installation.environment.version.startswith("3.0+build.")
    assert installation.trouble == ""


def test_sources_that_do_not_build_are_refused(wheels, tmp_path):
    (tmp_path / "pyproject.toml").write_text(PROJECT)
    (tmp_path / "backend.py").write_text("def build_wheel(*_):\n    raise SystemExit('no compiler')\n")
    with pytest.raises(cv.BadInput, match="a folder that uv can build"):
        install_build("trial", tmp_path, Source(wheels, allow_build=True))


def test_the_newest_releases_are_those_of_the_index_oldest_first(wheels):
    assert newest_releases("trial", 2, Source(wheels)) == ("1.9", "1.10")
    assert newest_releases("trial", 9, Source(wheels)) == ("1.0", "1.9", "1.10")


def test_a_missing_list_of_releases_is_reported(tmp_path):
    with pytest.raises(cv.BadInput, match=r"no list of versions of trial .*expected a network, --find-links FOLDER"):
        newest_releases("trial", 2, Source(tmp_path))


def test_releases_are_installed_once_and_announced(wheels):
    announced = []
    for _ in range(2):
        environments = install_releases("trial", ("1.9", "1.0"), Source(wheels), announced.append)
        assert [environment.version for environment in environments] == ["1.9", "1.0"]
    assert announced == ["installing trial@1.9", "installing trial@1.0"]
    with pytest.raises(cv.BadInput, match="engine: got 'trial@; true'; expected NAME"):
        install_releases("trial", ("1.10", "; true"), Source(wheels), announced.append)
    assert len(announced) == 2
