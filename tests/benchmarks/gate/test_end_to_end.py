"""The gate in a run of pytest."""

import os
import subprocess
import sys

import pytest
from click.testing import CliRunner

from conservative.benchmarks.gate import results
from conservative.reports.cli.main import main

OTHER = """
import pytest

@pytest.mark.parametrize("method", ["kept", "removed"])
def test_mine(benchmark, method):
    benchmark(sum, range(9))
    benchmark.extra_info.update(scene="mine", method=method, error=1e-9, engine="theirs==1", spreads={"error": 0.0})

def test_skipped(benchmark):
    benchmark(sum, range(9))

def test_fails_after_timing(benchmark):
    benchmark(sum, range(9))

@pytest.fixture
def fragile():
    yield

def test_fails_in_teardown(benchmark, fragile):
    benchmark(sum, range(9))
"""
PLANTED = (
    ('["kept", "removed"]', '["kept"]'),
    ("theirs==1", "theirs==2"),
    ("test_skipped(benchmark):\n", "test_skipped(benchmark):\n    pytest.skip('today')\n"),
    ("    yield\n", "    yield\n    assert False\n"),
    (
        "timing(benchmark):\n    benchmark(sum, range(9))\n",
        "timing(benchmark):\n    benchmark(sum, range(9))\n    assert False\n",
    ),
)


@pytest.mark.slow
def test_from_end_to_end(tmp_path):
    (tmp_path / "pytest.ini").write_text("[pytest]\naddopts = -p no:cacheprovider\n")
    suite = tmp_path / "test_other.py"
    suite.write_text(OTHER)
    code, text = run(tmp_path, "--gate")
    assert (code, "no baseline" in text) == (2, True)
    kept = ["--baseline", str(tmp_path / "benchmarks" / "baseline.json")]
    found = str(tmp_path / results.FOLDER / results.FILE)
    assert CliRunner().invoke(main, ["gate", *kept, "--update", "the first one", found]).exit_code == 0
    code, text = run(tmp_path, "--gate")
    assert code == 0, text
    assert "gate: passed, 5 rows" in text
    assert "## Gate: passed" in (tmp_path / "summary.md").read_text()
    for old, new in PLANTED:
        assert old in suite.read_text()
        suite.write_text(suite.read_text().replace(old, new))
    code, text = run(tmp_path, "--gate", "--junitxml=junit.xml")
    assert code == 1
    report = (tmp_path / "junit.xml").read_text()
    for line in (
        "row, mine, removed: was passed, is missing",
        "is skipped",
        "is failed",
        "is error",
        "definition, mine, kept",
    ):
        assert line in text
        assert line in report
    assert "| row | mine | removed |" in (tmp_path / "summary.md").read_text()


def run(folder, *options):
    command = [sys.executable, "-m", "pytest", "--benchmark", "--benchmark-max-time=0.001", "test_other.py", *options]
    environment = {**os.environ, "GITHUB_STEP_SUMMARY": str(folder / "summary.md")}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120, check=False)
    return done.returncode, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "reason"), [(("--benchmark", "-n1"), "-n0"), ((), "together with --benchmark")], ids=["workers", "alone"]
)
def test_the_gate_does_not_judge_what_it_cannot(tmp_path, options, reason):
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "--gate", *options],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == pytest.ExitCode.USAGE_ERROR
    assert reason in done.stderr
