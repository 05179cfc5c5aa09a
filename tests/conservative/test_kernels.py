"""Kernels as plain Python and compiled, and code that is cached on disk."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import conservative as cv

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
            bound = 1e-13 if name.endswith(", 1") else 1e-9  # measured 7e-15; 1.2e-10 with steps of radians on a separatrix
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
