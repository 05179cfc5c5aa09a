"""The samples in PROTOCOL.md are right programs: they are built from the page and verified."""

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

PAGE = (Path(program.__file__).parents[1] / "PROTOCOL.md").read_text(encoding="utf-8")
SAMPLES = dict(re.findall(r"^```(c|javascript|cpp|rust|csharp)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL))
LANGUAGES = {
    "c": ("gcc -Wall -Wextra -Werror -O2 my_engine.c -o my_engine -lm", "./my_engine"),
    "javascript": ("", "node my_engine.js"),
    "cpp": ("g++ -Wall -Wextra -Werror -O2 -std=c++17 my_engine.cpp -o my_engine", "./my_engine"),
    "rust": ("rustc -O my_engine.rs", "./my_engine"),
    "csharp": ("mcs my_engine.cs", "mono my_engine.exe"),
}
ENDINGS = {"c": "c", "javascript": "js", "cpp": "cpp", "rust": "rs", "csharp": "cs"}


QUICK = ("c", "javascript")


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
    (tmp_path / f"my_engine.{ENDINGS[language]}").write_text(SAMPLES[language])
    if build:
        subprocess.run(shlex.split(build), check=True)
    (found,) = verify([run])
    close_workers()
    assert found.verdict == "right", found.reason
    heavy = next(each for each in found.findings if each.case == "heavy")
    assert (heavy.verdict, heavy.detail.count("only free bodies")) == ("not tested", 1)


def test_samples_are_short():
    assert {*SAMPLES} == {*LANGUAGES}
    assert max(text.count("\n") for text in SAMPLES.values()) <= 40
