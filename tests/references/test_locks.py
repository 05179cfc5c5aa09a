"""Environments are filled only with files whose hashes are in the lock. No network is needed: the wheel is local."""

import hashlib
import sys

import pytest

from conservative.references.environments import lock
from conservative.references.environments.environment import LOCK
from conservative.references.environments.lock import Lock, Source
from conservative.references.environments.uv_command import UvFailed

from .local_wheels import write_wheel


@pytest.fixture
def fill(tmp_path, monkeypatch):
    """Return a function that fills an environment from a lock with a hash of the wheel; it returns the installed packages."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    write_wheel(tmp_path, "1.0")
    (wheel,) = tmp_path.glob("*.whl")
    folder = tmp_path / "environment"
    folder.mkdir()

    def fill_with(hashes):
        text = f"trial==1.0 {hashes.format(hashlib.sha256(wheel.read_bytes()).hexdigest())}\n"
        (folder / LOCK).write_text(text)
        return lock.fill(folder, Lock("1.0", sys.executable, text), Source(tmp_path))[1]

    return fill_with


def test_the_file_of_the_lock_is_installed(fill):
    assert fill("--hash=sha256:{}") == ("trial==1.0",)


@pytest.mark.parametrize("hashes", ["", f"--hash=sha256:{'0' * 64}"], ids=["none", "of another file"])
def test_a_file_whose_hash_is_not_in_the_lock_is_refused(hashes, fill, tmp_path):
    with pytest.raises(UvFailed):
        fill(hashes)
    assert not list(tmp_path.glob("environment/lib/python*/site-packages/trial*"))
