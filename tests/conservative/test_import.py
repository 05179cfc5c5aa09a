"""Importing the package is cheap, and its public names exist."""

import ast
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

import conservative

FORBIDDEN = ("numba", "llvmlite", "mujoco", "pinocchio", "heyoka", "pandas", "scipy", "altair")
OURS = "[name for name in sys.modules if name.partition('.')[0] == 'conservative']"


def printed(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


def test_importing_the_package_imports_nothing_else():
    found = printed(f"import conservative, sys; print(sorted({OURS}), 'numpy' in sys.modules)")
    assert found == "['conservative', 'conservative.version'] False"


CARD = """
import conservative as cv, numpy as np
s = cv.scenes.brick_flip()
t = cv.Trajectory(s, np.zeros(1), s.R_WB0[None], s.w_WB_B0[None], "x")
repr(t), t._repr_html_()
"""


@pytest.mark.parametrize("code", ["from conservative import *\n", CARD], ids=["public names", "card"])
def test_public_names_and_cards_import_no_compiler_no_engine_and_no_tables(code):
    assert printed(f"{code}import sys; print([m for m in {FORBIDDEN!r} if m in sys.modules])") == "[]"


@pytest.mark.parametrize("name", conservative.__all__)
def test_a_public_name_is_there(name):
    found = getattr(conservative, name)
    assert getattr(found, "__module__", "conservative").startswith("conservative")
    assert getattr(conservative, name) is found


def test_type_checkers_see_the_public_names():
    # A name in a stub is public to type checkers only as `import X as X`.
    stub = Path(conservative.__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    typed = {alias.asname for node in ast.parse(stub).body if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert typed == set(conservative.__all__)


def test_classes_come_back_from_a_pickle():
    assert pickle.loads(pickle.dumps(conservative.Reduced)) is conservative.Reduced
