"""The tests of references/motions inside test frameworks: they pass with a file of known errors, and fail without."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ...environments import PATIENCE
from .motions_engines.methods import METHODS
from .motions_engines.run import MOTIONS, Engine, missing, start, write

RK2 = Engine(METHODS["explicit midpoint"][1], 2)
PLAIN = {name: text for name, text in os.environ.items() if not name.startswith(("ROTATION_", "PYTEST_"))}
pytestmark = pytest.mark.slow


def call(folder, *command, **environment):
    """Return the exit code and the output of a command."""
    done = subprocess.run(
        [str(part) for part in command], cwd=folder, env=PLAIN | environment, text=True, capture_output=True, timeout=PATIENCE
    )
    return done.returncode, done.stdout + done.stderr


def passes_with_known_errors(folder, *command):
    """Check a framework with a right engine, a damped engine, its record, and another mistake."""
    assert call(folder, *command)[0] == 0
    code, output = call(folder, *command, MISTAKE="damping 0.05")
    assert code != 0
    assert "12 of 12 motions failed" in output
    known = str(folder / "errors.txt")
    code, output = call(folder, *command, MISTAKE="damping 0.05", ROTATION_RECORD=known)
    assert (code, "12 motions recorded, 12 known errors" in output) == (0, True), output
    code, output = call(folder, *command, MISTAKE="damping 0.05", ROTATION_KNOWN=known)
    assert (code, f"known errors of {known}: 12 (damping 0.05: 12), new failures: 0" in output) == (0, True), output
    code, output = call(folder, *command, MISTAKE="damping 0.1", ROTATION_KNOWN=known)
    assert code != 0
    assert "free rotation at your step: attitude error 0.14 to 0.22 rad; first bad motion: brick_flip (damping 0.1)" in output


CPP = {
    "GoogleTest": ("gtest/gtest.h", "", ("-lgtest", "-lgtest_main", "-lpthread")),
    "Catch2": ("catch2/catch.hpp", "#define CATCH_CONFIG_MAIN\n", ()),
    "doctest": ("doctest/doctest.h", "#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN\n", ()),
}
"""The header of a framework, what it needs before it, and libraries."""


@pytest.mark.skipif(bool(missing("C++")), reason="g++ is not installed")
@pytest.mark.parametrize("included", [False, True], ids=["a file of its own", "included in another test"])
@pytest.mark.parametrize("name", CPP)
def test_in_cpp(name, included, tmp_path):
    """The framework's header is included at the top of the copied file, or the copied file in an existing test."""
    header, before, libraries = CPP[name]
    if not any((Path(folder) / header).exists() for folder in ("/usr/include", "/usr/local/include")):
        pytest.skip(f"{name} is not installed: apt-get install libgtest-dev catch2 doctest-dev")
    write("C++", tmp_path, RK2)
    text, include = (tmp_path / "rotation_test.c").read_text(), f"{before}#include <{header}>\n"
    (tmp_path / "rotation_test.cpp").write_text(text if included else include + text)
    (tmp_path / "other.cpp").write_text(include + '#include "rotation_test.cpp"\n')
    source = "other.cpp" if included else "rotation_test.cpp"
    code, output = call(tmp_path, "g++", "-std=c++17", "-o", "run", source, *libraries)
    assert code == 0, output
    passes_with_known_errors(tmp_path, "./run")


@pytest.mark.skipif(not shutil.which("cargo"), reason="cargo is not installed")
def test_in_cargo(tmp_path):
    (tmp_path / "tests").mkdir()
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / "lib.rs").write_text("")
    (tmp_path / "Cargo.toml").write_text('[package]\nname = "engine"\nversion = "0.1.0"\nedition = "2021"\n')
    write("Rust", tmp_path / "tests", RK2)
    passes_with_known_errors(tmp_path, "cargo", "test", "--offline", "--quiet")


@pytest.mark.skipif(bool(missing("JavaScript")), reason="node is not installed")
def test_in_node_test(tmp_path):
    write("JavaScript", tmp_path, RK2)
    passes_with_known_errors(tmp_path, "node", "--test")
    (tmp_path / "errors.txt").rename(tmp_path / "known.txt")
    code, output = call(tmp_path, "node", "--test", MISTAKE="damping 0.05")  # beside the test
    assert (code, "known.txt: 12" in output) == (0, True)


def test_in_pytest(tmp_path):
    write("Python", tmp_path, RK2)
    own = (
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-n0",
        "-p",
        "no:cacheprovider",
        "-p",
        "no:zarr",
        "-c",
        os.devnull,
        "--rootdir=.",
    )
    passes_with_known_errors(tmp_path, *own, "test_rotation.py")
    (tmp_path / "errors.txt").rename(tmp_path / "known.txt")
    code, output = call(tmp_path, *own, "test_rotation.py", MISTAKE="damping 0.05")
    assert (code, "known.txt: 12" in output) == (0, True)


@pytest.mark.skipif(bool(missing("C#")), reason="mcs is not installed")
def test_in_a_framework_of_c_sharp(tmp_path):
    """A framework calls `RotationTest.Run` in an assembly without a main function."""
    write("C#", tmp_path, RK2)
    (tmp_path / "Other.cs").write_text("static class Other { static int Main() { return RotationTest.Run() == 0 ? 0 : 5; } }\n")
    code, output = call(tmp_path, "mcs", "-out:run.exe", "-define:WITHOUT_MAIN", "RotationTest.cs", "Other.cs")
    assert code == 0, output
    passes_with_known_errors(tmp_path, "mono", "run.exe")


def test_tests_as_they_are(tmp_path):
    """The body stands still: all free motions fail, and the others are skipped."""
    for language in ("C", "Rust", "JavaScript", "Python", "C#"):
        if missing(language):
            continue
        untouched = Engine((), 2, has="")
        folder = tmp_path / language
        folder.mkdir()
        done = start(language, folder, untouched)
        assert done.returncode == 1
        lines = done.stdout.splitlines()
        assert sum("skipped, it has" in line for line in lines) == 4
        assert '"frozen motion" explains 8 of them' in lines


@pytest.mark.skipif(bool(missing("C++")), reason="g++ is not installed")
def test_the_engine_on_the_page(tmp_path):
    """Explicit Euler steps of a diagonal inertia: bodies in principal axes pass, the others fail with this mistake."""
    (code,) = re.findall(r"```cpp\n(.*?)```", (MOTIONS / "README.md").read_text(), re.DOTALL)
    text = (MOTIONS / "rotation_test.c").read_text()
    text = re.sub(r"^static void simulate.*?^}\n", lambda _: code, text, flags=re.DOTALL | re.M).replace(
        "ORDER = 2", "ORDER = 1"
    )
    (tmp_path / "rotation_test.cpp").write_text(text)
    assert call(tmp_path, "g++", "-Wall", "-Wextra", "-Werror", "rotation_test.cpp")[0] == 0
    code, output = call(tmp_path, "./a.out", *sorted(MOTIONS.glob("*.csv")))
    assert '"no products of inertia" explains 17 of them' in output
    code, output = call(tmp_path, "./a.out")
    assert '5 of 8 motions failed\n"no products of inertia" explains 5 of them' in output
