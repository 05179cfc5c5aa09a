"""Kernels as plain Python and compiled, and code that is cached on disk."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba.core.errors import TypingError

import conservative as cv
from conservative.deferred_imports import kernels
from conservative.kernels.protocol import Result, Workspace, find_ends
from conservative.methods.principal_axes import principal_start
from conservative.methods.run_kernel import prepare_run
from conservative.registry import list_families

SHORT_RUNS = Path(__file__).with_name("short_runs.py")
PACKAGE = Path(cv.__file__).parent


def python(arguments: list[str], **environment: str) -> str:
    """What Python prints with these variables changed; an empty one is removed."""
    known = {**os.environ, **environment}
    command = [sys.executable, "-P", "-W", "error", *arguments]
    return subprocess.run(
        command, env={k: v for k, v in known.items() if v}, stdout=subprocess.PIPE, text=True, check=True
    ).stdout.strip()


def test_plain_python_and_machine_code_agree_on_every_kernel(tmp_path: Path) -> None:
    plain, compiled = tmp_path / "plain.npz", tmp_path / "compiled.npz"
    not_called = python([str(SHORT_RUNS), str(plain)], NUMBA_DISABLE_JIT="1")
    python([str(SHORT_RUNS), str(compiled)], NUMBA_DISABLE_JIT="")
    assert not_called == ""
    with np.load(plain) as ours, np.load(compiled) as theirs:
        assert set(ours) == set(theirs)
        assert len(ours.files) > 100
        for name in ours:
            bound = 1e-13 if name.endswith(", 1") else 1e-8  # measured 7e-14; 4e-9 with steps of radians on a separatrix
            np.testing.assert_allclose(ours[name], theirs[name], rtol=0, atol=bound, err_msg=name)


TURN = """
from conservative.kernels.fields import in_body
print(in_body((1.0, 0.5, 0.0, 0.0), (0.0, 1.0, 0.0))[2], sum(in_body.stats.cache_hits.values()))
"""


@pytest.mark.parametrize("setting", ["__pycache__", "NUMBA_CACHE_DIR"])
def test_an_edit_of_an_inner_kernel_runs_new_code(tmp_path: Path, setting: str) -> None:
    """The file of the outer kernel stays as it is, and so does the time of the file that is edited."""
    rooms = shutil.ignore_patterns("references", "benchmarks", "reports", "__pycache__")
    shutil.copytree(PACKAGE, tmp_path / "conservative", ignore=rooms)
    cache = str(tmp_path / "cache") if setting == "NUMBA_CACHE_DIR" else ""
    environment = {
        "PYTHONPATH": str(tmp_path),
        "NUMBA_CACHE_DIR": cache,
        "NUMBA_DISABLE_JIT": "",
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    assert python(["-c", TURN], **environment) == "-0.8 0"
    assert python(["-c", TURN], **environment) == "-0.8 1"
    vector = tmp_path / "conservative" / "kernels" / "vector.py"
    before, text = vector.stat(), vector.read_text()
    edited = text.replace("return (a[1] * b[2] - a[2] * b[1],", "return (a[2] * b[1] - a[1] * b[2],").replace(
        "a[0] * b[1] - a[1] * b[0])", "a[1] * b[0] - a[0] * b[1])"
    )
    assert edited != text
    vector.write_text(edited)
    os.utime(vector, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert python(["-c", TURN], **environment) == "0.8 0"
    assert python(["-c", TURN], **environment) == "0.8 1"


NAMES = sorted({family.kernel for family in list_families().values() if family.kernel})


def named(fields: type) -> Any:
    """A named tuple whose values are the names of its fields."""
    return fields(*(f"{fields.__name__}.{name}" for name in fields._fields))  # type: ignore[attr-defined]


def plain_enter(module: ModuleType) -> Any:
    """The function `enter` of a kernel as Python."""
    return getattr(module.enter, "py_func", module.enter)


@pytest.mark.parametrize("name", NAMES)
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


@pytest.mark.parametrize("name", NAMES)
def test_a_field_that_only_one_side_has_is_an_error(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The ends are those of the fields before: a model with one more does not shift what comes behind it."""
    module = kernels(name)
    more = NamedTuple("Model", [(field, Any) for field in (*module.Model._fields, "another")])  # type: ignore[misc]
    assert find_ends(more, module.Coefficients) == (module.MODEL_END + 1, module.COEFFICIENTS_END + 1)
    monkeypatch.setattr(module, "Model", more)
    with pytest.raises(TypeError, match="another"):
        plain_enter(module)(*named(more), *named(module.Coefficients), *named(Workspace))


@pytest.mark.parametrize("name", NAMES)
def test_machine_code_is_not_made_for_another_number_of_values(name: str) -> None:
    module = kernels(name)
    n = module.COEFFICIENTS_END + len(Workspace._fields)
    for wrong in (n - 1, n + 1):
        with pytest.raises((TypeError, TypingError), match="Workspace"):
            module.enter(*[1.0] * wrong)


@pytest.mark.parametrize("values", [5, 7])
def test_the_runner_takes_no_other_number_of_results(values: int) -> None:
    scene = cv.scenes.brick_flip()
    kernel = SimpleNamespace(enter=lambda *loose: (0,) * values, FAILURE="", PAUSE=1)
    run = prepare_run(scene, cv.Grid(0.1, 1), "label", principal_start(scene), kernel, (), ())
    with pytest.raises(TypeError, match="Result"):
        run()
