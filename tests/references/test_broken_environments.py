"""Environments that are broken by hand, or whose making was ended in the middle: found, mended, never used."""

import os
import shutil
import signal
import subprocess
import sys
import time

import pytest

import conservative as cv
from conservative import registry
from conservative.references.environments import client, environment, install
from conservative.references.environments.lock import Source

from ..environments import ROOT, variables

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def cache(no_environments):
    return no_environments


def installed(wheels, name="trial"):
    return install.install(name, Source(wheels))


def test_force_rebuilds_from_the_lock(cache, wheels):
    before = installed(wheels, "trial==1.9").environment
    for module in before.folder.glob("lib/python*/site-packages/numpy*"):
        shutil.rmtree(module) if module.is_dir() else module.unlink()
    client.close_workers()  # the running one has imported the package
    assert installed(wheels, "trial==1.9").trouble
    rebuilt = install.install("trial", Source(wheels), force=True)  # not 1.10, the newest in the folder of wheels
    assert (rebuilt.environment, rebuilt.new, rebuilt.trouble) == (before, True, "")
    assert cv.integrate(cv.scenes.brick_flip(t_end=0.1), 0.01, method=registry.method("trial")).ok
    assert [path.name for path in (cache / "trial").iterdir()] == ["1.9"]


@pytest.mark.parametrize("step", ["_fill", "_replace"])
def test_a_rebuild_that_fails_leaves_the_environment(cache, wheels, monkeypatch, step):
    before = installed(wheels).environment
    if step == "_fill":
        source = Source(cache)  # without wheels
    else:
        source = Source(wheels)
        monkeypatch.setattr(install.Path, "rename", renamed_never_from(install.Path.rename, ".1.10-"))
    with pytest.raises(cv.BadInput):
        install.install("trial", source, force=True)
    assert environment.list_environments() == (before,)
    assert installed(wheels).trouble == ""


def renamed_never_from(rename, start):
    def fail(path, target):
        if path.name.startswith(start):
            raise PermissionError(13, "Permission denied")
        return rename(path, target)

    return fail


def test_an_environment_without_a_record_is_made_again(cache, wheels):
    (installed(wheels).environment.folder / environment.RECORD).unlink()
    assert environment.list_environments() == ()
    again = installed(wheels)
    assert (again.new, again.trouble) == (True, "")


INSTALL = (
    "import sys; from pathlib import Path\n"
    "from conservative.references.environments.install import install\n"
    "from conservative.references.environments.lock import Source\n"
    "print('start', flush=True); install('trial', Source(Path(sys.argv[1]))); print('whole', flush=True)"
)


def start_install(start, wheels):
    command = [sys.executable, "-c", INSTALL, str(wheels)]
    path = os.pathsep.join([str(ROOT), *sys.path])
    return start(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=variables(PYTHONPATH=path),
        text=True,
    )


def test_a_kill_leaves_nothing_half_installed(cache, wheels, start):
    began = time.monotonic()
    process = start_install(start, wheels)
    assert process.communicate(timeout=120)[0] == "start\nwhole\n"
    duration, whole = time.monotonic() - began, 0
    for part in (0.2, 0.4, 0.6, 0.7, 0.8, 0.9):
        install.remove("trial")
        process = start_install(start, wheels)
        time.sleep(part * duration)
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate(timeout=60)
        whole += len(environment.list_environments())
        assert installed(wheels).trouble == ""
        assert [path.name for path in (cache / "trial").iterdir()] == ["1.10"]
    assert whole < 6


def test_a_full_disk_leaves_nothing_and_is_said(wheels, tmp_path, monkeypatch, trial_registered):
    small = tmp_path / "small"
    small.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=8m", "none", small], capture_output=True, check=False).returncode:
        pytest.skip("a small file system cannot be mounted here")
    try:
        monkeypatch.setenv("XDG_CACHE_HOME", str(small))
        with pytest.raises(cv.BadInput, match=r"room"):
            installed(wheels)
        assert environment.list_environments() == ()
        assert not list(environment.folder_of_all().glob("trial/*"))
    finally:
        subprocess.run(["umount", small], check=True)
