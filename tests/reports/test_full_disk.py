"""Commands on a full disk end in one line that names the file, and change no file."""

import json

import pytest

from conservative.benchmarks.gate import baseline, results
from conservative.benchmarks.gate.results import Row
from conservative.outcome import OK

from ..environments import run_python

pytestmark = pytest.mark.slow

LIMITED = """
import os, resource, sys
limit, folder = int(sys.argv.pop(1)), sys.argv.pop(1)
os.chdir(folder)
with open("stdout", "w") as out:
    os.dup2(out.fileno(), 1)
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))  # the system refuses what goes beyond, as a full disk does
sys.argv[0] = "conservative"
from conservative.reports.cli.launch import launch
launch()
"""
SMALL = ["report", "--quick", "--scenes", "brick_flip", "--methods", "moser_veselov:order=2"]
UPDATE = ["gate", "results.json", "--baseline", "baseline.json", "--update", "More rows"]
COMMANDS = {
    "run --csv": (2000, "csv: got 'run.csv' (", ["run", "brick_flip", "--csv", "run.csv"]),
    "report": (2000, "out: got 'report.partial.json' (", SMALL),
    "gate --update": (1000, "baseline: got 'baseline.json' (", UPDATE),
    "new": (500, "stdout: got '", ["new"]),
    "list": (500, "stdout: got '", ["list"]),
    "list --json": (500, "stdout: got '", ["list", "--json"]),
    "sweep --out": (900, "out: got '", ["sweep", "brick_flip", "--starts", "2", "--spread", "rate=1%", "--out", "sweep.zarr"]),
    "run --json": (500, "stdout: got '", ["run", "brick_flip", "--json"]),
}


def found(*values):
    rows = {f"id {k}": Row(f"id {k}", "brick_flip", "reduced", OK, values={"e": value}) for k, value in enumerate(values)}
    return results.Results("a machine", rows, "a commit")


@pytest.fixture
def folder(tmp_path):
    """A folder with files of every kind that a command replaces."""
    baseline.write(baseline.update_baseline(None, [found(1e-3)], "First"), tmp_path / "baseline.json")
    results.write(found(*[1e-3] * 40), tmp_path / "results.json")
    (tmp_path / "run.csv").write_text("t (s),R_WB_11,before")
    return tmp_path


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.rglob("*") if path.name != "stdout"}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_names_the_file_that_cannot_be_written(command, folder, tmp_path_factory):
    limit, words, arguments = COMMANDS[command]
    before = contents(folder)
    if arguments[0] in ("run", "report", "sweep"):  # their compiled code needs more room than this disk has
        run_python(LIMITED, str(2**30), str(tmp_path_factory.mktemp("with_room")), *arguments)
    code, _, err = run_python(LIMITED, str(limit), str(folder), *arguments)
    err = "".join(line for line in err.splitlines(keepends=True) if not line.startswith("Writing "))
    assert code == 2
    *logged, error = err.splitlines()
    assert all("heyoka" in line or line.startswith("study ") for line in logged)  # it cannot write its cache; progress
    assert error.startswith(f"Error: {words}")
    assert "File too large" in error
    assert "; expected a " in error
    assert contents(folder) == before


def test_results_are_whole_or_as_before(folder):
    before = contents(folder)
    code = """
import os, resource, sys
from pathlib import Path
from conservative.benchmarks.gate import results
from conservative.errors import NotWritten
os.chdir(sys.argv[1])
found = results.read(Path('results.json'))
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
try:
    results.write(found, Path("results.json"))
except NotWritten as error:
    print(error.argument)
"""
    assert run_python(code, str(folder)) == (0, "results\n", "")
    assert contents(folder) == before
    assert json.loads(before["results.json"])["machine"] == "a machine"


CACHE = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), resource.RLIM_INFINITY))
sys.path.insert(0, sys.argv[2])
from compiled import add, half
print(add(1.0), half(1.0))
"""


@pytest.mark.parametrize("room", [0, 40, 1000])  # none; a part of the digest; the digest, but no code
def test_compiling_goes_on_where_the_cache_cannot_be_written(room, tmp_path):
    functions = "from conservative.kernels import brief\n@brief\ndef add(x): return x + 1\n@brief\ndef half(x): return x / 2\n"
    (tmp_path / "compiled.py").write_text(functions)
    code, out, err = run_python(CACHE, str(room), str(tmp_path), NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    assert (code, out) == (0, "2.0 0.5\n"), err
    assert err.count("RuntimeWarning: Compiled kernels cannot be stored (File too large)") == 1
    assert not list(tmp_path.rglob("*.nbc"))
