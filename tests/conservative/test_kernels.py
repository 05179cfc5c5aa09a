"""Kernels as plain Python and compiled, and code that is cached on disk."""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import numpy as np
import pytest

import conservative as cv
from conservative.deferred_imports import kernels
from conservative.kernels import digest
from conservative.kernels.compiler import TRIED
from conservative.kernels.protocol import Result, Workspace
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
@pytest.mark.parametrize("every", [3, pytest.param(1, marks=pytest.mark.slow)])  # every third run calls all functions, too
def test_plain_python_and_machine_code_agree_on_every_kernel(every: int, tmp_path: Path) -> None:
    plain, compiled = tmp_path / "plain.npz", tmp_path / "compiled.npz"
    not_called = python([str(SHORT_RUNS), str(plain), str(every)], NUMBA_DISABLE_JIT="1")
    python([str(SHORT_RUNS), str(compiled), str(every)], NUMBA_DISABLE_JIT="")
    assert not_called == ""
    with np.load(plain) as ours, np.load(compiled) as theirs:
        assert set(ours) == set(theirs)
        assert len(ours.files) > 100
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


OTHER_VERSION = """
import sys, warnings
import numba
numba.__version__ = sys.argv[1]
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    from conservative.kernels import compiler
print(len(told), compiler.LINKED, *(each.message for each in told))
if len(sys.argv) > 2:
    import numpy as np
    import conservative as cv
    top, w = cv.scenes.asymmetric_top(), np.random.default_rng(3).normal(size=(5, 3))
    runs = {name: cv.integrate(top, 0.02, name, t_end=1.0) for name in ("convected", "reduced", "gauss", "taylor", "projected")}
    runs["moser_veselov"] = cv.integrate(cv.scenes.brick_flip(), 0.02, "moser_veselov", t_end=1.0)
    runs["lame"] = cv.integrate(cv.scenes.lagrange_top(), 0.02, "lame", t_end=1.0)
    for name in ("reduced", "taylor"):
        runs[f"many, {name}"] = cv.integrate_many(top, dt=0.02, w_WB_B0=w, t_end=1.0, method=name)
    np.savez(sys.argv[2], **{name: run.R_WB for name, run in runs.items()})
"""


@pytest.mark.slow
def test_kernels_on_a_version_of_numba_that_was_not_tried(tmp_path: Path) -> None:
    """Measured: the same bits, for `Lame` 7e-16 and `Projected` 2e-15."""
    plain, ours = tmp_path / "plain.npz", tmp_path / "ours.npz"
    told = python(["-c", OTHER_VERSION, "99.1.0rc1", str(plain)], NUMBA_CACHE_DIR=str(tmp_path))
    assert told.startswith("1 False numba 99.1.0rc1 is not one of the tried versions")
    assert python(["-c", OTHER_VERSION, numba.__version__, str(ours)]) == "0 True"
    with np.load(plain) as found, np.load(ours) as expected:
        assert len(found.files) == 9
        for name in found:
            most = 5e-15 if name in ("lame", "projected") else 0.0
            np.testing.assert_allclose(found[name], expected[name], rtol=0, atol=most, err_msg=name)


def test_the_tried_versions_of_numba_are_those_of_the_project() -> None:
    """From the oldest one that can be installed to the one that CI installs."""
    project, pins = ((PACKAGE.parent / name).read_text() for name in ("pyproject.toml", ".ci/constraints.txt"))
    found = re.search(r'"numba>=(\d+)\.(\d+)"', project), re.search(r"^numba==(\d+)\.(\d+)", pins, re.MULTILINE)
    assert tuple(tuple(map(int, each.groups())) for each in found if each) == TRIED


QUARTER_TURN = """
import numpy as np
from conservative.kernels.samples import to_body_axes
R, w, one = np.empty((1, 3, 3)), np.empty((1, 3)), (1.0, 1.0, 1.0)
to_body_axes(np.ones(1), np.eye(1, 4), np.zeros((1, 3)), one, (np.pi / 2, 1.0), None, R, w)
print(round(R[0, 1, 0]), sum(to_body_axes.stats.cache_hits.values()))
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
    parts = named(module.Model), named(module.Coefficients), named(Workspace)
    loose = [value for part in parts for value in part]
    found = plain_enter(module)(*loose)
    assert type(found) is tuple
    assert found == result
    assert handed == [parts]
    assert [type(part) for part in handed[0]] == [type(part) for part in parts]
    for wrong in (loose[:-1], [*loose, 0]):
        with pytest.raises(TypeError, match="Workspace"):
            plain_enter(module)(*wrong)


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
