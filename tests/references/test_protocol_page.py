"""The samples of PROTOCOL.md are right programs: they are built as the page says and verified."""

import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from conservative.benchmarks.verification import protocol
from conservative.benchmarks.verification.verify import verify
from conservative.references.worker import program
from conservative.references.worker.client import close_workers

REFERENCES = Path(program.__file__).parents[1]
SAMPLES = {path.suffix[1:]: path for path in (REFERENCES / "for_engine_authors" / "samples").iterdir()}
PAGE = (REFERENCES / "PROTOCOL.md").read_text(encoding="utf-8")
LANGUAGES = {
    ending: (build.strip(" `"), run.strip(" `"))
    for ending, build, run in re.findall(r"samples/my_engine\.(\w+)\) \|([^|]*)\|([^|]*)\|", PAGE)
}
"""How the page builds and runs each sample, by the ending of its file."""
QUICK = ("c", "js")


@pytest.mark.parametrize(
    "language", [*QUICK, *(pytest.param(each, marks=pytest.mark.slow) for each in LANGUAGES if each not in QUICK)]
)
def test_a_sample_is_right(language, tmp_path, monkeypatch):
    build, run = LANGUAGES[language]
    tool = (build or run).partition(" ")[0]
    if not shutil.which(tool):
        pytest.skip(f"needs {tool}")
    for name in ("CONFIG", "CACHE"):
        monkeypatch.setenv(f"XDG_{name}_HOME", str(tmp_path / name))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(protocol, "PACE", 0.05)
    shutil.copy(SAMPLES[language], tmp_path)
    if build:
        warnings = ["-Wall", "-Wextra", "-Werror"] if tool in ("gcc", "g++") else []
        subprocess.run([*shlex.split(build), *warnings], check=True)
    (found,) = verify([run])
    close_workers()
    assert found.verdict == "right", found.reason
    heavy = next(finding for finding in found.findings if finding.case == "heavy")
    assert (heavy.verdict, heavy.detail.count("only free bodies")) == ("not tested", 1)


def test_samples_are_short():
    assert {*SAMPLES} == {*LANGUAGES}
    assert max(path.read_text(encoding="utf-8").count("\n") for path in SAMPLES.values()) <= 40
