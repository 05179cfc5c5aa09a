"""Environments are made whole or not at all, found broken, and mended: all from a folder of wheels, without a network."""

import pytest

import conservative as cv
from conservative import registry
from conservative.errors import MissingEngine
from conservative.references.environments import environment, install, uv_command
from conservative.references.environments.environment import Distribution
from conservative.references.environments.lock import Source, split_requirement

from .local_wheels import write_numpy, write_sdist, write_wheel

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def cache(no_environments):
    return no_environments


def installed(wheels, name="trial"):
    return install.install(name, Source(wheels))


def everything(folder):
    """Return all files below a folder, but what uv keeps for itself and what Python compiles."""
    names = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file() or path.is_symlink()}
    return {name for name in names if "__pycache__" not in name}


def test_the_newest_version_is_installed_with_numpy_and_recorded(cache, wheels):
    done = installed(wheels)
    found = done.environment
    assert (found.engine, found.version, done.new, done.trouble) == ("trial", "1.10", True, "")
    assert [package.partition("==")[0] for package in found.packages] == ["numpy", "trial"]
    assert environment.list_environments() == (found,)
    lock = (found.folder / environment.LOCK).read_text()
    assert "trial==1.10" in lock
    assert "--hash=sha256:" in lock


def test_what_is_there_is_not_made_again(cache, wheels):
    before = installed(wheels, "trial==1.9").environment
    stamp = (before.folder / environment.RECORD).stat().st_mtime_ns
    assert not installed(wheels, "trial==1.9").new
    assert (before.folder / environment.RECORD).stat().st_mtime_ns == stamp


def test_versions_live_side_by_side_and_go_one_by_one(cache, wheels):
    for version in ("1.0", "1.10", "1.9"):
        installed(wheels, f"trial=={version}")
    assert [found.version for found in environment.list_environments("trial")] == ["1.0", "1.9", "1.10"]
    assert registry.method("trial").label == "trial==1.10/integrate"
    with pytest.raises(cv.BadInput, match=r"'trial==1\.9' \(nearest\)"):
        install.remove("trial==1.99")
    assert [found.version for found in install.remove("trial==1.10")] == ["1.10"]
    assert registry.method("trial").label == "trial==1.9/integrate"
    assert len(install.remove("trial")) == 2
    with pytest.raises(MissingEngine, match="conservative engines install trial"):
        registry.method("trial")
    with pytest.raises(cv.BadInput, match="a name after something is installed"):
        install.remove("trial")


def test_an_engine_integrates_where_it_was_installed(cache, wheels):
    installed(wheels)
    assert cv.integrate(cv.scenes.brick_flip(t_end=0.1), 0.01, method=registry.method("trial@1.10")).ok


def test_nothing_is_written_elsewhere(cache, wheels, tmp_path):
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
    "trial=1",
    "-r",
    "trial==1.0;x",
    "a b",
    "trial>1",
]


@pytest.mark.parametrize("text", BAD)
def test_a_name_with_anything_odd_in_it_is_refused(text):
    with pytest.raises(cv.BadInput, match="NAME or NAME==VERSION"):
        split_requirement(text)


def test_an_unknown_engine_names_the_nearest(cache):
    with pytest.raises(cv.BadInput, match=r"'trail'; allowed: 'trial' \(nearest\)"):
        install.install("trail")


def test_an_unknown_version_names_those_that_exist(cache, wheels):
    with pytest.raises(cv.BadInput, match=r"'trial==1.9.5'; allowed: 1.9 \(nearest\), or one of 1.10, 1.9, 1.0"):
        installed(wheels, "trial==1.9.5")
    assert environment.describe_versions("0.1", ["1.0", "2.0"]).startswith("1.0 (nearest)")


def test_a_version_for_other_pythons_alone_is_refused(cache, tmp_path):
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


def test_no_network_is_said(cache, monkeypatch):
    monkeypatch.setenv("UV_DEFAULT_INDEX", "https://127.0.0.1:9/simple")
    monkeypatch.setenv("UV_HTTP_RETRIES", "0")
    with pytest.raises(
        cv.BadInput, match="no answer for 'trial' from where packages come from; allowed: a network, or --find-links FOLDER"
    ):
        install.install("trial")


def test_what_uv_says_has_no_password():
    failure = uv_command.UvFailed("error: Failed to fetch: https://me:secret@somewhere/simple/x/")
    assert "secret" not in str(failure)


def test_an_engine_that_cannot_be_imported_is_said(tmp_path, monkeypatch):
    write_wheel(tmp_path, "4.0", code="import os\nos.abort()\n")
    write_numpy(tmp_path)
    monkeypatch.setattr(registry.engine("trial"), "distribution", Distribution("trial", "trial"))
    assert installed(tmp_path, "trial==4.0").trouble.startswith("crashed (signal 6 (SIGABRT)")
