"""Versions of a package in lock and requirements files, and a commit that bumps it."""

import pytest

from conservative.benchmarks.versions.bumps import find_bump, find_version
from conservative.errors import BadInput

from .test_versions import commit

TEXTS = {
    "numpy==2.0\nmujoco==3.6.0  # the engine\n": "3.6.0",
    "mujoco[usd] == 3.6.0 ; python_version > '3.9'\n": "3.6.0",
    "Mujoco==3.6.0 \\\n    --hash=sha256:abc\n": "3.6.0",
    'dependencies = ["mujoco==3.6.0", "x"]\n': "3.6.0",
    '[[package]]\nname = "mujoco"\nversion = "3.6.0"\nsource = "x"\n': "3.6.0",
    "dependencies:\n  - mujoco=3.6.0\n": "3.6.0",
    '"node_modules/mujoco": {\n  "version": "3.6.0",\n': "3.6.0",
    '"mujoco": "3.6.0"': "3.6.0",
    "mujoco>=3.6.0\n": "",
    "mujoco-py==2.1\nmy-mujoco==1.0\n": "",
    "": "",
}


@pytest.mark.parametrize("text", TEXTS)
def test_a_version_in_a_file(text):
    assert find_version(text, "mujoco") == TEXTS[text]


def test_names_of_packages_are_normalised():
    assert find_version("Dimforge_Rapier==1.2\n", "dimforge-rapier") == "1.2"


def test_a_bump_between_a_commit_and_the_files(tmp_path):
    file = tmp_path / "part" / "requirements.txt"
    file.parent.mkdir()
    file.write_text("mujoco==3.6.0\nnumpy==2.0\n")
    first = commit(tmp_path)
    assert find_bump("mujoco", first, file.parent) is None
    file.write_text("mujoco==4.0.0\nnumpy==2.0\n")
    assert find_bump("mujoco", first, file.parent) == ("3.6.0", "4.0.0")
    assert find_bump("mujoco", "HEAD", tmp_path) == ("3.6.0", "4.0.0")
    assert find_bump("numpy", first, tmp_path) is None
    with pytest.raises(BadInput, match="bump: got 'nowhere'"):
        find_bump("mujoco", "nowhere", tmp_path)
