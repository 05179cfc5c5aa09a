import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ..environments import PATIENCE

pytestmark = pytest.mark.slow

SOURCE = Path(__file__).parent.parent / "example_package"
INSTALL = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """The package as its authors have it: a folder, and an environment in which it is installed."""
    folder = tmp_path_factory.mktemp("example")
    shutil.copytree(SOURCE, folder / "source")
    subprocess.run([*INSTALL, "--target", folder / "installed", folder / "source"], check=True, timeout=PATIENCE)
    (folder / "source" / "pytest.ini").write_text("[pytest]\naddopts = -p no:cacheprovider\n")
    return folder


def run(project, *command):
    path = os.pathsep.join(filter(None, (str(project / "installed"), os.environ.get("PYTHONPATH"))))
    environment = {**os.environ, "PYTHONPATH": path, "GITHUB_STEP_SUMMARY": str(project / "summary.md")}
    done = subprocess.run(
        [sys.executable, *command],
        cwd=project / "source",
        env=environment,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    return done.returncode, done.stdout + done.stderr


def workflow():
    """The last command of the workflow that its authors copy."""
    *_, line = re.findall(r"- run: (.*)", (SOURCE / "benchmark.yml").read_text())
    return ["-m", *line.split()]


def test_an_outside_package_gates_its_own_integrator(project):
    code, text = run(project, *workflow())
    assert code == 2
    assert "no baseline" in text
    code, text = run(
        project, "-c", "from conservative.reports.cli.main import main; main()", "gate", "--update", "First release"
    )
    assert code == 0, text
    baseline = json.loads((project / "source" / "benchmarks" / "baseline.json").read_text())
    assert sorted(baseline["rows"]) == [
        "test_speed.py::test_speed[brick_flip-example-dt0.01]",
        "test_speed.py::test_speed[near_separatrix-example-dt0.01]",
    ]
    assert baseline["history"][0]["reason"] == "First release"
    code, text = run(project, *workflow())
    assert code == 0, text
    assert "gate: passed, 2 rows" in text
    assert "## Gate: passed" in (project / "summary.md").read_text()
