"""Kernels as plain Python and compiled, and code that is cached on disk."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import conservative as cv
from conservative import kernels as all_kernels
from conservative.deferred_imports import kernels
from conservative.kernels import digest
from conservative.kernels.protocol import Output, Result, Workspace
from conservative.registry import list_families

from ..environments import run_python
from ..sampling import sampled

SHORT_RUNS = Path(__file__).with_name("short_runs.py")
PACKAGE = Path(cv.__file__).parent


def python(arguments: list[str], **environment: str) -> str:
    """Return the output of Python with these environment variables changed; empty ones are removed."""
    known = {**os.environ, **environment}
    command = [sys.executable, "-P", "-W", "error", *arguments]
    return subprocess.run(
        command, env={k: v for k, v in known.items() if v}, stdout=subprocess.PIPE, text=True, check=True
    ).stdout.strip()


@pytest.mark.late
@pytest.mark.parametrize("every", [20, pytest.param(1, marks=pytest.mark.slow)])
def test_plain_python_and_machine_code_agree_on_every_kernel(every: int, tmp_path: Path) -> None:
    plain, compiled = tmp_path / "plain.npz", tmp_path / "compiled.npz"
    not_called = python([str(SHORT_RUNS), str(plain), str(every)], NUMBA_DISABLE_JIT="1")
    python([str(SHORT_RUNS), str(compiled), str(every)], NUMBA_DISABLE_JIT="")
    assert every > 1 or not_called == ""
    with np.load(plain) as ours, np.load(compiled) as theirs:
        assert set(ours) == set(theirs)
        assert len(ours.files) > 1000 // every
        for name in ours:
            if ", many, " in name and not ours[name].size:  # a step that raises in plain Python sends all to run one by one
                continue
            # measured 7e-14; 4e-9 with steps of radians on a separatrix, 1.5e-8 on the Lagrange top
            bound = 1e-13 if name.endswith(", 1") else 3e-8
            np.testing.assert_allclose(ours[name], theirs[name], rtol=0, atol=bound, err_msg=name)


MANY = """
import sys
import numpy as np
import conservative as cv
from conservative.kernels.compiler.lanes import REGISTER
from conservative.batch import Batch
from conservative.registry import method
top, w = cv.scenes.asymmetric_top(), np.random.default_rng(3).normal(size=(11, 3))
bodies = Batch(top, np.tile(top.R_WB0, (11, 1, 1)), w, None, {})
np.save(sys.argv[2], method(sys.argv[1]).prepare_many(bodies, cv.Grid(0.02, 20))().R_WB)
print(REGISTER)
"""


@pytest.mark.skipif(platform.machine() != "x86_64", reason="names a processor of this kind")
@pytest.mark.slow
@pytest.mark.parametrize("method", ["taylor:order=8", "reduced"])
def test_registers_of_four_and_of_eight_floats_agree(method: str, tmp_path: Path) -> None:
    """Measured: the same bits."""
    own, short = tmp_path / "own.npy", tmp_path / "short.npy"
    python(["-c", MANY, method, str(own)])
    haswell = {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": "+avx2,+fma"}
    assert python(["-c", MANY, method, str(short)], **haswell, NUMBA_CACHE_DIR=str(tmp_path)) == "4"
    np.testing.assert_allclose(np.load(short), np.load(own), rtol=0, atol=1e-15)


DOUBLE = """
from conservative.kernels import brief
@brief
def double(x):
    return x + x
"""
TOGETHER = """
import sys, time
from pathlib import Path
from numba.core import caching, event
from double import double
class Slow(event.Listener):
    def on_start(self, _): time.sleep(0.5)
    def on_end(self, _): pass
event.register("numba:compile", Slow())
save_index = caching.IndexDataCacheFile._save_index
caching.IndexDataCacheFile._save_index = lambda *of: (time.sleep(0.5), save_index(*of))
begin, x = Path(sys.argv[1]), eval(sys.argv[2])
Path(begin.parent, f"ready {sys.argv[3]}").touch()
while not begin.exists(): time.sleep(0.01)
print(double(x), len(double.stats.cache_misses))
"""


@pytest.mark.slow
def test_processes_that_share_a_cache_compile_each_kernel_once(tmp_path: Path, start: Any) -> None:
    """All begin to compile, and to write the index of a function, at the same time."""
    (tmp_path / "double.py").write_text(DOUBLE)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(tmp_path)}

    def run(number: int, argument: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-c", TOGETHER, str(tmp_path / "begin"), argument, str(number)]
        return start(command, env=environment, stdout=subprocess.PIPE, text=True)  # type: ignore[no-any-return]

    arguments = ["1.5", "1.5", "1.5", "2"]
    processes = [run(*each) for each in enumerate(arguments)]
    while len([*tmp_path.glob("ready *")]) < len(arguments):
        assert not any(process.poll() for process in processes)
        time.sleep(0.01)
    (tmp_path / "begin").touch()
    found = [process.communicate()[0].split() for process in processes]
    assert [value for value, _ in found] == ["3.0", "3.0", "3.0", "4"]
    assert sum(int(misses) for _, misses in found) == 2  # of float and of int
    later = [run(*each).communicate()[0] for each in enumerate(["1.5", "2"])]
    assert later == ["3.0 0\n", "4 0\n"]
    assert not [*tmp_path.rglob("*.lock")]


QUARTER_TURN = """
import numpy as np
from conservative.kernels.samples import fill, gather_axes
R, w, axes = np.empty((1, 3, 3)), np.empty((1, 3)), gather_axes((1.0, 1.0, 1.0), (np.pi / 2, 1.0), None)
fill(np.ones(1), 1, 1, np.eye(1, 4), np.zeros((1, 3)), axes, R, w)
print(round(R[0, 1, 0]), sum(fill.stats.cache_hits.values()))
"""


@pytest.mark.parametrize("setting", sampled(["__pycache__", "NUMBA_CACHE_DIR"], 1))
def test_an_edit_of_an_inner_function_runs_new_code(tmp_path: Path, setting: str) -> None:
    """The file of the outer kernel and the modification time of the edited file do not change."""
    packages = shutil.ignore_patterns("references", "benchmarks", "reports", "__pycache__")
    shutil.copytree(PACKAGE, tmp_path / "conservative", ignore=packages)
    cache = str(tmp_path / "cache") if setting == "NUMBA_CACHE_DIR" else ""
    environment = {
        "PYTHONPATH": str(tmp_path),
        "NUMBA_CACHE_DIR": cache,
        "NUMBA_DISABLE_JIT": "",
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    assert python(["-c", QUARTER_TURN], **environment) == "1 0"
    assert python(["-c", QUARTER_TURN], **environment) == "1 1"
    arithmetic = tmp_path / "conservative" / "arithmetic.py"
    before, text = arithmetic.stat(), arithmetic.read_text()
    edited = text.replace("fuse(q[1], p[2], q[0] * p[3])", "fuse(q[1], p[2], -(q[0] * p[3]))")
    assert edited != text
    arithmetic.write_text(edited)
    os.utime(arithmetic, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert python(["-c", QUARTER_TURN], **environment) == "-1 0"
    assert python(["-c", QUARTER_TURN], **environment) == "-1 1"


@pytest.mark.parametrize(
    "file", ["arithmetic.py", "kernels/fields.py", "kernels/compiler/traced.py", "potentials/point_to_point.py"]
)
def test_compiled_code_belongs_to_all_files_that_it_is_made_from(tmp_path: Path, file: str) -> None:
    shutil.copytree(PACKAGE, tmp_path / "copy", ignore=shutil.ignore_patterns("references", "benchmarks", "reports"))
    before = digest(tmp_path / "copy")
    assert before == digest(PACKAGE)
    with (tmp_path / "copy" / file).open("a") as source:
        source.write("\n")
    assert digest(tmp_path / "copy") != before


NAMES = sorted({family.method_info.kernel for family in list_families().values() if family.method_info.kernel})
LOOSE = [name for name in NAMES if name != "taylor"]  # which takes its numbers in an array


def named(fields: type) -> Any:
    """Return a named tuple whose values are the names of its fields."""
    return fields(*(f"{fields.__name__}.{name}" for name in fields._fields))  # type: ignore[attr-defined]


def plain_enter(module: ModuleType) -> Any:
    """Return the function `enter` of a kernel as Python."""
    return getattr(module.enter, "py_func", module.enter)


@pytest.mark.parametrize("name", LOOSE)
def test_a_kernel_takes_loose_values_by_the_fields_of_its_tuples(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    module, result, handed = kernels(name), Result(1, 2, 3, None, 0.5, False), []
    monkeypatch.setattr(module, "march", lambda *parts: handed.append(parts) or result)
    monkeypatch.setattr(module, "deliver", lambda result, *parts: handed.append(parts) or (*result, 4))
    parts = named(module.Model), named(module.Coefficients), named(Workspace), named(Output)
    loose = [value for part in parts for value in part]
    found = plain_enter(module)(*loose)
    assert type(found) is tuple
    assert found == (*result, 4)
    assert handed == [parts[:3], parts[2:]]
    assert [type(part) for part in (*handed[0], handed[1][1])] == [type(part) for part in parts]
    for wrong in (loose[:-1], [*loose, 0]):
        with pytest.raises(TypeError, match="Output"):
            plain_enter(module)(*wrong)


def test_a_process_that_is_stopped_is_not_waited_for_without_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The file of the other process stays: it still has its lock."""
    place = tmp_path / "lock"
    monkeypatch.setattr(all_kernels, "lock", lambda path: None)
    monkeypatch.setattr(all_kernels, "PATIENCE", 0.0)
    with all_kernels._alone(place):
        pass
    assert place.exists()


@pytest.mark.slow
def test_without_a_folder_for_compiled_code_a_run_works_and_warns() -> None:
    code = (
        "import warnings, conservative as cv\n"
        "with warnings.catch_warnings(record=True) as told:\n    warnings.simplefilter('always')\n"
        "    print(cv.integrate(cv.scenes.brick_flip(t_end=0.1), 0.01, 'reduced').ok)\n"
        "print(['NUMBA_CACHE_DIR' in str(each.message) for each in told])"
    )
    nowhere = {"NUMBA_CACHE_LOCATOR_CLASSES": "UserProvidedCacheLocator", "NUMBA_CACHE_DIR": "/dev/null/nowhere"}
    status, out, error = run_python(code, **nowhere)
    assert (status, out) == (0, "True\n[True]\n"), error
