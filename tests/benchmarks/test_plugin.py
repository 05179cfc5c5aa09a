import json
import subprocess
import sys
from pathlib import Path

import pytest

from conservative.benchmarks import suite

SUITE = Path(suite.__file__).parent
OTHER = """
def test_plain():
    pass

def test_timed(benchmark):
    benchmark.extra_info.update(label="mine", error=1.25e-9)
    benchmark(sum, range(100))
"""


@pytest.fixture
def other(tmp_path):
    """Another project, with a benchmark of its own and no settings."""
    (tmp_path / "checks").mkdir()
    (tmp_path / "checks" / "test_other.py").write_text(OTHER)
    (tmp_path / "pytest.ini").write_text("[pytest]\ntestpaths = checks\naddopts = -p no:cacheprovider\n")
    return tmp_path


def run(folder, *options):
    command = [sys.executable, "-m", "pytest", "--benchmark-max-time=0.001", *map(str, options)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)
    return done.returncode, done.stdout + done.stderr


LOADED = """
import sys
import pytest
before = set(sys.modules)
import conservative.benchmarks.gate.pytest_plugin
roots = {"conservative", "numpy", "numba", "pandas"}
print(*(name for name in set(sys.modules) - before if name.partition(".")[0] in roots))
"""


def test_the_plugin_imports_nothing_of_ours():
    done = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, timeout=60, check=True)
    plugin = "conservative.benchmarks.gate.pytest_plugin"
    above = {".".join(plugin.split(".")[:length]) for length in range(1, 5)}
    assert set(done.stdout.split()) == above | {"conservative.version"}


@pytest.mark.slow
def test_without_the_option_other_projects_see_nothing(other):
    code, text = run(other)
    assert code == 0
    assert "2 passed" in text
    assert "accuracy beside time" not in text


def test_accuracy_stands_beside_the_times(other):
    _, text = run(other, "--benchmark", "checks")
    after = text.split("accuracy beside time")[1].splitlines()
    assert after[1].split() == ["benchmark", "min,", "s", "median,", "s", "error"]
    name, *numbers = after[2].split()
    assert name == "test_timed"
    assert float(numbers[2]) == 1.25e-9


@pytest.mark.slow
def test_options_of_pytest_benchmark_keep_their_meaning(other):
    assert "1 passed, 1 skipped" in run(other, "--benchmark-only")[1]
    assert "1 passed, 1 skipped" in run(other, "--benchmark-skip")[1]
    code, text = run(other, "--benchmark", "--benchmark-only", "--benchmark-json=found.json", "checks")
    assert code == 0
    assert "1 passed, 1 skipped" in text
    (found,) = json.loads((other / "found.json").read_text())["benchmarks"]
    assert found["extra_info"] == {"label": "mine", "error": 1.25e-9}
