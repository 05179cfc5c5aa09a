"""Environments that are broken by hand, or whose making was ended in the middle: found, mended, never used."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import pytest

import conservative as cv
from conservative import registry
from conservative.references.environments import doctor, environment, install
from conservative.references.environments.lock import Source

from ..environments import ROOT, variables

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def cache(no_environments):
    return no_environments


def installed(wheels, name="trial"):
    return install.install(name, Source(wheels))


def no_numpy(folder):
    (path,) = folder.glob("lib/python*/site-packages/numpy/__init__.py")
    path.unlink()


def other_version(folder):
    (path,) = folder.glob("lib/python*/site-packages/trial-1.10.dist-info/METADATA")
    path.parent.rename(path.parent.with_name("trial-7.0.dist-info"))


BREAKS = {
    "Python gone": lambda folder: (folder / "bin" / "python").unlink(),
    "record cut short": lambda folder: (folder / environment.RECORD).write_text('{"engine": "tri'),
    "record gone": lambda folder: (folder / environment.RECORD).unlink(),
    "record of another": lambda folder: (folder / environment.RECORD).write_text(json.dumps({"engine": "x"})),
    "lock and record gone": lambda folder: [(folder / name).unlink() for name in (environment.LOCK, environment.RECORD)],
    "NumPy broken": no_numpy,
    "package gone": lambda folder: [shutil.rmtree(path) for path in folder.glob("lib/python*/site-packages/trial-*")],
    "other version": other_version,
    "everything gone": lambda folder: [shutil.rmtree(path) for path in folder.iterdir() if path.is_dir()],
}


def test_the_doctor_finds_and_mends(cache, wheels):
    folder = installed(wheels).environment.folder
    source = Source(wheels)
    for name, broken in BREAKS.items():
        assert doctor.trouble_of(folder) == ""
        broken(folder)
        assert doctor.trouble_of(folder), name
        (mended,) = doctor.examine(True, source)
        assert (mended.name, mended.remedy) == ("trial==1.10", "made anew"), name
    assert [finding.trouble for finding in doctor.examine(False, source)] == [""]
    assert cv.integrate(cv.scenes.brick_flip(t_end=0.1), 0.01, method=registry.method("trial")).ok


def test_what_cannot_be_mended_is_removed(cache, wheels, tmp_path):
    installed(wheels)
    no_numpy(environment.find_environment("trial").folder)
    (finding,) = doctor.examine(True, Source(tmp_path))
    assert finding.remedy.startswith("removed, as it cannot be made anew")
    assert environment.list_environments() == ()


INSTALL = (
    "import sys; from pathlib import Path\n"
    "from conservative.references.environments.install import install\n"
    "from conservative.references.environments.lock import Source\n"
    "print('start', flush=True); install('trial', Source(Path(sys.argv[1]))); print('whole', flush=True)"
)


def start_install(wheels):
    command = [sys.executable, "-c", INSTALL, str(wheels)]
    path = os.pathsep.join([str(ROOT), *sys.path])
    return subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=variables(PYTHONPATH=path),
        text=True,
        start_new_session=True,
    )


def test_a_kill_leaves_nothing_half_installed(cache, wheels):
    start = time.monotonic()
    process = start_install(wheels)
    assert process.communicate(timeout=120)[0] == "start\nwhole\n"
    duration, whole = time.monotonic() - start, 0
    for part in (0.2, 0.4, 0.6, 0.7, 0.8, 0.9):
        install.remove("trial")
        process = start_install(wheels)
        time.sleep(part * duration)
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate(timeout=60)
        for found in environment.list_environments():
            assert doctor.trouble_of(found.folder) == ""
            whole += 1
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
