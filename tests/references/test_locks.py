"""Environments are filled only with files whose hashes are in the lock. No network is needed: the wheel is local."""

import hashlib
import sys

import pytest

from conservative.references.environments.kind import Lock, Source
from conservative.references.environments.pip import Pip
from conservative.references.environments.uv_command import UvFailed

from .local_wheels import write_wheel

TEXT = """lock-version = "1.0"
created-by = "a test"

[[packages]]
name = "trial"
version = "1.0"
wheels = [{{ url = "{url}"{hashes} }}]
"""


@pytest.fixture
def fill(tmp_path, monkeypatch):
    """Return a function that fills an environment from a lock with a hash of the wheel; it returns the installed packages."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    write_wheel(tmp_path, "1.0")
    (wheel,) = tmp_path.glob("*.whl")
    folder = tmp_path / "environment"
    folder.mkdir()

    def fill_with(hashes):
        text = TEXT.format(url=wheel.as_uri(), hashes=hashes % hashlib.sha256(wheel.read_bytes()).hexdigest() if hashes else "")
        (folder / Pip.lock_file).write_text(text)
        return Pip().fill(folder, Lock("1.0", text, sys.executable), Source(tmp_path))[1]

    return fill_with


def test_the_file_of_the_lock_is_installed(fill):
    assert fill(', hashes = { sha256 = "%s" }') == ("trial==1.0",)


@pytest.mark.parametrize("hashes", ["", ', hashes = { sha256 = "%.1s' + "0" * 63 + '" }'], ids=["none", "of another file"])
def test_a_file_whose_hash_is_not_in_the_lock_is_refused(hashes, fill, tmp_path):
    with pytest.raises(UvFailed):
        fill(hashes)
    assert not list(tmp_path.glob("environment/lib/python*/site-packages/trial*"))
