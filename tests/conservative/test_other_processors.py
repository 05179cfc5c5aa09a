"""Kernels assume nothing of the processor: plain x86-64 computes the same, and they compile for ARM."""

import ast
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ..environments import PATIENCE, ROOT, variables

SCRIPT = Path(__file__).with_name("other_processor.py")


def run(*arguments, **environment):
    command = [sys.executable, str(SCRIPT), *map(str, arguments)]
    changed = variables(PYTHONPATH=str(ROOT), **environment)
    return subprocess.run(command, env=changed, capture_output=True, text=True, timeout=PATIENCE, check=True).stdout


@pytest.mark.slow
def test_plain_x86_computes_the_same_and_arm_has_code(tmp_path):
    run(tmp_path / "here.npz")
    plain = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": str(tmp_path)}  # no AVX, no FMA
    two_floats = ast.literal_eval(run(tmp_path / "plain.npz", "arm", **plain))
    with np.load(tmp_path / "here.npz") as here, np.load(tmp_path / "plain.npz") as plain:
        for name in here:
            assert np.abs(here[name] - plain[name]).max() < 1e-13, name  # measured 1.4e-15
    assert len(two_floats) >= 6  # measured 10
    assert two_floats["taylor.enter_many"] > 1000  # measured 4367: a register of four floats is two of ARM's
